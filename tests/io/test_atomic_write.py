"""Replacing a file that another program has open, as Windows refuses it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from frictionsim.cli.commands import run_command_line
from frictionsim.errors import OutputError
from frictionsim.io import atomic_write, hdf5_reader
from frictionsim.io.atomic_write import write_atomically
from tests.support.old_results import old_result
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
OLD, NEW, NEWER = (old_result(name) for name in (b"old", b"new", b"newer"))
HELD = (
    "{0}: cannot replace the file: Access is denied; another program may have it open."
    " The new result is in {1}: close the other program, then rename it"
)
Reader = Callable[..., None]


@pytest.fixture(autouse=True)
def old(here: Path) -> None:
    Path("a.h5").write_bytes(OLD)


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """How long was waited, on a clock that goes by these pauses alone."""
    waited: list[float] = []
    monkeypatch.setattr(atomic_write, "sleep", waited.append)
    monkeypatch.setattr(atomic_write, "monotonic", lambda: sum(waited))
    monkeypatch.setattr(atomic_write, "_kept", {})
    return waited


@pytest.fixture
def reader(monkeypatch: pytest.MonkeyPatch, pauses: list[float]) -> Reader:
    """Have files open, for as many tries to replace each, or until the reader is set anew."""
    replace = Path.replace

    def opened(*names: str, tries: float = float("inf")) -> None:
        left = dict.fromkeys(names, tries)

        def refusing(path: Path, target: Path) -> Path:
            if left.get(target.name, 0) > 0:
                left[target.name] -= 1
                raise PermissionError(13, "Access is denied")
            return replace(path, target)

        monkeypatch.setattr(Path, "replace", refusing)

    return opened


def contents() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Path().iterdir()}


def refused(image: bytes, path: str = "a.h5") -> str:
    with pytest.raises(OutputError) as caught:
        write_atomically(image, Path(path))
    return str(caught.value)


def test_a_reader_is_waited_for(reader: Reader, pauses: list[float]) -> None:
    reader("a.h5", tries=20)
    write_atomically(NEW, Path("a.h5"))
    assert contents() == {"a.h5": NEW}
    assert pauses == [0.05] * 20


def test_what_a_reader_keeps_out_is_kept_beside_the_file_and_replaced_without_waiting(
    reader: Reader, pauses: list[float]
) -> None:
    reader("a.h5")
    assert refused(NEW) == HELD.format("a.h5", "a.new.h5")
    assert contents() == {"a.h5": OLD, "a.new.h5": NEW}
    assert sum(pauses) == pytest.approx(5.0, abs=0.1)
    waited = len(pauses)
    assert refused(NEWER) == HELD.format("a.h5", "a.new.h5")
    assert len(pauses) == waited
    assert contents() == {"a.h5": OLD, "a.new.h5": NEWER}
    reader()
    write_atomically(NEW, Path("a.h5"))
    # What was kept may have become somebody's own: it stays, and is not written to again.
    assert contents() == {"a.h5": NEW, "a.new.h5": NEWER}
    reader("a.h5")
    assert refused(OLD) == HELD.format("a.h5", "a.new2.h5")
    assert contents() == {"a.h5": NEW, "a.new.h5": NEWER, "a.new2.h5": OLD}


def test_a_file_of_the_name_to_keep_is_not_replaced(reader: Reader) -> None:
    Path("a.new.h5").write_bytes(b"precious")
    reader("a.h5")
    assert refused(NEW) == HELD.format("a.h5", "a.new2.h5")
    assert contents() == {"a.h5": OLD, "a.new.h5": b"precious", "a.new2.h5": NEW}


def test_what_was_kept_may_be_open_too(reader: Reader) -> None:
    reader("a.h5")
    refused(NEW)
    reader("a.h5", "a.new.h5")
    assert refused(NEWER) == HELD.format("a.h5", "a.new2.h5")
    assert contents() == {"a.h5": OLD, "a.new.h5": NEW, "a.new2.h5": NEWER}


def test_the_place_is_named_where_the_path_is_a_link(reader: Reader, here: Path) -> None:
    (here / "disk").mkdir()
    Path("a.h5").rename("disk/b.h5")
    Path("a.h5").symlink_to("disk/b.h5")
    reader("b.h5")
    assert refused(NEW) == HELD.format("a.h5", here / "disk" / "b.new.h5")
    assert (here / "disk" / "b.new.h5").read_bytes() == NEW


def test_other_errors_are_not_waited_for(
    monkeypatch: pytest.MonkeyPatch, pauses: list[float]
) -> None:
    def full(*_: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    assert refused(NEW) == "a.h5: cannot write the result: No space left on device"
    assert (pauses, contents()) == ([], {"a.h5": OLD})


def test_the_kept_result_of_a_run_is_whole(
    reader: Reader, capsys: pytest.CaptureFixture[str]
) -> None:
    reader("a.h5")
    assert run_command_line(["solve", PULLEY, "-q", "-o", "a.h5"]) == 4
    assert capsys.readouterr().err == f"frictionsim: {HELD.format('a.h5', 'a.new.h5')}\n"
    assert hdf5_reader.read(Path("a.new.h5")).attributes["status"] == "done"
    assert Path("a.h5").read_bytes() == OLD
