"""Compilation of kernels: announced, not counted as solving, ended by a signal at once."""

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numba
import numpy as np
import pytest

from frictionsim.api.result import Result
from frictionsim.cli.monitor import CommandMonitor
from frictionsim.errors import Interrupted
from frictionsim.mechanisms.belt_drive import numba_kinds
from frictionsim.mechanisms.belt_drive.belt_simulation import BeltDrive
from frictionsim.mechanisms.belt_drive.kernel_folder import seconds_of_compilation
from frictionsim.simulation.monitor import RunMonitor
from tests.support.belt_kernels import assemble, moreau, rkf45, stepper_of
from tests.support.belt_scenarios import COMPILED, NO_MOTION_ACROSS, STEPS, pair, scenario_of
from tests.support.cases import one_in
from tests.support.old_results import old_result
from tests.support.scenarios import ROOT, SCENARIOS, Scenario, changed, pulley, simulate

ANNOUNCED = "frictionsim: compiling the kernels for this combination of effects, once (about "
OLD = old_result()


class Listening(RunMonitor):
    """A poll that records the compilations announced to it."""

    def __init__(self) -> None:
        self.told: list[float] = []
        self.inside = False

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        self.told.append(expected)
        self.inside = True
        yield
        self.inside = False


def plus_one(x: int) -> int:
    return x + 1


def doubled(x: int) -> int:
    return 2 * x


def test_a_compilation_is_told_once_and_timed_and_none_of_what_is_there() -> None:
    first, second, told = numba_kinds.kernel(plus_one), numba_kinds.kernel(doubled), Listening()

    def work() -> None:
        assert first(second(1)) == 3
        assert told.inside

    assert seconds_of_compilation(work, 3.0, told) > 0.0
    assert told.told == [3.0]
    assert not told.inside
    assert seconds_of_compilation(lambda: first(1), 3.0, told) == 0.0
    assert told.told == [3.0]


