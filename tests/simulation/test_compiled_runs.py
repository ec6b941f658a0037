"""Compiled code has the bits of Python, wherever it starts, pauses and fails."""

import os
import shutil
import subprocess
import sys
import time
from contextlib import AbstractContextManager, nullcontext
from errno import ENOSPC
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import tomli_w

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import SolverError
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import load, validate
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.simulate import run
from frictionsim.simulation.single_dof import SingleDofSimulation
from frictionsim.solvers import compilation, event_driven
from frictionsim.solvers.compilation import Kernel, compilable
from frictionsim.solvers.problems import Problem
from frictionsim.solvers.system import FunctionSystem
from tests.support.compiled_runs import as_compiled, as_python, recorded, simulation_of
from tests.support.drawn_lifts import FAMILIES
from tests.support.many_runs import interpret
from tests.support.problems import LOAD
from tests.support.scenarios import ROOT, SCENARIOS, changed, pulley, python

SINE = {"sine": {"mean": LOAD, "amplitude": 1000.0, "frequency_hz": 1.0}}
# One form, which the tests that are not slow compile as well.
SWINGS = pulley(drive__force=SINE, solver={"duration": 4.0, "rtol": 1e-6})
SHIPPED = ["marble_machine", "epicyclic", "pulley_horizontal", "hard/motor_runs_back"]
SHIPPED += ["hard/no_static_friction", "hard/decay", "shaft", "hoist_drum", "swing_door"]
SHIPPED += ["lift", "hard/lift_slack_rope", "hard/lift_moment_of_slack"]


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_have_the_same_bits(name: str) -> None:
    scenario = fs.load(SCENARIOS / f"{name}.toml")
    assert as_compiled(scenario) == as_python(scenario)


@pytest.mark.parametrize("interval", [0.01, 4.0])
def test_compiled_code_has_the_bits_of_python(interval: float) -> None:
    scenario = validate({**SWINGS, "output": {"interval": interval}}, Path())
    assert as_compiled(scenario) == as_python(scenario)


def drawn_lift(family: str, seed: int) -> fs.Scenario:
    """Return a drawn lift."""
    return validate({**FAMILIES[family](seed), "output": {"interval": 0.05}}, Path())


