"""The pages of the documentation: their code blocks, tables, links and anchors."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.support.scenarios import ROOT

DOCS = ROOT / "docs"
PAGES = {
    str(path.relative_to(ROOT)): path
    for path in (
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        ROOT / "results" / "README.md",
        *sorted(p for p in DOCS.rglob("*.md") if "_build" not in p.parts),
    )
}

# Its own test holds it against the program.
INVENTORY = json.loads((ROOT / "tests" / "inventory.json").read_text(encoding="utf-8"))

FENCE = re.compile(r"^( *)(`{3,})(\{?\w*\}?)\s*$")
COMMENT = re.compile(r"^<!-- (.*) -->$")


class Block(NamedTuple):
    """A fenced block of a page, with the line of its fence.

    Its mark is the comment right above it, which says how it is tested; empty if there is none.
    """

    page: str
    line: int
    language: str
    text: str
    mark: str

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"

    @property
    def skipped(self) -> bool:
        return self.mark.startswith("not run: ")


def blocks(page: str) -> list[Block]:
    """Return the fenced blocks of a page without directives of Sphinx."""
    return [b for b in _blocks(page) if not b.language.startswith("{")]


def _blocks(page: str) -> Iterator[Block]:
    mark, fence, start, language, text = "", "", 0, "", [""]
    for number, line in enumerate(PAGES[page].read_text(encoding="utf-8").splitlines(), start=1):
        match = FENCE.match(line)
        if fence:
            if line.strip() == fence:
                yield Block(page, start, language, "\n".join(text) + "\n", mark)
                fence, mark = "", ""
            else:
                text.append(line)
        elif match:
            fence, language, start, text = match[2], match[3], number, []
        elif line.strip():
            comment = COMMENT.match(line.strip())
            mark = comment[1] if comment else ""


def prose(page: str) -> str:
    """Return a page without its fenced blocks."""
    lines, fence = [], ""
    for line in PAGES[page].read_text(encoding="utf-8").splitlines():
        match = FENCE.match(line)
        if fence:
            fence = "" if line.strip() == fence else fence
        elif match:
            fence = match[2]
        else:
            lines.append(line)
    return "\n".join(lines)


def table(page: str, name: str) -> list[list[str]]:
    """Return the rows of the table below the comment `table: name`, without its heading."""
    below = PAGES[page].read_text(encoding="utf-8").split(f"<!-- table: {name} -->\n")[1]
    rows = below.split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1]] for row in rows]


def names(cell: str) -> list[str]:
    """Return the texts between backticks in a cell."""
    return re.findall(r"`([^`]*)`", cell)


def links(page: str) -> Iterator[str]:
    """Yield the targets of a page's links and pictures."""
    text = re.sub(r"`[^`]*`", "", prose(page))
    yield from re.findall(r"\]\(([^)\s]+)\)", text)
    yield from re.findall(r'(?:src|href)="([^"]+)"', text)


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and MyST make them."""
    text, anchor_names = path.read_text(encoding="utf-8"), set()
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        anchor_names.add(re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-"))
    return anchor_names
