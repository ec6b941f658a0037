"""The output file: NAME.partial.h5 until the run is done."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import Interrupted, OutputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.io.destination import Destination
from frictionsim.io.unfinished import partial_name, whole_name
from frictionsim.results import Record
from frictionsim.scenario.loading import validate
from frictionsim.simulation.simulate import run
from tests.support.scenarios import SCENARIOS, pulley, simulate
from tests.support.stopped_runs import spent, stopping

PULLEY = str(SCENARIOS / "pulley.toml")
# The limit is reached at the first step: the run has one sample and can be resumed.
NO_TIME = ["--max-wall", "1e-9"]
OTHER = ["--set", "solver.duration=2.5"]
EXISTS = "the file exists and no-clobber forbids to replace it"
pytestmark = pytest.mark.usefixtures("here")


def solve(*options: str) -> int:
    return run_command_line(["solve", PULLEY, "-q", *options])


def resume(*arguments: str) -> int:
    return run_command_line(["resume", "-q", *arguments])


def status(path: str) -> str:
    return hdf5_reader.read(Path(path)).attributes["status"]


def stopped(after: int, error: Callable[[float], Exception] = spent) -> Record:
    """Return a run of the pulley that stops after some calls of `on_step`."""
    return run(validate(pulley(), SCENARIOS), stopping(after, error))


ERRORS: list[Callable[[float], Exception]] = [
    spent,
    lambda t: Interrupted(2, t),
    lambda t: ArithmeticError(),
]


def files() -> set[str]:
    return {path.name for path in Path().iterdir()}


@pytest.mark.parametrize(
    ("whole", "part"),
    [
        ("a.h5", "a.partial.h5"),
        ("down/a.b.nc", "down/a.b.partial.nc"),
        ("result", "result.partial"),
        ("a.partial.h5", "a.partial.partial.h5"),
    ],
)
def test_partial_name_and_whole_name_are_inverse(whole: str, part: str) -> None:
    assert partial_name(Path(whole)) == Path(part)
    assert whole_name(Path(part)) == Path(whole)


@pytest.mark.parametrize("name", ["a.h5", "partial.h5", ".partial.h5", "partial", "a.partially.h5"])
def test_whole_name_keeps_other_names(name: str) -> None:
    assert whole_name(Path(name)) == Path(name)


def test_an_incomplete_result_does_not_replace_a_complete_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert solve("-o", "new.h5", *OTHER) == 0
    assert solve("-o", "a.h5") == 0
    old, new = Path("a.h5").read_bytes(), Path("new.h5").read_bytes()
    capsys.readouterr()
    assert run_command_line(["solve", PULLEY, "--json", "-o", "a.h5", *OTHER, *NO_TIME]) == 5
    captured = capsys.readouterr()
    assert json.loads(captured.out)["output"] == "a.partial.h5"
    assert captured.err.splitlines()[1:] == [
        "frictionsim: samples up to this time are in a.partial.h5, status 'failed';"
        " a.h5 is unchanged",
        "frictionsim: 'frictionsim resume a.partial.h5' continues the run",
    ]
    assert Path("a.h5").read_bytes() == old
    for _ in range(2):  # incomplete again
        assert resume("a.partial.h5", *NO_TIME) == 5
        assert "'frictionsim resume a.partial.h5' continues the run" in capsys.readouterr().err
        assert status("a.partial.h5") == "failed"
        assert Path("a.h5").read_bytes() == old
    # Into another file, the incomplete result stays.
    assert resume("a.partial.h5", "-o", "b.h5") == 0
    assert (status("a.partial.h5"), status("b.h5")) == ("failed", "done")
    assert Path("a.h5").read_bytes() == old
    assert run_command_line(["resume", "a.partial.h5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["output"] == "a.h5"
    assert Path("a.h5").read_bytes() == new
    assert files() == {"a.h5", "b.h5", "new.h5"}


def test_an_unfinished_result_replaces_an_unfinished_one_and_goes_when_the_run_is_done() -> None:
    Path("a.partial.h5").touch()  # empty, as mktemp makes it
    place = Destination(Path("a.h5"))
    for after in (20, 30):
        assert place.write(stopped(after)) == Path("a.partial.h5")
    place.close()
    assert files() == {"a.partial.h5"}
    assert solve("-o", "a.h5") == 0
    assert files() == {"a.h5"}


def test_a_resumed_run_is_not_written_through_a_link_that_nobody_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert solve("-o", "precious.h5", *OTHER) == 0
    assert solve("-o", "a.h5", *NO_TIME) == 5
    precious = Path("precious.h5").read_bytes()
    Path("a.h5").symlink_to("precious.h5")
    capsys.readouterr()
    assert resume("a.partial.h5") == 4
    refused = "a.h5: cannot write the result: this is a link; remove it, or give another name\n"
    assert capsys.readouterr().err == f"frictionsim: {refused}"
    assert Path("precious.h5").read_bytes() == precious
    # One that the user names is followed.
    assert resume("a.partial.h5", "-o", "a.h5") == 0
    assert Path("precious.h5").read_bytes() != precious
    assert Path("a.h5").is_symlink()


def test_what_was_put_in_the_place_of_the_unfinished_result_stays(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert solve("-o", "b.h5") == 0
    done = Path("b.h5").read_bytes()
    for content in (b"precious", done):
        place = Destination(Path("a.h5"))
        place.check()
        Path("a.partial.h5").write_bytes(content)  # while the run goes on
        assert place.write(simulate(pulley())) == Path("a.h5")
        place.close()
        assert Path("a.partial.h5").read_bytes() == content
        Path("a.partial.h5").unlink()
    Path("b.h5").rename("a.partial.h5")
    capsys.readouterr()
    assert solve("-o", "a.h5") == 4
    assert capsys.readouterr().err == (
        "frictionsim: a.partial.h5: cannot write the result: this file has the name of an"
        " unfinished result, but its run is done; rename it, or give another name\n"
    )
    assert Path("a.partial.h5").read_bytes() == done
    assert files() == {"a.h5", "a.partial.h5"}


def test_a_run_without_samples_replaces_no_samples() -> None:
    """An earlier unfinished result, which has samples, is kept."""
    place = Destination(Path("a.h5"))
    part = Path("a.partial.h5")
    assert place.write(stopped(0, lambda t: Interrupted(15, t))) == part  # no file yet
    assert place.write(stopped(30)) == part
    before = part.read_bytes()
    for error in ERRORS:
        assert place.write(stopped(0, error)) is None
        assert part.read_bytes() == before


def test_another_process_is_told_of_a_run_that_writes_here(
    capsys: pytest.CaptureFixture[str],
) -> None:
    codes = list[int]()

    def another(t: float) -> None:
        codes.append(solve("-o", "a.h5") if len(codes) == 1 else 0)

    fs.solve(PULLEY, output="a.h5", progress=another)  # before there is anything to read
    assert codes[1] == 4
    assert "another process is writing it now" in capsys.readouterr().err
    Path("a.h5").unlink()
    place = Destination(Path("a.h5"))
    place.check()
    place.write(stopped(30))
    for command in (["solve", PULLEY, "-o", "a.h5"], ["resume", "a.partial.h5"]):
        assert run_command_line([*command, "-q"]) == 4
        assert capsys.readouterr().err == (
            "frictionsim: a.h5: cannot write the result: another process is writing it now; wait"
            " for its end, or give another name\n"
        )
    place.close()
    assert resume("a.partial.h5") == 0
    assert files() == {"a.h5"}


def test_an_unfinished_result_of_an_earlier_version_is_resumed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert solve("-o", "whole.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == 5
    Path("a.partial.h5").rename("a.h5")  # as it was called
    assert resume("a.h5", *NO_TIME) == 5
    assert files() == {"a.partial.h5", "whole.h5"}
    Path("a.h5").write_bytes(Path("a.partial.h5").read_bytes())
    capsys.readouterr()
    assert resume("a.h5") == 4
    assert "a.partial.h5 is one too; resume that, or move one" in capsys.readouterr().err
    Path("a.partial.h5").unlink()
    assert resume("a.h5") == 0
    assert files() == {"a.h5", "whole.h5"}
    assert Path("a.h5").read_bytes() == Path("whole.h5").read_bytes()


def test_solve_says_that_nothing_was_written(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solve("-o", "a.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == 5
    before = Path("a.partial.h5").read_bytes()
    capsys.readouterr()
    empty = stopped(0, lambda t: Interrupted(15, t))
    monkeypatch.setattr("frictionsim.api.solving.run", lambda *_: empty)
    assert run_command_line(["solve", PULLEY, "--json", "-o", "a.h5"]) == 143
    captured = capsys.readouterr()
    assert json.loads(captured.out)["output"] is None
    assert "no samples were computed; a.h5 is unchanged" in captured.err
    assert Path("a.partial.h5").read_bytes() == before
    assert run_command_line(["solve", PULLEY, "-o", "a.h5"]) == 143
    assert "result: none\n" in capsys.readouterr().out


def test_checkpoints_keep_a_complete_result_and_are_removed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert solve("-o", "a.h5") == 0
    written: list[Path] = []
    write = hdf5_writer.write

    def noting(result: Record, path: Path, part: Any = None) -> None:
        written.append(path)
        write(result, path, part)

    monkeypatch.setattr(hdf5_writer, "write", noting)
    assert solve("-o", "a.h5", *OTHER, "--set", "output.checkpoint=1e-3") == 0
    assert len(written) > 1
    assert written == [Path("a.partial.h5")] * (len(written) - 1) + [Path("a.h5")]
    assert files() == {"a.h5"}


def test_a_failed_checkpoint_only_warns(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write = hdf5_writer.write

    def refusing(result: Record, path: Path, part: Any = None) -> None:
        if result.status != "done":
            raise OutputError("no room")
        write(result, path, part)

    monkeypatch.setattr(hdf5_writer, "write", refusing)
    Path("s.toml").write_text(tomli_w.dumps(pulley(output__checkpoint=1e-4)))
    assert run_command_line(["solve", "s.toml", "-q", "-o", "a.h5"]) == 0
    assert capsys.readouterr().err == "frictionsim: warning: checkpoint not written: no room\n"


def test_a_partial_name_that_is_too_long_is_reported_before_the_run() -> None:
    whole = Path("a" * 244 + ".h5")  # the limit is 255 bytes; the partial name is longer
    with pytest.raises(OutputError, match=r"\.h5: cannot write the result: File name too"):
        Destination(whole).check()
    assert files() == set()


def test_no_clobber_keeps_any_existing_file(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("a.h5").touch()
    cost = [["cost", PULLEY, option, "a.h5"] for option in ("-o", "--csv", "--plot")]
    with monkeypatch.context() as patched:
        patched.setattr("frictionsim.api.solving.run", None)  # refused before the run
        for command in (["solve", PULLEY, "-q", "-o", "a.h5"], *cost):
            assert run_command_line([*command, "--no-clobber"]) == 4
            assert f"a.h5: {EXISTS}" in capsys.readouterr().err
            assert Path("a.h5").read_bytes() == b""


def test_no_clobber_lets_new_files_be_written_and_resume_replace_its_own() -> None:
    assert solve("-o", "b.h5", "--no-clobber") == 0
    assert solve("--no-clobber") == 0
    assert solve("--no-clobber") == 4  # the default output
    assert solve("-o", "a.h5") == 0
    assert solve("-o", "a.h5", *NO_TIME) == solve("-o", "c.h5", *NO_TIME) == 5
    for arguments in (["c.h5", "-o", "b.h5"], ["a.partial.h5"]):
        assert resume(*arguments, "--no-clobber") == 4
    assert solve("-o", "c.h5", "--no-clobber") == 4
    assert resume("c.h5", "--no-clobber") == 0