@pytest.mark.parametrize(
    ("family", "seed"), [("", 0), ("thrown", 3), ("gripped", 5), ("jammed", 3)]
)
def test_buffers_of_one_row_and_calls_of_one_step_change_no_bit(
    family: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    if family:
        interpret(monkeypatch)  # lifts are compiled in the slow tests
        scenario = drawn_lift(family, seed)
    else:
        scenario = validate({**SWINGS, "output": {"interval": 0.01}}, Path())
    expected = as_python(scenario)
    for name in ("COMPILED_BUFFERS", "PYTHON_BUFFERS"):
        monkeypatch.setattr(event_driven, name, (1, 1))
    monkeypatch.setattr(event_driven, "FIRST_CALL", 1.0)
    monkeypatch.setattr(event_driven, "SECONDS_OF_A_CALL", 0.0)
    assert as_compiled(scenario) == as_python(scenario) == expected


@pytest.mark.parametrize("steps", [1, 7, 50])
def test_a_run_that_python_began_is_continued(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = validate({**SWINGS, "output": {"interval": 0.01}}, Path())
    expected = as_python(scenario)
    monkeypatch.setattr(event_driven, "PATIENCE", steps)
    monkeypatch.setattr(event_driven, "STEPS_THAT_PAY", 0.0)
    monkeypatch.setattr(event_driven, "STEPS_THAT_PAY_COMPILING", 0.0)
    monkeypatch.setattr(Kernel, "is_loaded", False)
    monkeypatch.setattr(event_driven, "_python_steps", event_driven.Counter())
    simulation = simulation_of(scenario)
    assert simulation.solve(lambda t: None) is True
    simulation.prepare(RunMonitor())
    assert simulation.solve(lambda t: None) is False
    assert recorded(simulation) == expected


def test_what_ran_often_is_compiled_before_the_next_run_and_a_monitor_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[float] = []

    class Monitor(RunMonitor):
        def compiling(self, expected: float) -> AbstractContextManager[None]:
            told.append(expected)
            return nullcontext()

    monkeypatch.setattr(Kernel, "is_loaded", False)
    monkeypatch.setattr(Kernel, "is_at_hand", False)
    monkeypatch.setattr(event_driven, "_python_steps", event_driven.Counter())
    monkeypatch.setattr(event_driven, "STEPS_THAT_PAY_COMPILING", 100.0)
    scenario = validate(SWINGS, Path())
    for expected in ([], [event_driven.SECONDS_OF_COMPILATION]):
        run(scenario, Monitor())
        assert told == expected


def test_a_long_run_is_compiled_once_it_took_as_long_in_earlier_processes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scenario = validate(SWINGS, Path())
    simulation = simulation_of(scenario)
    assert simulation.solve(lambda t: None) is False
    steps = simulation.statistics()[2] / event_driven.EVALUATIONS_OF_A_STEP
    monkeypatch.setattr(compilation, "folder_of", lambda classes: tmp_path)
    monkeypatch.setattr(event_driven, "PATIENCE", 20)
    monkeypatch.setattr(event_driven, "STEPS_THAT_PAY", 20.0)
    monkeypatch.setattr(event_driven, "STEPS_THAT_PAY_COMPILING", 3.5 * steps)
    pays = []
    for _ in range(6):
        event_driven._python_steps.clear()  # as in a new process
        pays.append(simulation_of(scenario).solve(lambda t: None))
    assert pays[:2] == [False, False]  # an estimate of what is left may be wrong by a half
    assert pays[-1]


FINE = {"shaft_radius": 1e-3, "mu_s": 0.1, "mu_k": 0.1}
CHATTERING = {  # the force on the fine pulley changes its side every 5 ns
    "time": [0.0, *(0.5 + 5e-9 * k for k in range(301))],
    "value": [LOAD, LOAD, *[0.0, 2.0 * LOAD] * 150],
}
HUGE = {"mechanism__cord_radius": 1e50, "effects__viscous_damping__coefficient": 1e50}
FAILURES: dict[str, tuple[dict[str, Any], str]] = {
    "budget_exceeded": (changed(SWINGS, solver__max_steps=100), "limit of 100 steps reached"),
    "chattering": (
        changed(
            SWINGS,
            mechanism__inertia=1e-3,
            effects__shaft_friction=FINE,
            drive__force=CHATTERING,
        ),
        "chattering at t = 0.5",
    ),
    "step_underflow": (
        pulley(solver=SWINGS["solver"], mechanism__inertia=1e-50, **HUGE),
        "at t = ",
    ),
    "non_finite": (
        changed(SWINGS, mechanism__inertia=1e-50, mechanism__load=1e50, **HUGE),
        "after t = 0 s",
    ),
}


@pytest.mark.parametrize("name", FAILURES)
@pytest.mark.parametrize(
    ("first_call", "seconds"),
    [(event_driven.FIRST_CALL, event_driven.SECONDS_OF_A_CALL), (7.0, inf), (1.0, 0.0)],
)
def test_a_run_that_fails_says_why_and_keeps_what_python_keeps(
    name: str,
    first_call: float,
    seconds: float,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """In its first call, in the third after 7 and 70 steps, and in one of many of one step each."""
    monkeypatch.setattr(event_driven, "FIRST_CALL", first_call)
    monkeypatch.setattr(event_driven, "SECONDS_OF_A_CALL", seconds)
    caplog.set_level("INFO", event_driven.LOG.name)
    data, message = FAILURES[name]
    scenario = validate({**data, "output": {"interval": 0.01}}, Path())
    outcomes = []
    for compiled in (False, True):
        simulation = simulation_of(scenario)
        solver: Any = simulation._solver
        if compiled:
            solver.compile()
            assert solver._compiled is not None
        else:
            solver._patience = -1
        with pytest.raises(SolverError, match=message) as failed:
            simulation.solve(lambda t: None)
        assert failed.value.failure == name
        outcomes.append((str(failed.value), recorded(simulation)))
    assert "compiled code failed at t = " in caplog.text
    assert outcomes[0] == outcomes[1]


AS_COMPILED = """
from frictionsim.__main__ import main
from frictionsim.solvers import event_driven
from frictionsim.solvers.problems import Problem
integrate, calls = Problem.integrate, iter(range(event_driven.PATIENCE))
def at_the_start(*arguments):
    next(calls)  # ends the command where Python does not leave the run to compiled code
    return integrate(*arguments)
Problem.integrate = staticmethod(at_the_start)
main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals of POSIX")
def test_a_compiled_run_is_ended_by_a_signal_and_by_max_wall_and_resumed(
    told: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 2 10^6 steps, half a minute as Python, which takes the first 2000 alone."""
    data = changed(SWINGS, solver__max_step=2e-6, output={"interval": 0.5, "checkpoint": 0.05})
    simulation: Any = simulation_of(validate(data, Path()))
    simulation._solver.compile()  # also for the disk, where the other process finds it
    Path("long.toml").write_text(tomli_w.dumps(data))
    process = subprocess.Popen(
        [sys.executable, "-c", AS_COMPILED, "solve", "long.toml", "-o", "a.h5"],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip

    def steps() -> int:
        statistics = fs.open("a.partial.h5").statistics
        assert statistics is not None
        return statistics.steps

    part = Path("a.partial.h5")
    while process.poll() is None and not (part.exists() and steps() > 2 * event_driven.PATIENCE):
        time.sleep(0.01)
    process.terminate()
    _, said = process.communicate(timeout=60.0)
    assert process.returncode == 143, said
    assert "run interrupted: by SIGTERM at t = " in said
    assert fs.open(part).status == "interrupted"
    monkeypatch.setattr(Problem, "integrate", None)  # here it is compiled from the first step
    before = steps()
    _, said = told("resume", "a.h5", "--max-wall", "0.3", code=5)
    assert "wall-time limit of 0.3 s reached at t = " in said
    assert steps() > before
    told("resume", "a.h5")
    told("solve", "long.toml", "-o", "whole.h5")
    assert Path("a.h5").read_bytes() == Path("whole.h5").read_bytes()


@pytest.fixture
def without_numba(tmp_path: Path) -> str:
    """A path of Python on which the import of numba fails."""
    package = tmp_path / "broken" / "numba"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("raise ImportError('no LLVM for this machine')")
    return os.pathsep.join([str(package.parent), str(ROOT)])


AS_LONG = """
from frictionsim.__main__ import main
from frictionsim.solvers import event_driven
event_driven.PATIENCE, event_driven.STEPS_THAT_PAY = 100, 1000.0
main()
"""


def test_without_numba_a_long_run_is_one_warning_and_the_result_of_python(
    without_numba: str, told: Any
) -> None:
    data = changed(
        SWINGS,
        mechanism__initial_angular_velocity=5.0,
        solver__max_step=1e-3,
        output__interval=0.01,
    )
    simulation: Any = simulation_of(validate(data, Path()))
    simulation._solver.compile()  # with code on the disk the run is long enough to load it
    Path("long.toml").write_text(tomli_w.dumps(data))
    told("solve", "long.toml", "-o", "whole.h5")
    command = ["-c", AS_LONG, "solve", "long.toml", "-o", "a.h5", "--quiet"]
    done = python(*command, cwd=Path(), PYTHONPATH=without_numba)
    assert (done.returncode, done.stderr) == (
        0,
        "frictionsim: warning: the equation of motion is not compiled, so that long runs and sweeps"
        " take the time of Python (ImportError: no LLVM for this machine)\n",
    )
    assert Path("a.h5").read_bytes() == Path("whole.h5").read_bytes()


def test_without_numba_a_belt_is_an_error(without_numba: str, here: Path) -> None:
    command = ["-m", "frictionsim", "solve", SCENARIOS / "belt_drive.toml", "-o", "a.h5"]
    done = python(*command, cwd=here, PYTHONPATH=without_numba)
    assert (done.returncode, done.stderr) == (
        2,
        "frictionsim: belts are integrated by compiled code, for which the package numba cannot be"
        " imported (no LLVM for this machine); install it with pip install numba\n",
    )
    assert not (here / "a.h5").exists()


def test_what_cannot_be_compiled_is_said_before() -> None:
    reason = compilation.reason_against
    solver: Any = simulation_of(validate(SWINGS, Path()))._solver
    system = solver._problem.system
    assert reason(system) == ""
    assert reason(system._replace(inertia=None)) == "a value of type NoneType"
    assert reason(system._replace(inertia=lambda: 1.0)) == "a value of type function"
    assert reason(system._replace(load=system)) == "Pulley is nested in itself"
    assert reason(system._replace(damping=np.zeros(1))) == "a value of type ndarray"


@pytest.mark.parametrize("name", ["pulley", "marble_machine", "hoist_drum", "hard/bouncing_body"])
def test_a_mechanism_of_functions_has_the_bits_of_its_named_tuple(
    name: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Python integrates it; where compiling would pay, the reason is said."""
    monkeypatch.setattr(event_driven, "PATIENCE", 20)
    monkeypatch.setattr(event_driven, "STEPS_THAT_PAY", 0.0)
    caplog.set_level("INFO", event_driven.LOG.name)
    scenario = fs.load(SCENARIOS / f"{name}.toml", {"solver.rtol": 1e-6})
    mechanism = mechanism_module(scenario.kind).build(scenario)
    simulation = SingleDofSimulation(scenario, mechanism._replace(system=None))
    assert isinstance(simulation._solver._problem.system, FunctionSystem)  # type: ignore[attr-defined]
    assert simulation.solve(lambda t: None) is False
    assert recorded(simulation) == as_python(scenario)
    said = "the rest of the run is not compiled: a value of type "
    assert [text.startswith(said) for text in caplog.messages] == [True]


def test_a_broken_compiler_is_one_warning(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*arguments: Any) -> Any:
        raise ImportError("no module named numba")

    monkeypatch.setattr(compilation, "_dispatcher", broken)
    scenario = validate(SWINGS, Path())
    for _ in range(2):
        simulation = simulation_of(scenario)
        solver: Any = simulation._solver
        solver.compile()
        assert solver._compiled is None
        assert simulation.solve(lambda t: None) is False
    (warning,) = caplog.messages
    assert warning.endswith("(ImportError: no module named numba)")


class Scale(NamedTuple):
    factor: float

    def times(self, x: float) -> float:
        return self.factor * x


class Repeated(NamedTuple):
    times: float


@compilable
def scaled(scale: Scale, repeated: Repeated) -> float:
    return scale.times(repeated.times)


def test_a_method_hides_no_field_of_its_name_in_another_class() -> None:
    """Equations have a method `power`, parts of belts a field: both are compiled in a process."""
    arguments = Scale(2.0), Repeated(3.0)
    function = Kernel(scaled, arguments).compiled(lambda function: function(*arguments))
    assert function(*arguments) == 6.0


@compilable
def doubled(scale: Scale) -> float:
    return 2.0 * scale.factor


def test_code_that_cannot_be_kept_serves_this_process(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    """On a disk that is full once the code is compiled."""
    from numba.core.caching import IndexDataCacheFile

    def save(*arguments: object) -> None:
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr(IndexDataCacheFile, "save", save)
    monkeypatch.setattr(compilation, "folder_of", lambda classes: tmp_path)
    function = Kernel(doubled, (Scale(1.5),)).compiled(lambda function: function(Scale(1.5)))
    assert function(Scale(1.5)) == 3.0
    assert function.signatures
    assert "the compiled code cannot be kept: [Errno 28] No space left" in caplog.text


def test_warm_up_compiles_what_long_runs_and_sweeps_call(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = {"pulley": SCENARIOS / "pulley.toml"}
    monkeypatch.setattr("frictionsim.api.scenarios.shipped_scenarios", lambda: names)
    fs.warm_up("pulley")
    simulation: Any = simulation_of(load(names["pulley"]))
    assert simulation._solver._kernel.is_loaded
    assert fs.warm_up() == (fs.WarmedUp("pulley", "events", 0.0),)
    assert run_command_line(["warm-up", "shaft"]) == 0
    assert capsys.readouterr().out == "nothing to compile\n"


LAWS = """
from frictionsim.solvers.compilation import compilable


@compilable
def signed(x: float) -> float:
    return {sign}x
"""
OTHER_PACKAGE = LAWS.replace("signed", "mirrored")
CONSTANT = "UNIT = {sign}1.0"
EQUATION = """
from typing import NamedTuple

import constants
import mirrors
from bodies import Body
from factors.laws import signed
from frictionsim.solvers.compilation import compilable
from units import UNIT


class Factor(Body):

    def times(self, x):
        return {sign}self.own(x)


@compilable
def product(factor: Factor, x: float) -> float:
    return constants.UNIT * UNIT * mirrors.mirrored(signed(factor.times(x)))
"""
BASE = """
from typing import NamedTuple


class Body(NamedTuple):
    factor: float

    def own(self, x):
        return {sign}self.factor * x
"""
PROCESS = """
from factors.kinds.equation import Factor, product
from frictionsim.solvers.compilation import Kernel
kernel = Kernel(product, (Factor(2.0),))
before = kernel.is_at_hand
function = kernel.compiled(lambda function: function(Factor(2.0), 1.5))
hits = sum(function.stats.cache_hits.values())
print(function(Factor(2.0), 1.5), before, hits)
"""


def new_process(program: str, folder: Path) -> str:
    """Return the output of a Python that searches a folder first, and keeps its cache there."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
    environment["PYTHONPATH"] = os.pathsep.join([str(folder), str(ROOT)])
    environment["PYTHONDONTWRITEBYTECODE"] = "1"  # else Python's own cache has the old source
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=folder, env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout.strip()


def replace_text(path: Path, text: str) -> None:
    """Replace the text of a file by one of the same length, at the same time to all appearances."""
    times, size = path.stat(), path.stat().st_size
    path.write_text(text)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert path.stat().st_size == size


@pytest.mark.slow
def test_another_process_finds_the_code_on_the_disk_but_not_of_another_source(
    tmp_path: Path,
) -> None:
    """Of an equation, its base class, functions in other folders and packages, of constants."""

    def process() -> str:
        return new_process(PROCESS, tmp_path)

    package = tmp_path / "factors"
    (package / "kinds").mkdir(parents=True)
    for folder in (package, package / "kinds"):
        (folder / "__init__.py").touch()
    sources = {
        package / "laws.py": LAWS,
        package / "kinds" / "equation.py": EQUATION,
        tmp_path / "mirrors.py": OTHER_PACKAGE,
        tmp_path / "bodies.py": BASE,
        tmp_path / "units.py": CONSTANT,
        tmp_path / "constants.py": CONSTANT,
    }
    for path, text in sources.items():
        path.write_text(text.format(sign="+"))
    assert [process(), process()] == ["3.0 False 0", "3.0 True 1"]
    for number, (path, text) in enumerate(sources.items()):
        replace_text(path, text.format(sign="-"))
        value = 3.0 if number % 2 else -3.0
        assert [process(), process()] == [f"{value} False 0", f"{value} True 1"]


BROKEN = """
from typing import NamedTuple

from frictionsim.solvers.compilation import compilable


class Factor(NamedTuple):
    factor: float

    def times(self, x):
        return self.part(x)

    def part(self, x):
        return self.factor.{name} * x


@compilable
def product(factor: Factor, x: float) -> float:
    return factor.times(x)
"""
ATTEMPT = """
import logging, sys
from broken import Factor, product
from frictionsim.solvers.compilation import Kernel
logging.basicConfig(stream=sys.stdout, format="%(message)s")
for i in range(2):
    tried = []
    kernel = Kernel(product, (Factor(2.0),))
    kernel.compiled(lambda function: tried.append(1) or function(Factor(2.0), 1.5))
    print(tried)
"""


def test_an_equation_that_numba_refuses_is_tried_once_and_the_place_is_said(tmp_path: Path) -> None:
    """Not in later processes, until its source changes."""
    source = tmp_path / "broken.py"
    source.write_text(BROKEN.format(name="first"))

    def said(name: str) -> str:
        return (
            "the equation of motion is not compiled, so that long runs and sweeps take the time of"
            f" Python (TypingError: Unknown attribute '{name}' of type float64 ({source}:14))"
        )

    assert new_process(ATTEMPT, tmp_path).splitlines() == [said("first"), "[1]", "[]"]
    assert new_process(ATTEMPT, tmp_path).splitlines() == [said("first"), "[]", "[]"]
    replace_text(source, BROKEN.format(name="other"))
    assert new_process(ATTEMPT, tmp_path).splitlines() == [said("other"), "[1]", "[]"]


OF_THE_PACKAGE = """
from frictionsim.solvers.compilation import Kernel
from frictionsim.solvers.multi_contact_modes import direction_of
{edit}
kernel = Kernel(direction_of, ())
before = kernel.is_at_hand
function = kernel.compiled(lambda function: function(0.0))
print(function(3.0), function(4.0), before, sum(function.stats.cache_hits.values()))
"""
EDIT = """
import pathlib
path = pathlib.Path(direction_of.__code__.co_filename)
path.write_text(path.read_text().replace("return 0.0 if", "return 0.2 if"))
"""


def test_another_process_finds_no_code_of_another_source_of_this_package(tmp_path: Path) -> None:
    """Of the function itself, and of the constants TAUT, 3, and SLACK, 4, of another module.

    A process whose sources are edited while it runs keeps nothing: it compiles what it imported.
    """
    package = tmp_path / "frictionsim"
    shutil.copytree(ROOT / "frictionsim", package, ignore=shutil.ignore_patterns("__pycache__"))

    def printed(edit: str = "") -> str:
        return new_process(OF_THE_PACKAGE.format(edit=edit), tmp_path)

    assert printed() == "0.0 1.0 False 0"
    assert [printed(EDIT), printed()] == ["0.0 1.0 False 0", "0.2 1.0 False 0"]
    constants = package / "results.py"
    text = constants.read_text()
    assert text.count("TAUT, SLACK = 2, 3, 4") == 1
    replace_text(constants, text.replace("TAUT, SLACK = 2, 3, 4", "TAUT, SLACK = 2, 5, 3"))
    assert printed() == "1.0 4.0 False 0"
