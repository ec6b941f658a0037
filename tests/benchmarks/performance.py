"""Times of the program: the numbers of `docs/performance.md`.

Run it as `python -m tests.benchmarks.performance PART [NUMBER...]...` with the names of parts, and
numbers that go to the part before them: `performance start_up 3` takes turns three times only, and
`performance long_run 1000 150 1e-3` is 1000 s of 150 bodies with samples each 1e-3 s. What is
compared takes turns, so that a machine whose speed drifts treats all alike; ratios are what to
quote.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
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

PULLEY, BELT = str(SCENARIOS / "pulley.toml"), str(SCENARIOS / "belt_drive.toml")
PROGRAM = (sys.executable, "-m", "frictionsim")
LOAD = "mechanism.load"


def by_turns(calls: dict[str, Callable[[], Any]], turns: int) -> dict[str, list[float]]:
    """Return the times of calls, s; the first turn, which imports and warms up, does not count."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(turns + 1):
        for name, call in calls.items():
            started = time.perf_counter()
            call()
            if turn:
                times[name].append(time.perf_counter() - started)
    return times


def tabulate(times: dict[str, list[float]]) -> None:
    """Print medians, the least times, and the ratios of the medians to the first."""
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


def start_up(turns: float = 31) -> None:
    """How long a command takes as a process, against importing numpy and h5py alone."""
    # As many samples as those of the pulley, 301.
    marble = (str(SCENARIOS / "marble_machine.toml"), "--set", "output.interval=0.01")
    epicyclic = (str(SCENARIOS / "epicyclic.toml"), "--set", f"output.interval={2.5 / 300}")
    into = (*PROGRAM, "solve", "-o", "result.h5")
    commands = {
        "import numpy, h5py": (sys.executable, "-c", "import numpy, h5py"),
        "import all libraries of solve": (sys.executable, "-c", LIBRARIES),
        "frictionsim solve pulley.toml": (*into, PULLEY),
        "frictionsim solve marble_machine": (*into, *marble),
        "frictionsim solve epicyclic.toml": (*into, *epicyclic),
        "frictionsim static pulley.toml": (*PROGRAM, "static", PULLEY),
        "frictionsim check pulley.toml": (*PROGRAM, "check", PULLEY),
        "frictionsim --help": (*PROGRAM, "--help"),
    }
    with tempfile.TemporaryDirectory() as folder:

        def run(command: tuple[str, ...]) -> None:
            subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)

        calls = {name: lambda line=line: run(line) for name, line in commands.items()}
        tabulate(by_turns(calls, int(turns)))


def api(turns: float = 101) -> None:
    """How long functions take in a Python that runs already, as in a notebook or a loop."""
    pulley = fs.load(PULLEY)
    samples = pulley.replace({"output.interval": 0.01, "output.at_events": False})
    without = samples.replace({"output.interval": pulley.solver.duration})
    file = Path(tempfile.mkdtemp()) / "pulley.h5"
    saved = fs.solve(samples)
    calls: dict[str, Callable[[], Any]] = {
        "solve, 301 samples": lambda: fs.solve(samples),
        "solve, 301 samples, and dataset": lambda: fs.solve(samples).dataset,
        "solve without samples": lambda: fs.solve(without),
        "solve from the path, 301 samples": lambda: fs.solve(PULLEY),
        "load": lambda: fs.load(PULLEY),
        "replace": lambda: pulley.replace({"solver.rtol": 1e-8}),
        "dataset": lambda: fs.Result(saved.record).dataset,
        "save": lambda: saved.save(file),
        "open": lambda: fs.open(file),
        "static": lambda: fs.static(pulley),
    }
    tabulate(by_turns(calls, int(turns)))


QUIET = ("output.interval=0.01", 'output.channels=["pulley_speed"]')
METHODS = (
    *(("rkf45", f"solver.rtol={rtol}") for rtol in ("1e-4", "2e-6", "1e-7")),
    *(("moreau", "solver.rtol=2e-6"), ("moreau", "solver.step=2.5e-6")),
)
EFFECTS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {  # keys set, effects left out
    "as shipped": ((), ()),
    "springs and contact only": (
        ("effects.contact.damping=0.0",),
        ("bending", "axial_damping", "belt_friction"),
    ),
    "with gravity": (("effects.gravity.g=9.81",), ()),
    "stiff axial damping": (("effects.axial_damping.basis=section",), ()),
}


