"""Files that are written once: whole or not at all, and never over another.

That they are refused before the work is told in `tests/messages/command_line.txt`.
"""

import errno
import os
from pathlib import Path

import pytest

from frictionsim.errors import OutputError
from frictionsim.io.atomic_write import write_new


def test_what_was_put_there_meanwhile_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.toml"
    monkeypatch.setattr("frictionsim.io.atomic_write.check_new", lambda *_: path.write_text("mine"))
    with pytest.raises(OutputError, match="the file exists and is not replaced; give another name"):
        write_new(path, "b", "text")
    assert path.read_text() == "mine"


@pytest.mark.parametrize("has_links", [True, False])
@pytest.mark.parametrize("function", ["fsync", "link"])
def test_at_no_time_is_a_part_of_a_file_there(
    function: str, has_links: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, contents = tmp_path / "a.toml", []
    original = getattr(os, function)

    def observed(*arguments: object) -> None:
        contents.append(path.read_text() if path.exists() else None)
        if function == "link" and not has_links:
            raise OSError(errno.EPERM, "no links here")
        original(*arguments)

    monkeypatch.setattr(os, function, observed)
    write_new(path, "b", "text")
    assert contents[0] is None
    assert set(contents[1:]) <= {"b"}
    assert (path.read_text(), list(tmp_path.iterdir())) == ("b", [path])


def test_nothing_is_left_of_a_file_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no space")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match="no space"):
        write_new(tmp_path / "a.toml", "b", "text")
    assert list(tmp_path.iterdir()) == []
