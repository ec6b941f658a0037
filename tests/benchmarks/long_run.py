"""Measure memory, time and disk of a long run of a belt whose samples go to the disk.

    python tests/benchmarks/long_run.py [SECONDS [BODIES [INTERVAL]]]

solves scenarios/belt_drive.toml with all channels each INTERVAL (1e-3 s) for so many simulated
seconds (1000, 150 bodies), in a process of its own, into a new folder below the current one, and
prints one row for the table of docs/performance.md. The compilation of the kernels is not counted:
a short run compiles them before.
"""

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

SCENARIO = Path(__file__).parents[2] / "scenarios" / "belt_drive.toml"
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
HEADINGS = "simulated s", "bodies", "samples", "samples / GB", "peak memory / MB", "solving / s"
HEADINGS += "in all / s", "result / GB"


def solve(seconds: float, bodies: int, interval: float, output: Path) -> str:
    """Return the row of a run in a process of its own."""
    numbers = f"{seconds:g}", str(bodies), f"{interval:g}"
    arguments = [sys.executable, "-c", RUN, str(SCENARIO), *numbers, str(output)]
    return subprocess.run(arguments, check=True, capture_output=True, text=True).stdout.strip()


def bytes_in(folder: Path) -> int:
    """Return the bytes of all files in a folder, some of which may vanish meanwhile."""
    total = 0
    for path in folder.rglob("*"):
        try:
            total += path.stat().st_size
        except OSError:
            continue
    return total


def main() -> None:
    """Print the table and the largest use of the disk."""
    given = map(float, sys.argv[1:])
    seconds, bodies, interval = (*given, *(1000.0, 150.0, 1e-3)[len(sys.argv) - 1 :])
    with tempfile.TemporaryDirectory(dir=".") as name:
        folder, most, over = Path(name), [0], threading.Event()
        solve(0.01, int(bodies), 1e-3, folder / "compiled.h5")

        def watch() -> None:
            while not over.wait(1.0):
                most[0] = max(most[0], bytes_in(folder))

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            row = solve(seconds, int(bodies), interval, folder / "long.h5")
        finally:
            over.set()
            watcher.join()
        print("|" + "|".join(f" {heading} " for heading in HEADINGS) + "|")
        print("|" + "---|" * len(HEADINGS))
        print(row)
        started = time.perf_counter()
        command = [sys.executable, "-m", "frictionsim", "show", str(folder / "long.h5")]
        subprocess.run(command, check=True, capture_output=True)
        seconds = time.perf_counter() - started
        print(f"most on the disk: {most[0] / 1e9:.2f} GB; show: {seconds:.1f} s")


if __name__ == "__main__":
    main()
