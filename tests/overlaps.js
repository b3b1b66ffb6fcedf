// Return texts and controls that overlap or cross the page's edge, except in parts that scroll.
() => {
  const boxes = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode, host = node.parentElement;
    if (!node.data.trim() || !host.checkVisibility()) continue;
    if (host.closest(".wide, .skip, option, script, svg")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const box of range.getClientRects()) boxes.push([node.data.trim(), box, host]);
  }
  for (const host of document.querySelectorAll("input, select, canvas, svg")) {
    if (host.closest(".wide")) continue;
    const box = host.getBoundingClientRect();
    if (host.checkVisibility()) boxes.push([host.id || host.tagName, box, host]);
  }
  const found = [];
  boxes.forEach(([a, p, x], i) => boxes.slice(i + 1).forEach(([b, q, y]) => {
    if (x.contains(y) || y.contains(x)) return;
    const wide = Math.min(p.right, q.right) - Math.max(p.left, q.left);
    const high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
    if (wide > 1 && high > 4) found.push(`${a} | ${b}`);
  }));
  for (const [a, box] of boxes)
    if (box.left < -1 || box.right > innerWidth + 1) found.push(`${a} | edge of the page`);
  return found;
}
