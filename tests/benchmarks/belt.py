"""What the belt drive costs: real-time factors, effects, numbers of bodies, start, memory.

Run it as `python -m tests.benchmarks.belt` on an idle machine; it prints tables of medians.
Real-time factor is wall seconds per simulated second. Counts do not depend on the machine.
"""

import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

from frictionsim.simulation.simulate import RunResult
from tests.benchmarks.results_common import SCENARIOS, solve

REPEATS = 5
QUIET = ("output.interval=0.01", 'output.channels=["pulley_speed"]')


def simulate(*overrides: str, without: tuple[str, ...] = ()) -> RunResult:
    """Run `belt_drive.toml` with keys set and effects left out."""
    return solve("belt_drive", *overrides, without=without)


def seconds(*overrides: str, without: tuple[str, ...] = (), repeats: int = REPEATS) -> float:
    """Return the median wall time of the steps of a run, after one to warm up."""
    simulate(*overrides, "solver.duration=1e-3", without=without)
    runs = (simulate(*overrides, without=without) for _ in range(repeats))
    return median(run.statistics.wall_seconds for run in runs)


def real_time() -> None:
    """Print the real-time factors of the belt drive, without and with output each 1 ms."""
    print("belt_drive, 0.5 s: backend, setting, steps a second, real-time factor, with 1 ms output")
    for backend, setting in (
        ("rkf45", "solver.rtol=1e-4"),
        ("rkf45", "solver.rtol=2e-6"),
        ("rkf45", "solver.rtol=1e-7"),
        ("moreau", "solver.rtol=2e-6"),
        ("moreau", "solver.step=2.5e-6"),
    ):
        common = (f"solver.backend={backend}", setting, "solver.duration=0.5")
        steps = simulate(*common, *QUIET).statistics.steps
        factor = seconds(*common, *QUIET) / 0.5
        with_output = seconds(*common) / 0.5
        print(f"  {backend} {setting} {steps * 2} {factor:.3f} {with_output:.3f}", flush=True)


def effects() -> None:
    """Print states and time per step with each effect left out, and with each added."""
    print("effects, moreau, 0.1 s: states, us a step")
    common = ("solver.backend=moreau", "solver.duration=0.1", "solver.step=2.5e-6", *QUIET)
    variants: list[tuple[str, tuple[str, ...], tuple[str, ...]]] = [
        ("as shipped", (), ()),
        ("without bending", (), ("bending",)),
        ("without axial_damping", (), ("axial_damping",)),
        ("without contact damping", ("effects.contact.damping=0.0",), ()),
        ("without belt_friction", (), ("belt_friction",)),
        (
            "springs and contact only",
            ("effects.contact.damping=0.0",),
            ("bending", "axial_damping", "belt_friction"),
        ),
        ("with gravity", ("effects.gravity.g=9.81",), ()),
        ("with a patch", ("effects.patch={from = 0.3, to = 0.6, mu_s = 0.3, mu_k = 0.25}",), ()),
        ("with mu_s above mu_k", ("effects.belt_friction.mu_s=1.05",), ()),
        (
            "with prescribed driver",
            ("drive.driver={speed = {time = [0.0, 0.3], value = [0.0, -25.0]}}",),
            (),
        ),
        ("stiff axial damping", ("effects.axial_damping.basis=section",), ()),
    ]
    for name, overrides, without in variants:
        statistics = simulate(*common, *overrides, without=without).statistics
        took = seconds(*common, *overrides, without=without)
        print(f"  {name}: {statistics.states}, {1e6 * took / statistics.steps:.2f}", flush=True)


def mesh() -> None:
    """Print the time per step over the number of bodies."""
    print("bodies: us a step of rkf45, of moreau; and per body in ns")
    for bodies in (60, 150, 300, 600, 1200):
        found = []
        for backend in ("rkf45", "moreau"):
            common = (
                f"mechanism.belt.bodies={bodies}",
                f"solver.backend={backend}",
                f"solver.duration={1.5 / bodies:g}",
                *QUIET,
            )
            steps = simulate(*common).statistics.steps
            found.append(1e6 * seconds(*common) / steps)
        per_body = [1e3 * time / bodies for time in found]
        print(
            f"  {bodies}: {found[0]:.2f} {found[1]:.2f}; {per_body[0]:.1f} {per_body[1]:.1f}",
            flush=True,
        )


def start() -> None:
    """Print what a process takes beside its steps, cold and warm, and its memory."""
    for backend in ("rkf45", "moreau"):
        cache = Path(tempfile.mkdtemp())
        for state in ("cold", "warm"):
            wall, stepping = _process(cache, backend, "0.02")
            print(f"process, {backend}, {state}: {wall - stepping:.2f} s beside its steps")
        shutil.rmtree(cache)
    _process(None, "moreau", "2.0")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"largest memory of these, 2 s with output each 1 ms among them: {peak:.0f} MB")


def _process(cache: Path | None, backend: str, duration: str) -> tuple[float, float]:
    """Return the wall time of a solve as a process, and of it that of warm steps, s."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            *(sys.executable, "-m", "frictionsim", "solve", str(SCENARIOS / "belt_drive.toml")),
            *("--backend", backend, "--set", f"solver.duration={duration}", "--quiet"),
            *("-o", f"{folder}/belt.h5"),
        ]
        environment = {"PATH": "", "HOME": str(cache or Path.home())}
        started = perf_counter()
        subprocess.run(command, check=True, env=environment)
        wall = perf_counter() - started
    stepping = seconds(f"solver.backend={backend}", f"solver.duration={duration}", repeats=1)
    return wall, stepping


if __name__ == "__main__":
    real_time()
    effects()
    mesh()
    start()
