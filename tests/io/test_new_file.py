"""Files that are written once: whole or not at all, and never over another.

That they are refused before the work is told in `tests/messages/command_line.txt`.
"""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

import frictionsim as fs

Told = Callable[..., tuple[str, str]]
NEW = ("new", "pulley", "a.toml")


def test_what_was_put_there_meanwhile_is_not_replaced(
    told: Told, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = here / "a.toml"
    monkeypatch.setattr(os, "fsync", lambda *_: path.write_text("mine"))
    _, said = told(*NEW, code=4)
    assert "the file exists and is not replaced; give another name" in said
    assert path.read_text() == "mine"


@pytest.mark.parametrize("has_links", [True, False])
@pytest.mark.parametrize("function", ["fsync", "link"])
def test_at_no_time_is_a_part_of_a_file_there(
    function: str, has_links: bool, told: Told, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, contents = here / "a.toml", []
    original = getattr(os, function)

    def observed(*arguments: object) -> None:
        contents.append(path.read_text() if path.exists() else None)
        if function == "link" and not has_links:
            raise OSError(errno.EPERM, "no links here")
        original(*arguments)

    monkeypatch.setattr(os, function, observed)
    told(*NEW)
    assert contents[0] is None
    text = path.read_text()
    assert text.endswith(fs.new("pulley"))
    assert set(contents) <= {None, text}
    assert {file.name for file in here.iterdir()} == {"a.toml", "pulley.schema.json"}


def test_nothing_is_left_of_a_file_that_cannot_be_written(
    told: Told, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no space")

    monkeypatch.setattr(os, "fsync", full)
    assert "no space" in told(*NEW, code=4)[1]
    assert list(here.iterdir()) == []
