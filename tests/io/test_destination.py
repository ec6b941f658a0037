"""Where results go: a part of one beside a whole one, never in its place."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import tomli_w

from frictionsim.cli.commands import run_command_line
from frictionsim.errors import BudgetExceeded, Interrupted, OutputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.io.destination import Destination, partial_name, whole_name
from frictionsim.scenario.loading import validate
from frictionsim.simulation.simulate import RunResult, run
from tests.support.scenarios import SCENARIOS, pulley

PULLEY = str(SCENARIOS / "pulley.toml")
# Every look at the clock finds this spent: the run has its first sample then, and can go on.
NO_TIME = ["--max-wall", "1e-9"]
OTHER = ["--set", "solver.duration=2.5"]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def solve(*options: str) -> int:
    return run_command_line(["solve", PULLEY, "-q", *options])


def status(path: str) -> str:
    return hdf5_reader.read(Path(path)).attributes["status"]


def stopping(after: int, error: Callable[[float], Exception]) -> RunResult:
    """Return the run of the pulley that ends at a call of its poll."""
    calls = iter(range(after))

    def on_step(t: float) -> None:
        if next(calls, None) is None:
            raise error(t)

    return run(validate(pulley(), SCENARIOS), on_step)


def spent(t: float) -> BudgetExceeded:
    return BudgetExceeded(f"stopped at t = {t} s")


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("whole", "part"),
    [
        ("a.h5", "a.partial.h5"),
        ("down/a.b.nc", "down/a.b.partial.nc"),
        ("result", "result.partial"),
        ("a.partial.h5", "a.partial.partial.h5"),
    ],
)
def test_the_names_of_parts(whole: str, part: str) -> None:
    assert partial_name(Path(whole)) == Path(part)
    assert whole_name(Path(part)) == Path(whole)


@pytest.mark.parametrize("name", ["a.h5", "partial.h5", ".partial.h5", "partial", "a.partially.h5"])
def test_the_names_of_what_is_no_part(name: str) -> None:
    assert whole_name(Path(name)) == Path(name)


def test_a_part_goes_beside_what_is_done_and_the_whole_in_its_place(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert solve("-o", "new.h5", *OTHER) == 0
    assert solve("-o", "a.h5") == 0
    old, new = Path("a.h5").read_bytes(), Path("new.h5").read_bytes()
    capsys.readouterr()
    assert run_command_line(["solve", PULLEY, "--json", "-o", "a.h5", *OTHER, *NO_TIME]) == 5
    said = capsys.readouterr()
    assert json.loads(said.out)["output"] == "a.partial.h5"
    assert said.err.splitlines()[1:] == [
        "frictionsim: the samples up to there are in a.partial.h5, marked 'failed';"
        " a.h5 is as it was",
        "frictionsim: 'frictionsim resume a.partial.h5' goes on from there",
    ]
    assert Path("a.h5").read_bytes() == old
    for _ in range(2):  # again not whole
        assert run_command_line(["resume", "a.partial.h5", "-q", *NO_TIME]) == 5
        assert "'frictionsim resume a.partial.h5' goes on" in capsys.readouterr().err
        assert status("a.partial.h5") == "failed"
        assert Path("a.h5").read_bytes() == old
    assert run_command_line(["resume", "a.partial.h5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["output"] == "a.h5"
    assert Path("a.h5").read_bytes() == new
    assert files(here) == {"a.h5", "new.h5"}


def test_a_failure_and_an_interruption_replace_nothing_that_is_done(here: Path) -> None:
    assert solve("-o", "a.h5") == 0
    old = Path("a.h5").read_bytes()
    for error in (spent, lambda t: Interrupted(2, t), lambda t: ArithmeticError()):
        part = stopping(30, error)
        assert Destination(Path("a.h5")).write(part) == Path("a.partial.h5")
        assert status("a.partial.h5") == part.status
        assert Path("a.h5").read_bytes() == old


def test_a_part_takes_the_place_of_another_part(here: Path) -> None:
    for after in (20, 30):
        assert Destination(Path("a.h5")).write(stopping(after, spent)) == Path("a.h5")
    assert files(here) == {"a.h5"}


def test_a_part_that_is_whole_itself_is_not_replaced_either(here: Path) -> None:
    assert solve("-o", "a.h5") == solve("-o", "a.partial.h5") == 0
    place = Destination(Path("a.h5")).write(stopping(30, spent))
    assert place == Path("a.partial.partial.h5")


@pytest.mark.parametrize("damage", ["cut", "flipped", "no result"])
def test_what_cannot_be_read_is_not_replaced_by_a_part(damage: str, here: Path) -> None:
    # A part that is damaged: of a whole one nothing would be seen.
    Destination(Path("a.h5")).write(stopping(30, spent))
    content = Path("a.h5").read_bytes()
    middle = len(content) // 2
    flipped = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
    damaged = {"cut": content[:middle], "flipped": flipped, "no result": b"old"}[damage]
    Path("a.h5").write_bytes(damaged)
    assert Destination(Path("a.h5")).write(stopping(30, spent)) == Path("a.partial.h5")
    assert Path("a.h5").read_bytes() == damaged


def test_an_empty_file_is_the_place_for_a_part(here: Path) -> None:
    Path("a.h5").touch()  # as mktemp makes it
    assert Destination(Path("a.h5")).write(stopping(30, spent)) == Path("a.h5")


def test_a_table_of_costs_that_is_done_is_not_replaced_by_a_part(here: Path) -> None:
    options = ["--backends", "events", "--tolerances", "1e-3", "--repeats", "1"]
    assert run_command_line(["cost", PULLEY, *options, "-o", "a.h5"]) == 0
    assert Destination(Path("a.h5")).write(stopping(30, spent)) == Path("a.partial.h5")


def test_a_run_that_has_not_begun_takes_no_place(here: Path) -> None:
    """Also not that of a part, which has more samples."""
    place = Destination(Path("a.h5"))
    begun, empty = stopping(30, spent), stopping(0, lambda t: Interrupted(15, t))
    assert place.write(empty) == Path("a.h5")  # nothing is lost
    assert place.write(begun) == Path("a.h5")
    before = Path("a.h5").read_bytes()
    assert place.write(empty) is None
    assert Path("a.h5").read_bytes() == before


def test_the_command_says_that_nothing_was_written(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solve("-o", "a.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == 5
    before = Path("a.partial.h5").read_bytes()
    capsys.readouterr()
    empty = stopping(0, lambda t: Interrupted(15, t))
    monkeypatch.setattr("frictionsim.cli.job.run", lambda *_: empty)
    assert run_command_line(["solve", PULLEY, "--json", "-o", "a.h5"]) == 143
    said = capsys.readouterr()
    assert json.loads(said.out)["output"] is None
    assert "nothing was computed, and nothing written: a.h5 is as it was" in said.err
    assert Path("a.partial.h5").read_bytes() == before
    assert run_command_line(["solve", PULLEY, "-o", "a.h5"]) == 143
    assert "result: none\n" in capsys.readouterr().out


def test_checkpoints_go_beside_what_is_done_and_leave_nothing(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solve("-o", "a.h5") == 0
    written: list[Path] = []
    write = hdf5_writer.write

    def noting(result: RunResult, path: Path) -> None:
        written.append(path)
        write(result, path)

    monkeypatch.setattr(hdf5_writer, "write", noting)
    assert solve("-o", "a.h5", *OTHER, "--set", "output.checkpoint=1e-3") == 0
    assert len(written) > 1
    assert written == [Path("a.partial.h5")] * (len(written) - 1) + [Path("a.h5")]
    assert files(here) == {"a.h5"}


def test_a_whole_result_that_came_meanwhile_is_not_replaced(here: Path) -> None:
    place = Destination(Path("a.h5"))
    assert place.write(stopping(20, spent)) == Path("a.h5")
    assert solve("-o", "a.h5") == 0  # by another process
    assert place.write(stopping(30, spent)) == Path("a.partial.h5")
    assert status("a.h5") == "done"


def test_a_part_in_place_goes_on_in_place(here: Path) -> None:
    assert solve("-o", "whole.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == 5
    assert run_command_line(["resume", "a.h5", "-q", *NO_TIME]) == 5
    assert run_command_line(["resume", "a.h5", "-q"]) == 0
    assert Path("a.h5").read_bytes() == Path("whole.h5").read_bytes()
    assert files(here) == {"a.h5", "whole.h5"}


def test_a_part_stays_a_part_though_the_whole_is_gone(here: Path) -> None:
    assert solve("-o", "a.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == 5
    Path("a.h5").unlink()
    assert run_command_line(["resume", "a.partial.h5", "-q", *NO_TIME]) == 5
    assert files(here) == {"a.partial.h5"}
    assert run_command_line(["resume", "a.partial.h5", "-q"]) == 0
    assert files(here) == {"a.h5"}


def test_a_part_that_goes_on_into_another_file_stays(here: Path) -> None:
    assert solve("-o", "a.h5") == 0
    old = Path("a.h5").read_bytes()
    assert solve("-o", "a.h5", *OTHER, *NO_TIME) == 5
    assert run_command_line(["resume", "a.partial.h5", "-q", "-o", "b.h5"]) == 0
    assert (status("a.partial.h5"), status("b.h5")) == ("failed", "done")
    assert Path("a.h5").read_bytes() == old


def test_a_name_for_parts_that_cannot_be_is_told_before_the_run(here: Path) -> None:
    whole = Path("a" * 250 + ".h5")  # of 255 bytes at most; the part's name is longer
    whole.write_bytes(b"old")
    with pytest.raises(OutputError, match=r"partial\.h5: cannot write the result: File name too"):
        Destination(whole).check()


def test_a_folder_is_no_place_for_parts(here: Path) -> None:
    assert solve("-o", "a.h5") == 0
    Path("a.partial.h5").mkdir()
    assert solve("-o", "a.h5", *NO_TIME) == 5
    assert status("a.partial.partial.h5") == "failed"


@pytest.mark.parametrize("content", [b"", b"old", b"\x89HDF\r\n\x1a\n"])
def test_no_clobber_keeps_any_file(
    content: bytes, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("a.h5").write_bytes(content)
    with monkeypatch.context() as patched:
        patched.setattr("frictionsim.cli.job.run", None)  # it is refused before
        assert solve("-o", "a.h5", "--no-clobber") == 4
        message = "a.h5: cannot write here: there is a file, which --no-clobber protects"
        assert message in capsys.readouterr().err
    assert Path("a.h5").read_bytes() == content
    assert solve("-o", "b.h5", "--no-clobber") == 0
    assert solve("--no-clobber") == 0
    assert solve("--no-clobber") == 4  # the default place


def test_no_clobber_of_resume_means_other_files_than_its_own(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert solve("-o", "b.h5") == solve("-o", "a.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == solve("-o", "c.h5", *NO_TIME) == 5
    for arguments in (["c.h5", "-o", "b.h5"], ["a.partial.h5"]):
        assert run_command_line(["resume", *arguments, "--no-clobber"]) == 4
    assert run_command_line(["resume", "c.h5", "--no-clobber"]) == 0


@pytest.mark.parametrize("option", ["-o", "--csv", "--plot"])
def test_no_clobber_of_cost(option: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.png").write_bytes(b"old")
    assert run_command_line(["cost", PULLEY, option, "a.png", "--no-clobber"]) == 4
    assert "a.png: cannot write here: there is a file" in capsys.readouterr().err
    assert Path("a.png").read_bytes() == b"old"


def test_a_checkpoint_that_cannot_be_written_does_not_stop_the_run(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write = hdf5_writer.write

    def refusing(result: RunResult, path: Path) -> None:
        if result.status != "done":
            raise OutputError("no room")
        write(result, path)

    monkeypatch.setattr(hdf5_writer, "write", refusing)
    Path("s.toml").write_text(tomli_w.dumps(pulley(output__checkpoint=1e-4)))
    assert run_command_line(["solve", "s.toml", "-q", "-o", "a.h5"]) == 0
    assert capsys.readouterr().err == "frictionsim: warning: no checkpoint: no room\n"


def test_a_run_that_failed_at_its_start_replaces_nothing(here: Path) -> None:
    """Neither a spent budget nor a failure without a sample beyond the start is worth a file."""
    whole = Path("a.h5")
    Destination(whole).write(stopping(30, spent))
    part = whole.read_bytes()
    for error in (spent, lambda t: Interrupted(2, t), lambda t: ArithmeticError()):
        assert Destination(whole).write(stopping(1, error)) is None
        assert whole.read_bytes() == part
