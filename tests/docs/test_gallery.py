"""The gallery has a picture of each view of each kind, and all pictures are made by its command."""

import re
import sys

import pytest

from tests.docs.pages import DOCS, INVENTORY, PAGES

sys.path.insert(0, str(DOCS / "_ext"))
import gallery

PNG = b"\x89PNG\r\n\x1a\n"
GIF = b"GIF89a"
MAX_BYTES, MAX_SCREENSHOT, MAX_GIF, MAX_TOTAL = 250_000, 120_000, 600_000, 3_800_000
SHOWN = re.compile(r"!\[[^\]]+\]\(pictures/([\w.]+)\)")


def shown(page: str) -> list[str]:
    return SHOWN.findall(PAGES[page].read_text(encoding="utf-8"))


def test_each_view_of_each_kind_has_a_picture() -> None:
    drawn = {kind: set(titles) for kind, (_, titles) in gallery.VIEWS.items()}
    for kind, titles in gallery.MORE_VIEWS.values():
        drawn[kind] |= set(titles)
    assert drawn == {kind: set(views) for kind, views in INVENTORY["views"].items()}


def test_the_gallery_shows_each_picture_once() -> None:
    assert sorted(shown("docs/gallery.md")) == sorted(p.file for p in gallery.GALLERY)


def test_the_pictures_of_the_walk_through_are_made_by_the_command() -> None:
    used = shown("docs/walk-through.md")
    assert len(used) >= 5
    assert set(used) <= {picture.file for picture in gallery.GALLERY}


@pytest.mark.parametrize("picture", gallery.GALLERY, ids=lambda picture: picture.file)
def test_a_picture_is_there_and_small_and_its_commands_are_known(picture: gallery.Picture) -> None:
    content = (gallery.PICTURES / picture.file).read_bytes()
    moving = picture.file.endswith(".gif")
    assert content.startswith(GIF if moving else PNG)
    still = MAX_SCREENSHOT if picture.scheme else MAX_BYTES
    assert len(content) < (MAX_GIF if moving else still)
    if picture.scheme:
        colour_type = content[25]  # of the header of a PNG
        assert colour_type == 3, "a screenshot has a palette"
    for command in picture.shown:
        program, name, *_ = command.split()
        assert program == "frictionsim"
        assert name in ("new", "solve", "sweep", "cost", "fit", "plot", "report", "show")


def test_no_picture_is_left_over_and_all_are_small() -> None:
    files = list(gallery.PICTURES.iterdir())
    assert {path.name for path in files} == {picture.file for picture in gallery.GALLERY}
    assert sum(path.stat().st_size for path in files) < MAX_TOTAL