def stepped(repeats: float, *overrides: str, without: tuple[str, ...] = ()) -> tuple[Record, float]:
    """Return a run of `belt_drive.toml`, and the median time of its steps after one to warm up."""
    solve("belt_drive", *overrides, "solver.duration=1e-3", without=without)
    runs = [solve("belt_drive", *overrides, without=without) for _ in range(int(repeats))]
    return runs[0], median(run.statistics.wall_seconds for run in runs)


def belt(repeats: float = 5, duration: float = 0.5) -> None:
    """Cost of a belt: real-time factors, effects, numbers of bodies; run it on an idle machine.

    A real-time factor is wall seconds per simulated second. Counts do not depend on the machine.
    """
    say("method, setting, steps a second, real-time factor, with output each 1 ms")
    for backend, setting in METHODS:
        common = (f"solver.backend={backend}", setting, f"solver.duration={duration}")
        run, quiet = stepped(repeats, *common, *QUIET)
        factors = [took / duration for took in (quiet, stepped(repeats, *common)[1])]
        rate = run.statistics.steps / duration
        say(f"  {backend} {setting} {rate:.0f} {factors[0]:.3f} {factors[1]:.3f}")
    say("effects, moreau: states, us a step")
    fixed = ("solver.backend=moreau", "solver.step=2.5e-6", f"solver.duration={0.2 * duration}")
    for name, (overrides, without) in EFFECTS.items():
        run, took = stepped(repeats, *fixed, *QUIET, *overrides, without=without)
        say(f"  {name}: {run.statistics.states}, {1e6 * took / run.statistics.steps:.2f}")
    say("bodies: us a step of rkf45, of moreau")
    for bodies in (60, 150, 300, 600, 1200):
        short = (f"mechanism.belt.bodies={bodies}", f"solver.duration={3 * duration / bodies:g}")
        microseconds = [
            1e6 * took / run.statistics.steps
            for run, took in (
                stepped(repeats, f"solver.backend={backend}", *short, *QUIET)
                for backend in ("rkf45", "moreau")
            )
        ]
        say(f"  {bodies}: {microseconds[0]:.2f} {microseconds[1]:.2f}")


RUN = """
import sys, time
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
import frictionsim as fs

scenario, seconds, bodies, interval, output = sys.argv[1:]
settings = {"mechanism.belt.bodies": int(bodies), "output.interval": float(interval)}
started = time.perf_counter()
result = fs.solve(scenario, {**settings, "solver.duration": float(seconds)}, output=output)
wall = time.perf_counter() - started
peak = getrusage(RUSAGE_SELF).ru_maxrss / 1e3
samples = result.record.channels
raw = sum(values.nbytes for values in samples.values()) / 1e9
print(f"| {seconds} | {bodies} | {len(samples['time'])} | {raw:.2f} | {peak:.0f} "
      f"| {result.statistics.wall_seconds:.0f} | {wall:.0f} "
      f"| {Path(output).stat().st_size / 1e9:.2f} |")
"""


def long_run(seconds: float = 1000.0, bodies: float = 150, interval: float = 1e-3) -> None:
    """Memory, time and disk of a belt with all its channels, in a separate process."""

    def row(duration: float, name: str) -> str:
        numbers = f"{duration:g}", str(int(bodies)), f"{interval:g}"
        line = [sys.executable, "-c", RUN, BELT, *numbers, str(folder / name)]
        return subprocess.run(line, check=True, capture_output=True, text=True).stdout.strip()

    def watch() -> None:
        while not over.wait(1.0):
            most[0] = max(most[0], sum(map(_size, folder.rglob("*"))))

    with tempfile.TemporaryDirectory(dir=".") as temporary:
        folder, most, over = Path(temporary), [0], threading.Event()
        row(0.01, "compiled.h5")  # of which the compilation is not counted
        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            measured = row(seconds, "long.h5")
        finally:
            over.set()
            watcher.join()
        say("| simulated s | bodies | samples | samples / GB | peak memory / MB | solving / s |")
        say(f"  in all / s | result / GB |\n{measured}")
        shown = by_turns({"show": lambda: _run(*PROGRAM, "show", str(folder / "long.h5"))}, 1)
        say(f"most on the disk: {most[0] / 1e9:.2f} GB; show: {shown['show'][0]:.1f} s")


