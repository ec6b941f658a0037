"""Times of the program: the numbers of `docs/performance.md`.

Run it as `python -m tests.benchmarks.performance PART [TURNS]...` with the names of parts. What is
compared takes turns, so that a machine whose speed drifts treats all alike; ratios are what to
quote.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import frictionsim as fs
from frictionsim.results import Record
from tests.benchmarks.results_common import SCENARIOS, say, solve

PULLEY = str(SCENARIOS / "pulley.toml")
PROGRAM = (sys.executable, "-m", "frictionsim")
LOAD = "mechanism.load"


def by_turns(calls: dict[str, Callable[[], Any]], turns: int) -> None:
    """Print medians and least times of calls, and the ratios of the medians to the first.

    The first turn, which imports and warms up, does not count.
    """
    times: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(turns + 1):
        for name, call in calls.items():
            started = time.perf_counter()
            call()
            if turn:
                times[name].append(time.perf_counter() - started)
    say(f"{'':34s} {'median ms':>9s} {'least ms':>9s} {'ratio':>6s}")
    base = median(next(iter(times.values())))
    for name, seconds in times.items():
        middle = median(seconds)
        say(f"{name:34s} {middle * 1e3:9.2f} {min(seconds) * 1e3:9.2f} {middle / base:6.2f}")


LIBRARIES = """
import gc, os
gc.disable()
import numpy, h5py, typer, pydantic, rich.console, rich.table, tomllib, tomli_w
class Model(pydantic.BaseModel):
    x: float
