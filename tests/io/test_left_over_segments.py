"""Folders of samples that killed runs left: removed, unless a result refers to them."""

import os
from pathlib import Path

import h5py
import pytest

from frictionsim.io.destination import Destination
from frictionsim.io.result_format import SEGMENTS
from frictionsim.io.sample_segments import OWNER, SampleSegments, in_use, segment_folders

DEAD = "99999999"  # no process has this number


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def left_over(name: str, owner: str | None = DEAD) -> Path:
    folder = Path(name)
    folder.mkdir()
    if owner is not None:
        (folder / OWNER).write_text(owner)
    return folder


def closed(target: str) -> None:
    """Do what is done at the end of a run that has put nothing into segments."""
    destination = Destination(Path(target))
    destination.segments()
    destination.close()


@pytest.mark.parametrize("owner", [DEAD, None, ""])
def test_those_of_killed_runs_are_removed_by_a_run_without_segments(owner: str | None) -> None:
    left_over("a.samples-0123abcd", owner)
    closed("a.h5")
    assert os.listdir() == []


def test_those_of_other_results_and_of_runs_that_go_on_stay() -> None:
    left_over("b.samples-0123abcd")
    left_over("a.samples-0123abcd", str(os.getpid()))
    closed("a.h5")
    assert sorted(os.listdir()) == ["a.samples-0123abcd", "b.samples-0123abcd"]


@pytest.mark.parametrize("name", ["a.h5", "a.nc", "a.partial.h5", "renamed.h5"])
def test_those_that_a_result_of_any_name_refers_to_stay(name: str) -> None:
    left_over("a.samples-0123abcd")
    with h5py.File(name, "w") as file:
        file.attrs[SEGMENTS] = "a.samples-0123abcd 1 10 0"
    closed("a.h5")
    assert sorted(os.listdir()) == sorted(["a.samples-0123abcd", name])


def test_the_longest_name_of_a_result_has_a_folder(here: Path) -> None:
    result = here / ("a" * 252 + ".h5")
    segments = SampleSegments.beside(result)
    segments._make_folder()
    assert in_use(segments.folder)
    assert segment_folders(result) == [segments.folder]