@pytest.mark.parametrize("quiet", [False, True])
def test_it_is_said_without_a_terminal_but_not_to_the_quiet(
    quiet: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    before = signal.set_wakeup_fd(-1)
    signal.set_wakeup_fd(before)
    with CommandMonitor(1.0, with_progress=False, quiet=quiet) as on_step, on_step.compiling(24.4):
        pass
    assert capsys.readouterr().err == ("" if quiet else f"{ANNOUNCED}24 s)\n")
    assert signal.set_wakeup_fd(before) == before


class Calls:
    """Records the argument types of kernels called from Python: each is compiled for."""

    ENTRIES: ClassVar = {rkf45: ("advance",), moreau: ("integrate_plane", "integrate_line")}

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.seen: set[tuple[str, ...]] = set()
        for module, names in self.ENTRIES.items():
            for name in names:
                monkeypatch.setattr(module, name, self._noting(name, getattr(module, name)))

    def _noting(self, name: str, kernel: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*arguments: Any) -> Any:
            self.seen.add((name, *(str(numba.typeof(argument)) for argument in arguments)))
            return kernel(*arguments)

        return noted


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("data", COMPILED.values(), ids=COMPILED.keys())
def test_all_kernels_are_compiled_before_the_first_step(
    data: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that the seconds of solving have none of it; also of a run that is resumed."""
    calls = Calls(monkeypatch)
    scenario = scenario_of(changed(data, solver__duration=4e-4, output__interval=1e-4))
    polled: list[float] = []

    def stop(t: float) -> None:
        polled.append(t)
        if len(polled) == 3:
            raise Interrupted(signal.SIGINT, t)

    drive = BeltDrive(scenario)
    drive.prepare(RunMonitor())
    prepared = calls.seen.copy()
    assert prepared
    with pytest.raises(Interrupted):
        drive.solve(stop)
    assert calls.seen == prepared
    state = drive.state()
    if state is None:  # SciPy's methods do not go on
        return
    calls.seen.clear()
    resumed = BeltDrive(scenario)
    resumed.restore(state)
    resumed.prepare(RunMonitor())
    prepared = calls.seen.copy()
    resumed.solve(lambda t: None)
    assert calls.seen == prepared


# All there is to give a pulley, over time and over speed, and nothing.
FORMS: dict[str, Scenario] = {
    "nothing": {},
    "number": {"torque": -5.0},
    "points": {"torque": {"time": [0.0, 0.02], "value": [0.0, -5.0]}},
    "sine": {"torque": {"sine": {"amplitude": 5.0, "frequency_hz": 20.0}}},
    "smooth step": {
        "torque": {"smooth_step": {"from": 0.0, "to": -5.0, "start": 0.0, "stop": 0.01}}
    },
    "of speed": {"torque": {"speed": [-20.0, 20.0], "value": [5.0, -5.0]}},
    "speed": {"speed": {"time": [0.0, 0.02], "value": [0.0, -5.0]}},
    "speed, sine": {"speed": {"sine": {"amplitude": 5.0, "frequency_hz": 20.0}}},
}


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("guided", [False, True])
@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
def test_one_kernel_is_compiled_for_all_forms_of_signals(
    backend: str, guided: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    without = NO_MOTION_ACROSS if guided else {}
    calls, seen = Calls(monkeypatch), set()
    for form, drive in FORMS.items():
        data = pair(solver__backend=backend, drive={"driver": drive} if drive else {}, **without)
        calls.seen.clear()
        BeltDrive(scenario_of(data)).prepare(RunMonitor())
        assert calls.seen
        seen.add(frozenset(calls.seen))
        assert len(seen) == 1, form


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("name", one_in(3, COMPILED))
def test_to_prepare_changes_no_bit_of_a_run(name: str) -> None:
    def end(times: int) -> dict[str, Any]:
        scenario = scenario_of(COMPILED[name])
        model = assemble(scenario)
        stepper = stepper_of(model, scenario)
        stepper.start()
        stepper.advance(1.0, 1.0, STEPS)
        for _ in range(times):
            stepper.compile()
        stepper.advance(1.0, 1.0, STEPS)
        return {**stepper.arrays(), "work": np.array(stepper.statistics)}

    prepared, plain = end(2), end(0)
    for part, values in plain.items():
        np.testing.assert_array_equal(prepared[part], values, err_msg=part)


def test_the_table_has_the_seconds_of_compilation_where_there_was_one() -> None:
    done = simulate(pulley())
    statistics = done.statistics._replace(wall_seconds=2.1)
    assert "solved in 2.1 s: " in Result(done._replace(statistics=statistics)).summary()
    compiled = statistics._replace(compile_seconds=24.0)
    text = Result(done._replace(statistics=compiled)).summary()
    assert "solved in 2.1 s after 24 s of compilation: " in text


@pytest.mark.parametrize(
    ("number", "option"),
    [(signal.SIGINT, "-o"), pytest.param(signal.SIGTERM, "--json -o", marks=pytest.mark.slow)],
)
def test_a_signal_ends_a_compilation_at_once(
    number: signal.Signals, option: str, tmp_path: Path
) -> None:
    """By its default action: the compiler is in one call for seconds, in which no handler runs."""
    (tmp_path / "a.h5").write_bytes(OLD)
    cache = tmp_path / "cache"
    scenario = SCENARIOS / "belt_verification.toml"
    command = [sys.executable, "-m", "frictionsim", "solve", str(scenario), *shlex.split(option)]
    process = subprocess.Popen(
        [*command, "a.h5"],
        cwd=tmp_path,
        env={**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(ANNOUNCED)
        time.sleep(1.0)  # of the ten seconds and more that the kernels take
        process.send_signal(number)
        out, said = process.communicate()
    assert (process.returncode, out, said) == (-number, "", "")
    assert (tmp_path / "a.h5").read_bytes() == OLD
    assert sorted(os.listdir(tmp_path)) == ["a.h5", "cache"]
    # Had it been waited for, the kernels would be on the disk.
    assert not list(cache.rglob("*advance*"))
