"""The elements of an HTML page: whether they are balanced, and which there are."""

from html.parser import HTMLParser
from typing import Any

VOID = {"meta", "link", "br", "hr", "img", "input", "col", "wbr"}


class Elements(HTMLParser):
    """The elements of a page in their order, those that have no end, its text and its faults."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.faults: list[str] = []
        self._texts: list[str] = []
        self.feed(page)
        self.close()
        self.text = "".join(self._texts)
        self.faults += [f"{tag} has no end" for tag in self.open]

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        self.faults += [f"{tag} has {key}" for key, _ in attrs if key.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"an end of {tag} that has no begin")

    def handle_data(self, data: str) -> None:
        self._texts.append(data)