os._exit(0)
"""


def start_up(turns: int = 31) -> None:
    """How long a command takes as a process, against importing numpy and h5py alone."""
    commands = {
        "import numpy, h5py": (sys.executable, "-c", "import numpy, h5py"),
        "import all libraries of solve": (sys.executable, "-c", LIBRARIES),
        "frictionsim solve pulley.toml": (*PROGRAM, "solve", "-o", "result.h5", PULLEY),
        "frictionsim check pulley.toml": (*PROGRAM, "check", PULLEY),
        "frictionsim --help": (*PROGRAM, "--help"),
    }
    with tempfile.TemporaryDirectory() as folder:
        run = partial(subprocess.run, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        by_turns({name: partial(run, line) for name, line in commands.items()}, turns)


def api(turns: int = 101) -> None:
    """How long functions take in a Python that runs already, as in a notebook or a loop."""
    pulley = fs.load(PULLEY)
    samples = pulley.replace({"output.interval": 0.01, "output.at_events": False})
    without = samples.replace({"output.interval": pulley.solver.duration})
    saved = fs.solve(samples)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pulley.h5"
        calls: dict[str, Callable[[], Any]] = {
            "solve, 301 samples": lambda: fs.solve(samples),
            "solve without samples": lambda: fs.solve(without),
            "load": lambda: fs.load(PULLEY),
            "dataset": lambda: fs.Result(saved.record).dataset,
            "save": lambda: saved.save(file),
            "open": lambda: fs.open(file),
            "static": lambda: fs.static(pulley),
        }
        by_turns(calls, turns)


QUIET = ("output.interval=0.01", 'output.channels=["pulley_speed"]')


def stepped(turns: int, *overrides: str) -> tuple[Record, float]:
    """Return a run of `belt_drive.toml`, and the median time of its steps after one to warm up."""
    solve("belt_drive", *overrides, "solver.duration=1e-3")
    runs = [solve("belt_drive", *overrides) for _ in range(turns)]
    return runs[0], median(run.statistics.wall_seconds for run in runs)


def belt(turns: int = 5, duration: float = 0.5) -> None:
    """Cost of a belt: real-time factors, numbers of bodies; run it on an idle machine.

    A real-time factor is wall seconds per simulated second. Counts do not depend on the machine.
    """
    say("method, steps a second, real-time factor, with output each 1 ms")
    for backend in ("rkf45", "moreau"):
        common = (f"solver.backend={backend}", f"solver.duration={duration}")
        run, quiet = stepped(turns, *common, *QUIET)
        factors = [took / duration for took in (quiet, stepped(turns, *common)[1])]
        rate = run.statistics.steps / duration
        say(f"  {backend} {rate:.0f} {factors[0]:.3f} {factors[1]:.3f}")
    say("bodies: us a step of rkf45, of moreau")
    for bodies in (60, 150, 300, 600, 1200):
        short = (f"mechanism.belt.bodies={bodies}", f"solver.duration={3 * duration / bodies:g}")
        words = f"  {bodies}:"
        for backend in ("rkf45", "moreau"):
            run, took = stepped(turns, f"solver.backend={backend}", *short, *QUIET)
            words += f" {1e6 * took / run.statistics.steps:.2f}"
        say(words)


CYCLES = "hard/many_cycles"  # as it is; of the others STEPS steps
COORDINATES = ("pulley", "marble_machine", "epicyclic", "shaft", "hoist_drum", "swing_door", "lift")
STEPS = 10_000


def additions() -> None:
    """Say the processor time of ten million additions, the unit of the speed of a machine."""
    started, x = time.process_time(), 0
    for i in range(10_000_000):
        x += i
    say(f"ten million additions: {time.process_time() - started:.2f} s")


def coordinates(turns: int = 5) -> None:
    """Processor time of steps and runs of one and several coordinates, and of a long run.

    Then that of a fit with 200 resamples, as wall time.
    """
    additions()
    for name in COORDINATES:
        scenario = fs.load(str(SCENARIOS / f"{name}.toml"))
        duration = scenario.solver.duration
        short = {"solver.max_step": duration / STEPS, "output.interval": duration}
        seconds, run = _least(partial(fs.solve, scenario.replace(short)), turns)
        say(f"{name}: {1e6 * seconds / run.statistics.steps:.0f} us a step")
    pulley = fs.load(PULLEY).replace({"output.interval": 3.0})
    vary = {LOAD: "lin(2000.0, 2400.0, 400)"}
    seconds, _ = _least(lambda: fs.sweep(pulley, vary, workers=1), turns)
    say(f"400 pulleys: {400 / seconds:.0f} runs a second and core")
    seconds, _ = _least(lambda: fs.solve(str(SCENARIOS / f"{CYCLES}.toml")), 1)
    say(f"{CYCLES}: {seconds:.1f} s")
    additions()
    by_turns({"fit of 200 resamples": _fit()}, turns)


def _least(call: Callable[[], Any], turns: int) -> tuple[float, Any]:
    """Return the least processor time of some calls, s, and what the last one returned."""
    times = []
    for _ in range(turns):
        started = time.process_time()
        returned = call()
        times.append(time.process_time() - started)
    return min(times), returned


def _fit() -> Callable[[], Any]:
    """Return a call of the fit in `docs/fitting.md`, with 200 resamples."""
    friction = ("effects.shaft_friction.mu_s", "effects.shaft_friction.mu_k")
    truth = dict(zip(friction, (0.23, 0.12), strict=True))
    made = fs.solve(PULLEY, {**truth, "output.interval": 0.05}).dataset
    noise = np.random.default_rng(1).normal(size=made.time.size)
    data = {"time": made.time, "w": made.angular_velocity + 0.2 * noise}
    free = dict(zip(friction, ((0.05, 0.4), (0.02, 0.3)), strict=True))
    return partial(
        fs.fit, PULLEY, data=data, channels={"angular_velocity": "w"}, free=free, bootstrap=200
    )


PARTS: dict[str, Callable[..., None]] = {
    part.__name__: part for part in (start_up, api, coordinates, belt)
}


def main(words: list[str]) -> None:
    """Measure the parts that are named, as often as the numbers behind them say."""
    for name, after in zip(words, [*words[1:], ""], strict=True):
        if name in PARTS:
            say(name)
            PARTS[name](*([int(after)] if after.isdecimal() else []))


if __name__ == "__main__":
    os.nice(5)
    main(sys.argv[1:])
