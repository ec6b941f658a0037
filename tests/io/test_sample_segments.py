"""Folders of samples: no link in them leads elsewhere, and those of killed runs are removed."""

import os
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from frictionsim.errors import InputError, OutputError
from frictionsim.io.destination import Destination
from frictionsim.io.result_format import SEGMENTS
from frictionsim.io.sample_segments import OWNER, SampleSegments, in_use, segment_folders

PRECIOUS = "precious"
DAMAGED = "missing or damaged; keep the folder 'a.samples-0123abcd'"
DEAD = "99999999"  # no process has this number
pytestmark = pytest.mark.usefixtures("here")


@pytest.fixture
def segments(here: Path) -> SampleSegments:
    """Return two segments of a result in the working directory, and a file that must not change."""
    Path("victim.txt").write_text(PRECIOUS)
    made = SampleSegments(here / "a.samples-0123abcd")
    for number in range(2):
        made.write(number, {"time": np.arange(4.0)}, {})
    return made


def again(segments: SampleSegments) -> SampleSegments:
    return SampleSegments(segments.folder)


def replace_by_link(path: Path, target: Path | str) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(target)


def test_the_owner_is_written_anew_where_a_link_was(segments: SampleSegments) -> None:
    owner = segments.folder / OWNER
    replace_by_link(owner, Path("victim.txt").resolve())
    assert not in_use(segments.folder)
    again(segments).restore(2, segments.checksum)
    assert Path("victim.txt").read_text() == PRECIOUS
    assert owner.read_text() == str(os.getpid())
    assert not owner.is_symlink()
    assert sorted(os.listdir(segments.folder)) == ["000000.segment", "000001.segment", OWNER]


def test_the_owner_of_a_new_folder_follows_no_link(
    segments: SampleSegments, monkeypatch: pytest.MonkeyPatch
) -> None:
    mkdir, target = Path.mkdir, Path("victim.txt").resolve()

    def quickly_linked(path: Path, **options: Any) -> None:
        mkdir(path, **options)
        replace_by_link(path / OWNER, target)

    monkeypatch.setattr(Path, "mkdir", quickly_linked)
    new = SampleSegments.beside(Path("b.h5"))
    new.write(0, {"time": np.arange(4.0)}, {})
    assert Path("victim.txt").read_text() == PRECIOUS
    assert in_use(new.folder)


def test_a_folder_that_is_a_link_is_neither_read_nor_written(segments: SampleSegments) -> None:
    elsewhere = segments.folder.with_name("elsewhere")
    segments.folder.rename(elsewhere)
    segments.folder.symlink_to(elsewhere)
    before = sorted(os.listdir(elsewhere))
    for use in (
        lambda: again(segments).restore(1, 0),
        lambda: again(segments).rows(0, "time", 0, 1),
    ):
        with pytest.raises(InputError, match=DAMAGED):
            use()
    with pytest.raises(OutputError, match="there is a link of that name"):
        again(segments).write(0, {"time": np.zeros(4)}, {})
    again(segments).remove()
    assert sorted(os.listdir(elsewhere)) == before


@pytest.mark.parametrize("number", [0, 1])
def test_segments_that_are_links_are_damaged(number: int, segments: SampleSegments) -> None:
    path = segments.path(number)
    path.rename("elsewhere.segment")
    replace_by_link(path, Path("elsewhere.segment").resolve())
    with pytest.raises(InputError, match=DAMAGED):
        again(segments).restore(2, segments.checksum)
    with pytest.raises(InputError, match=DAMAGED):
        again(segments).rows(number, "time", 0, 1)
    other = SampleSegments.beside(Path("b.h5"))
    other.inherit(segments.folder)
    with pytest.raises(InputError, match=DAMAGED):
        other.restore(2, segments.checksum)


def test_a_link_in_the_place_of_a_segment_to_come_is_replaced(segments: SampleSegments) -> None:
    for number, target in ((2, "victim.txt"), (3, "none.txt"), (5, "victim.txt")):
        replace_by_link(segments.path(number), Path(target).resolve())
    segments.free_bytes()
    resumed = again(segments)
    resumed.restore(2, segments.checksum)
    for number in range(2, 6):
        resumed.write(number, {"time": np.arange(4.0)}, {})
    resumed.check(6, resumed.checksum)
    assert Path("victim.txt").read_text() == PRECIOUS
    assert not Path("none.txt").exists()


def test_the_folder_of_another_user_is_not_written(
    segments: SampleSegments, monkeypatch: pytest.MonkeyPatch
) -> None:
    owner = segments.folder / OWNER
    owner.unlink()
    other: Any = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: other)
    with pytest.raises(InputError, match="belongs to another user; resume into another file with"):
        again(segments).restore(2, segments.checksum)
    assert not owner.exists()


def test_a_pipe_is_not_waited_for(segments: SampleSegments) -> None:
    segments.path(0).unlink()
    os.mkfifo(segments.path(0))
    with pytest.raises(InputError, match=DAMAGED):
        again(segments).rows(0, "time", 0, 1)


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
def test_folders_of_killed_runs_are_removed_by_a_run_without_segments(owner: str | None) -> None:
    left_over("a.samples-0123abcd", owner)
    closed("a.h5")
    assert os.listdir() == []


def test_folders_of_other_results_and_of_unfinished_runs_stay() -> None:
    left_over("b.samples-0123abcd")
    left_over("a.samples-0123abcd", str(os.getpid()))
    closed("a.h5")
    assert sorted(os.listdir()) == ["a.samples-0123abcd", "b.samples-0123abcd"]


@pytest.mark.parametrize("name", ["a.h5", "a.nc", "a.partial.h5", "renamed.h5"])
def test_folders_that_a_result_of_any_name_refers_to_stay(name: str) -> None:
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
