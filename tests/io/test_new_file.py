"""Files that are written once: whole or not at all, and never over another.

That they are refused before the work is told in `tests/messages/command_line.txt`.
"""

from pathlib import Path

import pytest

from frictionsim.errors import OutputError
from frictionsim.io.new_file import write_new

pytestmark = pytest.mark.quick


def test_what_was_put_there_meanwhile_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.toml"
    monkeypatch.setattr("frictionsim.io.new_file.check_new", lambda *_: path.write_text("mine"))
    with pytest.raises(OutputError, match="the file exists and is not replaced; give another name"):
        write_new(path, "b", "text")
    assert path.read_text() == "mine"


def test_nothing_is_left_of_a_file_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OutputError("no space")

    monkeypatch.setattr("frictionsim.io.atomic_write.write_atomically", full)
    with pytest.raises(OutputError, match="no space"):
        write_new(tmp_path / "a.toml", "b", "text")
    assert list(tmp_path.iterdir()) == []