CYCLES = "hard/many_cycles"  # as it is; of the others STEPS steps
COORDINATES = ("pulley", "marble_machine", "epicyclic", "shaft", "hoist_drum", "swing_door", "lift")
STEPS = 10_000


def additions() -> float:
    """Return the processor time of ten million additions, the unit of the speed of a machine, s."""
    started, x = time.process_time(), 0
    for i in range(10_000_000):
        x += i
    return time.process_time() - started


def coordinates(turns: float = 5) -> None:
    """Processor time of steps and runs of one and several coordinates, and of a long run.

    Then that of a fit with 200 resamples, as wall time.
    """
    say(f"ten million additions: {additions():.2f} s")
    for name in COORDINATES:
        scenario = fs.load(str(SCENARIOS / f"{name}.toml"))
        duration = scenario.solver.duration
        short = {"solver.max_step": duration / STEPS, "output.interval": duration}
        seconds, run = _least(partial(fs.solve, scenario.replace(short)), int(turns))
        say(f"{name}: {1e6 * seconds / run.statistics.steps:.0f} us a step")
    pulley = fs.load(PULLEY).replace({"output.interval": 3.0})
    vary = {LOAD: "lin(2000.0, 2400.0, 400)"}
    seconds, _ = _least(lambda: fs.sweep(pulley, vary, workers=1), int(turns))
    say(f"400 pulleys: {400 / seconds:.0f} runs a second and core")
    seconds, _ = _least(lambda: fs.solve(str(SCENARIOS / f"{CYCLES}.toml")), 1)
    say(f"{CYCLES}: {seconds:.1f} s")
    say(f"ten million additions: {additions():.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        tabulate(by_turns({"fit of 200 resamples": _fit(Path(folder))}, int(turns)))


def _least(call: Callable[[], Any], turns: int) -> tuple[float, Any]:
    """Return the least processor time of some calls, s, and what the last one returned."""
    times = []
    for _ in range(turns):
        started = time.process_time()
        returned = call()
        times.append(time.process_time() - started)
    return min(times), returned


def _fit(folder: Path) -> Callable[[], Any]:
    """Return a call of the fit in `docs/fitting.md`, with 200 resamples."""
    friction = ("effects.shaft_friction.mu_s", "effects.shaft_friction.mu_k")
    truth = dict(zip(friction, (0.23, 0.12), strict=True))
    made = fs.solve(PULLEY, {**truth, "output.interval": 0.05}).dataset
    noise = np.random.default_rng(1).normal(size=made.time.size)
    columns = np.c_[made.time, made.angular_velocity + 0.2 * noise]
    data = folder / "log.csv"
    np.savetxt(data, columns, delimiter=",", header="t,w", comments="")
    free = ("--free", f"{friction[0]}=0.05:0.4", "--free", f"{friction[1]}=0.02:0.3")
    of = ("--data", str(data), "--channel", "angular_velocity=w", *free, "--bootstrap", "200")
    return lambda: _run(*PROGRAM, "fit", PULLEY, *of)


def _size(path: Path) -> int:
    """Return the bytes of a file, which may vanish meanwhile."""
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def seconds_of(runs: int, **options: Any) -> float:
    """Return the time of a sweep of pulleys, with its check and the start of its workers."""
    vary = {LOAD: f"lin(2000.0, 2400.0, {runs})"}
    started = time.perf_counter()
    assert fs.sweep(PULLEY, vary, **options)["status"].values.all()
    return time.perf_counter() - started


def sweep(turns: float = 3, runs: float = 2000) -> None:
    """Runs per second of a pulley, with one worker and two, and of a loop of `solve` processes."""
    times = [[seconds_of(int(runs), workers=n) for n in (1, 2)] for _ in range(int(turns))]
    rates = runs / np.median(times, axis=0)
    say(
        f"rtol 1e-9: one process {rates[0]:.0f} runs/s, two {rates[1]:.0f} runs/s,"
        f" {np.median([a / b for a, b in times]):.2f} times"
    )
    with tempfile.TemporaryDirectory() as folder:
        command = (*PROGRAM, "solve", PULLEY, "-q", "--set", "solver.rtol=1e-6", "-o")
        loop = by_turns({"solve": lambda: _run(*command, f"{folder}/a.h5")}, 20)["solve"]
    say(f"a loop of solve: {1.0 / float(np.mean(loop)):.2f} runs/s")


MEMORY = """\
import json, resource, sys, time
import numpy as np
import frictionsim as fs
from pathlib import Path
from frictionsim.io.sweep_file import write_sweep
from frictionsim.io.sweep_table import RunBlock
from frictionsim.sweeps.design import design_of
from frictionsim.sweeps.outcomes import completed, header_of
from frictionsim.sweeps.study_file import SweepOptions, SweepStudy, study_toml
from frictionsim.sweeps.values import values_of
runs, path = int(sys.argv[1]), Path(sys.argv[2])
keys = {"mechanism.load": values_of("normal(2200.0, 50.0)"),
        "mechanism.inertia": values_of("uniform(1.0, 2.0)")}
options = SweepOptions.of(vary=keys, sample=runs, method="random", seed=1)
study = SweepStudy(fs.load(sys.argv[3]), options, Path())
design = design_of(keys, sampling=options.sampling)
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
before, started = peak(), time.process_time()
blocks, size, rng = [], 1000, np.random.default_rng(1)
units = {f"quantity_{n}": "1" for n in range(15)}
for first in range(0, runs, size):
    texts = {"failure": {first: "diverged"}, "reason": {first: "it left" * 10},
             "warnings": {first + 1: "a warning"}}
    blocks.append(RunBlock(first, np.ones(size, np.int8), units, rng.random((15, size)), texts))
added = peak()
write_sweep(completed(header_of(study.scenario, design, study_toml(study)), blocks), path)
print(json.dumps([before, added, peak(), time.process_time() - started]))
"""


def memory(runs: float = 1_000_000) -> None:
    """Peak memory of the process that receives the outcomes of many runs."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.h5"
        output = _run(sys.executable, "-c", MEMORY, str(int(runs)), str(path), PULLEY)
        before, added, peak, seconds = json.loads(output)
        say(
            f"{runs:.0f} runs: {before:.0f} MB at the start, {added:.0f} MB with all outcomes,"
            f" {peak:.0f} MB at most, {seconds:.1f} s, file {path.stat().st_size / 1e6:.0f} MB"
        )


def dask(runs: float = 10_000, turns: float = 3) -> None:
    """A study of many runs on two workers of Dask, and on two of the pool."""
    ways: list[dict[str, Any]] = [{"workers": 2}, {"dask": "local:2"}]
    pairs = [[seconds_of(int(runs), **way) for way in ways] for _ in range(int(turns))]
    say(f"pool and Dask, s: {pairs}")
    say(f"Dask takes {np.median([b / a for a, b in pairs]):.2f} times the time of the pool")


PARTS: dict[str, Callable[..., None]] = {
    part.__name__: part
    for part in (start_up, api, coordinates, belt, long_run, sweep, memory, dask)
}


def main(words: list[str]) -> None:
    """Measure the parts that are named, each with the numbers behind its name."""
    calls: list[tuple[str, list[float]]] = []
    for word in words:
        if word in PARTS:
            calls.append((word, []))
        else:
            calls[-1][1].append(float(word))
    for name, numbers in calls:
        say(name)
        PARTS[name](*numbers)


if __name__ == "__main__":
    os.nice(5)
    main(sys.argv[1:])
