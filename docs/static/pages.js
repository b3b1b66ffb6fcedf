// Code, equations and tables that are wider than the page can be scrolled by keyboard.
document.addEventListener("DOMContentLoaded", () => {
  for (const block of document.querySelectorAll(".highlight pre, .math-wrapper, .table-wrapper")) {
    if (block.scrollWidth > block.clientWidth) {
      block.tabIndex = 0;
      block.setAttribute("role", "region");
      block.setAttribute("aria-label", block.matches("pre") ? "code" : block.matches(".math-wrapper") ? "equation" : "table");
    }
  }
});
