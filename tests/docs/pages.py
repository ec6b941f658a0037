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

FENCED = re.compile(r"^ *(`{3,})(\{?\w*\}?) *\n(.*?)^ *\1 *$\n?", re.MULTILINE | re.DOTALL)
COMMENT = re.compile(r"<!-- (.*) -->")


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


def text_of(page: str) -> str:
    return PAGES[page].read_text(encoding="utf-8")


def blocks(page: str) -> list[Block]:
    """Return the fenced blocks of a page without directives of Sphinx."""
    text, found = text_of(page), []
    for fenced in FENCED.finditer(text):
        above = text[: fenced.start()].rstrip().rpartition("\n")[2].strip()
        comment = COMMENT.fullmatch(above)
        line = text.count("\n", 0, fenced.start()) + 1
        found.append(Block(page, line, fenced[2], fenced[3], comment[1] if comment else ""))
    return [block for block in found if not block.language.startswith("{")]


def table(page: str, name: str) -> list[list[str]]:
    """Return the rows of the table below the comment `table: name`, without its heading."""
    below = text_of(page).split(f"<!-- table: {name} -->\n")[1]
    rows = below.split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1]] for row in rows]


def names(cell: str) -> list[str]:
    """Return the texts between backticks in a cell."""
    return re.findall(r"`([^`]*)`", cell)


def links(page: str) -> Iterator[str]:
    """Yield the targets of a page's links and pictures."""
    text = re.sub(r"`[^`]*`", "", FENCED.sub("", text_of(page)))
    yield from re.findall(r"\]\(([^)\s]+)\)", text)
    yield from re.findall(r'(?:src|href)="([^"]+)"', text)


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and MyST make them."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.strip().lower()).replace(" ", "-") for h in headings}
