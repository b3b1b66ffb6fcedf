"""Metadata of the distribution that follow from one address: its links, and its README.

An index shows the README outside the repository, where links to files of the repository lead
nowhere. In the wheel and the sdist they lead to the same files in the repository, at the tag of
the version.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

#: A link of Markdown to a file of the repository or to a heading, and whether it is a picture.
_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:|mailto:)([^)\s]+)\)")
#: Comments of the README, which instruct its tests.
_COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)


def links(owner: str) -> dict[str, str]:
    """Return the links of the project: each follows from the owner of its repository."""
    source = f"https://github.com/{owner}/rockframe"
    return {
        "Documentation": f"https://{owner.lower()}.github.io/rockframe",
        "Source": source,
        "Changelog": f"{source}/blob/main/CHANGELOG.md",
        "Issues": f"{source}/issues",
    }


def long_description(readme: str, owner: str, version: str) -> str:
    """Return the README with the full address of each file that it links to."""
    source = links(owner)["Source"]

    def full(link: re.Match[str]) -> str:
        picture, text, target = link.groups()
        path = f"README.md{target}" if target.startswith("#") else target
        return f"{picture}[{text}]({source}/{'raw' if picture else 'blob'}/v{version}/{path})"

    return _LINK.sub(full, _COMMENT.sub("", readme))


class FromOneAddress(MetadataHookInterface):
    """Fill in `urls` and `readme`, which `pyproject.toml` declares dynamic."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Add both to the metadata of the project."""
        owner = self.config["owner"]
        readme = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["urls"] = links(owner)
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": long_description(readme, owner, metadata["version"]),
        }
