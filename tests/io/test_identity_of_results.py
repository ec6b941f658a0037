"""A result whose reading failed for another reason than the file is read again."""

from pathlib import Path
from typing import Any

import h5py
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.io.checksum import append_trailer
from frictionsim.io.child_process import ChildFailed, EndedFromOutside
from tests.support.scenarios import pulley, simulate


@pytest.fixture
def result(tmp_path: Path) -> Path:
    path = tmp_path / "a.h5"
    hdf5_writer.write(simulate(pulley(output__interval=0.5)), path)
    return path


def with_status(path: Path, status: str) -> Path:
    with h5py.File(path, "r+") as file:
        file.attrs["status"] = status
    append_trailer(path)
    return path


def failing(monkeypatch: pytest.MonkeyPatch, *failures: Exception) -> None:
    """Have the next children fail, those after them not."""
    left, run = list(failures), hdf5_reader.run_in_child

    def run_or_fail(*arguments: Any) -> Any:
        if left:
            raise left.pop(0)
        return run(*arguments)

    monkeypatch.setattr(hdf5_reader, "run_in_child", run_or_fail)


def test_a_failure_of_the_child_is_not_remembered(
    result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_status(result, "interrupted")
    failing(monkeypatch, ChildFailed("crashed"))
    assert hdf5_reader.may_be_done(result)  # nothing is known of it
    assert not hdf5_reader.may_be_done(result)


def test_a_child_that_was_ended_from_outside_is_tried_once_more(
    result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing(monkeypatch, EndedFromOutside("ended"))
    assert not hdf5_reader.may_be_done(with_status(result, "interrupted"))
    failing(monkeypatch, EndedFromOutside("ended"), EndedFromOutside("ended again"))
    with pytest.raises(InputError, match=r"a\.h5: cannot read this result: ended again"):
        fs.open(result)
