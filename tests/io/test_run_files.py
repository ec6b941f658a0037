"""The output file: NAME.partial.h5 until the run is done."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import Interrupted
from tests.support.scenarios import SCENARIOS, pulley
from tests.support.stopped_runs import spent, stopping

PULLEY = str(SCENARIOS / "pulley.toml")
# The limit is reached at the first step: the run has one sample and can be resumed.
NO_TIME = ["--max-wall", "1e-9"]
OTHER = ["--set", "solver.duration=2.5"]
AT_ONCE = 1e-9  # s, of wall time: the first checkpoint is due after the first step
EXISTS = "the file exists and is not replaced"
pytestmark = pytest.mark.usefixtures("here")


def solve(*options: str) -> int:
    return fs.run_command_line(["solve", PULLEY, "-q", *options])


def resume(*arguments: str) -> int:
    return fs.run_command_line(["resume", "-q", *arguments])


def status(path: str) -> str:
    return fs.open(path).status


def stopped(
    after: int, error: Callable[[float], Exception] = spent, output: str | None = "a.h5"
) -> fs.Result:
    """Return a run of the pulley that stops after some calls of its progress function."""
    return fs.solve(PULLEY, output=output, progress=stopping(after, error))


ERRORS: list[Callable[[float], Exception]] = [spent, lambda t: Interrupted(2, t)]


def files() -> set[str]:
    return {path.name for path in Path().iterdir()}


@pytest.mark.parametrize(
    ("whole", "part"),
    [
        ("a.h5", "a.partial.h5"),
        ("down/a.b.nc", "down/a.b.partial.nc"),
        ("result", "result.partial"),
    ],
)
def test_an_unfinished_result_has_another_name_until_it_is_done(whole: str, part: str) -> None:
    Path("down").mkdir()
    incomplete = stopped(20, output=None)
    assert incomplete.save(whole) == incomplete.save(part) == Path(part)
    assert fs.resume(part).path == Path(whole)
    assert not Path(part).exists()


@pytest.mark.parametrize("name", [".partial.h5", "partial", "a.partially.h5"])
def test_other_names_are_kept(name: str) -> None:
    assert fs.solve(PULLEY, output=name).path == Path(name)


def test_an_incomplete_result_does_not_replace_a_complete_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert solve("-o", "new.h5", *OTHER) == 0
    assert solve("-o", "a.h5") == 0
    old, new = Path("a.h5").read_bytes(), Path("new.h5").read_bytes()
    capsys.readouterr()
    assert fs.run_command_line(["solve", PULLEY, "--json", "-o", "a.h5", *OTHER, *NO_TIME]) == 5
    captured = capsys.readouterr()
    assert json.loads(captured.out)["output"] == "a.partial.h5"
    assert captured.err.splitlines()[1:] == [
        "frictionsim: samples up to this time are in a.partial.h5, status 'failed';"
        " a.h5 is unchanged",
        "frictionsim: 'frictionsim resume a.partial.h5' continues the run",
    ]
    assert Path("a.h5").read_bytes() == old
    assert resume("a.partial.h5", *NO_TIME) == 5  # incomplete again
    assert "'frictionsim resume a.partial.h5' continues the run" in capsys.readouterr().err
    assert (status("a.partial.h5"), Path("a.h5").read_bytes()) == ("failed", old)
    # Into another file, the incomplete result stays.
    assert resume("a.partial.h5", "-o", "b.h5") == 0
    assert (status("a.partial.h5"), status("b.h5")) == ("failed", "done")
    assert Path("a.h5").read_bytes() == old
    assert fs.run_command_line(["resume", "a.partial.h5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["output"] == "a.h5"
    assert Path("a.h5").read_bytes() == new
    assert files() == {"a.h5", "b.h5", "new.h5"}


def test_an_unfinished_result_replaces_an_unfinished_one_and_goes_when_the_run_is_done() -> None:
    Path("a.partial.h5").touch()  # empty, as mktemp makes it
    for after in (20, 30):
        assert stopped(after).path == Path("a.partial.h5")
    assert files() == {"a.partial.h5"}
    assert solve("-o", "a.h5") == 0
    assert files() == {"a.h5"}


def test_what_was_put_in_the_place_of_the_unfinished_result_stays() -> None:
    def surprised(t: float) -> None:
        Path("a.partial.h5").write_bytes(b"precious")

    assert fs.solve(PULLEY, output="a.h5", progress=surprised).path == Path("a.h5")
    assert Path("a.partial.h5").read_bytes() == b"precious"


def test_a_run_without_samples_replaces_no_samples() -> None:
    """An earlier unfinished result, which has samples, is kept."""
    part = Path("a.partial.h5")
    assert stopped(0, lambda t: Interrupted(15, t)).path == part  # no file yet
    assert stopped(30).path == part
    before = part.read_bytes()
    for error in ERRORS:
        assert stopped(0, error).path is None
        assert part.read_bytes() == before


def test_checkpoints_keep_a_complete_result_and_are_removed() -> None:
    assert solve("-o", "a.h5") == 0
    before, seen = Path("a.h5").read_bytes(), set[bool]()

    def meanwhile(t: float) -> None:
        assert Path("a.h5").read_bytes() == before
        seen.add(Path("a.partial.h5").exists())

    changes = {"solver.duration": 2.5, "output.checkpoint": AT_ONCE}
    assert fs.solve(PULLEY, changes, output="a.h5", progress=meanwhile).status == "done"
    assert seen == {False, True}
    assert Path("a.h5").read_bytes() != before
    assert files() == {"a.h5"}


def test_a_failed_checkpoint_only_warns(here: Path, caplog: pytest.LogCaptureFixture) -> None:
    def hindered(t: float) -> None:
        (here / "a.partial.h5").mkdir(exist_ok=True)

    fs.solve(pulley(output__checkpoint=AT_ONCE), output="b.h5", max_steps=60)
    caplog.clear()
    assert fs.resume("b.h5", output="a.h5", progress=hindered).path == Path("a.h5")
    *_, warning = [record.getMessage() for record in caplog.records]
    assert warning.startswith("checkpoint not written: a.partial.h5: cannot write the result: ")


def test_no_clobber_keeps_any_existing_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.h5").touch()
    # Refused before the run, which would tell that it has no time.
    for command in (
        ["solve", PULLEY, "-q", "-o", "a.h5", *NO_TIME],
        ["cost", PULLEY, "--csv", "a.h5"],
    ):
        assert fs.run_command_line([*command, "--no-clobber"]) == 4
        said = capsys.readouterr().err
        assert said.startswith("frictionsim: a.h5: cannot write the ")
        assert said.endswith(f": {EXISTS}; give another name\n")
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
    assert resume("c.partial.h5", "-o", str(Path("c.h5").absolute()), "--no-clobber") == 0
