"""The gallery has a picture of each view, and all pictures are made by its commands."""

import re
import sys

import pytest

from tests.docs.pages import DOCS, INVENTORY, PAGES

sys.path.insert(0, str(DOCS / "_ext"))
import gallery

PNG = b"\x89PNG\r\n\x1a\n"
GIF = b"GIF89a"
MAX_BYTES, MAX_SCREENSHOT, MAX_GIF, MAX_TOTAL = 250_000, 120_000, 600_000, 3_500_000
FILES = [picture["file"] for picture in gallery.GALLERY]


def shown(page: str) -> list[str]:
    text = PAGES[page].read_text(encoding="utf-8")
    return re.findall(r"!\[[^\]]+\]\(pictures/([\w.]+)\)", text)


def test_each_view_has_a_picture() -> None:
    drawn = {
        view
        for picture in gallery.GALLERY
        for view in re.findall(r"--view (\w+)", picture["commands"][-1])
    }
    assert {view for views in INVENTORY["views"].values() for view in views} <= drawn


def test_the_gallery_shows_each_picture_once() -> None:
    assert shown("docs/gallery.md") == FILES


def test_the_pictures_of_the_walk_through_are_made_by_the_command() -> None:
    used = shown("docs/walk-through.md")
    assert len(used) >= 5
    assert set(used) <= set(FILES)


@pytest.mark.parametrize("picture", gallery.GALLERY, ids=FILES)
def test_a_picture_is_there_and_small(picture: dict[str, str]) -> None:
    content = (gallery.PICTURES / picture["file"]).read_bytes()
    if picture["file"].endswith(".gif"):
        assert content.startswith(GIF)
        assert len(content) < MAX_GIF
        return
    assert content.startswith(PNG)
    assert len(content) < (MAX_SCREENSHOT if "scheme" in picture else MAX_BYTES)
    colour_type = content[25]  # of the header of a PNG
    assert colour_type == 3 or "scheme" not in picture, "a screenshot has a palette"


def test_no_picture_is_left_over_and_all_are_small() -> None:
    files = list(gallery.PICTURES.iterdir())
    assert {path.name for path in files} == set(FILES)
    assert sum(path.stat().st_size for path in files) < MAX_TOTAL
