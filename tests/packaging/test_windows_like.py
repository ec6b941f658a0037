"""The command line where no call of POSIX is there: what Windows lacks or refuses is taken away."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.scenarios import SCENARIOS, frictionsim, python

pytestmark = pytest.mark.slow

PULLEY = SCENARIOS / "pulley.toml"
BELT = SCENARIOS / "belt_drive.toml"
PROGRAM = (
    sys.executable,
    "-X",
    "warn_default_encoding",
    str(Path(__file__).with_name("windows_like.py")),
)


def started(*arguments: str | Path, cwd: Path, **environment: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*PROGRAM, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, **environment},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def output(*arguments: str | Path, cwd: Path) -> str:
    with started(*arguments, cwd=cwd) as process:
        out, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    assert "Traceback" not in said
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a result that was written without POSIX."""
    folder = tmp_path_factory.mktemp("windows")
    assert "result: a.h5" in output("solve", PULLEY, "-o", "a.h5", cwd=folder)
    return folder


REFUSED = {
    "import resource": "ModuleNotFoundError",
    "os.getuid()": "AttributeError",
    "os.set_blocking(1, True)": "AttributeError",
    "os.open('.', os.O_RDONLY)": "PermissionError",
    "signal.SIGHUP": "AttributeError",
    "signal.signal(1, signal.SIG_IGN)": "ValueError",
    "signal.set_wakeup_fd(os.pipe()[1])": "ValueError",
}


def test_what_is_not_there_fails() -> None:
    program = (
        "from tests.packaging.windows_like import *; take_away()\n"
        "for line in sys.argv[1:]:\n"
        "    try: exec(line); print('done')\n"
        "    except Exception as error: print(type(error).__name__)\n"
    )
    done = python("-c", program, *REFUSED, "len('')")
    assert done.stdout.split() == [*REFUSED.values(), "done"]


def test_the_result_is_the_same(folder: Path) -> None:
    assert frictionsim("solve", PULLEY, "-q", "-o", "b.h5", cwd=folder).returncode == 0
    assert (folder / "a.h5").read_bytes() == (folder / "b.h5").read_bytes()


COMMANDS = {
    "--help": "Usage: frictionsim",
    f"check '{PULLEY}' '{BELT}'": "belt_drive.toml: ok",
    f"static '{PULLEY}'": "force_to_lift",
    f"static '{BELT}'": "torque_limit_driven",
    "plot a.h5": "a.png",
    "plot a.h5 --view all --json": "a-response.png",
    "show a.h5": "result: a.h5",
    "show a.h5 --json": '"status": "done"',
    "show a.h5 --csv": "time [s],angle [rad]",
    "show a.h5 --scenario": 'kind = "pulley"',
    "new pulley hoist.toml": "hoist.toml",
    "new belt_drive": 'kind = "belt_drive"',
    "new --list": "belt_verification",
    "schema pulley": '"properties"',
    "schema": '"properties"',
    f"check '{SCENARIOS}' --json": '"ok": true',
    "compare a.h5 a.h5": "the files agree",
    f"solve '{SCENARIOS}/hard/jump_from_csv.toml' -o jump.h5": "result: jump.h5",
    f"cost '{PULLEY}' --backends events --tolerances 1e-3 --repeats 1 --csv c.csv --plot c.png": (
        "for 1 %"
    ),
}


def test_commands_need_no_posix(folder: Path) -> None:
    said = output("+", *COMMANDS, cwd=folder)
    parts = said.split("+ exit code 0\n")
    assert len(parts) == len(COMMANDS) + 1, said
    for part, (command, answer) in zip(parts[:-1], COMMANDS.items(), strict=True):
        assert answer in part, command


def test_several_scenarios_and_the_standard_input_need_no_posix(tmp_path: Path) -> None:
    out = output("solve", PULLEY, SCENARIOS / "pulley_return.toml", "-v", cwd=tmp_path)
    assert out.count("result: results") == 2
    with started("solve", "-", "-o", "a.h5", cwd=tmp_path) as process:
        out, said = process.communicate(PULLEY.read_text(encoding="utf-8"), timeout=300)
    assert (process.returncode, said) == (0, "")
    assert "result: a.h5" in out


@pytest.mark.parametrize("backend", ["moreau", pytest.param("rkf45", marks=pytest.mark.slow)])
def test_belts_need_no_posix(backend: str, tmp_path: Path) -> None:
    few_steps = ["--set", "solver.duration=2e-4"]
    out = output("solve", BELT, "--backend", backend, *few_steps, "-o", "b.h5", cwd=tmp_path)
    assert "result: b.h5" in out
    assert "b.png" in output("plot", "b.h5", cwd=tmp_path)


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_a_signal_ends_a_compilation_at_once(number: signal.Signals, tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    with started("solve", BELT, "-o", "b.h5", cwd=tmp_path, XDG_CACHE_HOME=cache) as process:
        assert process.stderr is not None
        assert "compiling the kernels" in process.stderr.readline()
        time.sleep(1.0)  # of the ten seconds and more that the kernels take
        process.send_signal(number)
        _, said = process.communicate(timeout=300)
    assert process.returncode == 128 + number
    assert said == (
        f"frictionsim: interrupted by {number.name} while compiling kernels; nothing was written\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["cache"]


def test_a_sweep_is_run_twice_alike(folder: Path) -> None:
    sweep = ("sweep", PULLEY, "--vary", "mechanism.load=lin(2000, 2400, 20)")
    loose = ("--set", "solver.rtol=1e-4")
    output(*sweep, *loose, "-j", "1", "-o", "one.h5", cwd=folder)
    output(*sweep, *loose, "-j", "1", "-o", "two.h5", "--csv", "two.csv", cwd=folder)
    assert (folder / "one.h5").read_bytes() == (folder / "two.h5").read_bytes()
    assert not list(folder.glob("*.runs"))
