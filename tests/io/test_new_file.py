"""Files that are written once: whole or not at all, and never over another."""

from pathlib import Path

import pytest

from frictionsim.errors import OutputError
from frictionsim.io.new_file import check_new, write_new

pytestmark = pytest.mark.quick


def test_a_new_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    check_new(path, "scenario")
    write_new(path, "kind = 1\n", "scenario")
    assert path.read_text() == "kind = 1\n"
    assert [found.name for found in tmp_path.iterdir()] == ["a.toml"]


@pytest.mark.parametrize(
    "write", [lambda p: check_new(p, "text"), lambda p: write_new(p, "b", "text")]
)
def test_what_is_there_is_not_replaced(write: object, tmp_path: Path) -> None:
    assert callable(write)
    path = tmp_path / "a.toml"
    path.write_text("mine")
    with pytest.raises(OutputError) as caught:
        write(path)
    why = "the file exists and is not replaced; give another name"
    assert str(caught.value) == f"{path}: cannot write the text: {why}"
    assert path.read_text() == "mine"
    with pytest.raises(OutputError, match="this is a folder; give a file name"):
        write(tmp_path)
    with pytest.raises(OutputError, match="there is no folder"):
        write(tmp_path / "none" / "a.toml")


def test_nothing_is_left_of_a_file_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OutputError("no space")

    monkeypatch.setattr("frictionsim.io.atomic_write.write_atomically", full)
    with pytest.raises(OutputError, match="no space"):
        write_new(tmp_path / "a.toml", "b", "text")
    assert list(tmp_path.iterdir()) == []
