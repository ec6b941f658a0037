"""How long a command takes as a process, against importing numpy and h5py alone.

Run it with `python tests/benchmarks/start_up.py`. Commands take turns, so that a machine whose
speed drifts treats them alike; the ratio of medians is what to quote.
"""

import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

ROOT = Path(__file__).parents[2]
RUNS = 31

LIBRARIES = """
import gc, os
gc.disable()
import numpy, h5py, typer, pydantic, rich.console, rich.table, tomllib, tomli_w
class Model(pydantic.BaseModel):
    x: float
os._exit(0)
"""


def seconds(command: list[str], folder: str) -> float:
    """Run a command to its end and return how long it took, s."""
    started = perf_counter()
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return perf_counter() - started


def main() -> None:
    """Print a table of medians and ratios."""
    scenario = str(ROOT / "scenarios" / "pulley.toml")
    frictionsim = [sys.executable, "-m", "frictionsim"]
    solve = [*frictionsim, "solve", "-o", "result.h5"]
    # As many samples as those of the pulley, 301.
    marble = [str(ROOT / "scenarios" / "marble_machine.toml"), "--set", "output.interval=0.01"]
    epicyclic = [
        str(ROOT / "scenarios" / "epicyclic.toml"),
        "--set",
        f"output.interval={2.5 / 300}",
    ]
    commands = {
        "import numpy, h5py": [sys.executable, "-c", "import numpy, h5py"],
        "import all libraries of solve": [sys.executable, "-c", LIBRARIES],
        "frictionsim solve pulley.toml": [*solve, scenario],
        "frictionsim solve marble_machine": [*solve, *marble],
        "frictionsim solve epicyclic.toml": [*solve, *epicyclic],
        "frictionsim static pulley.toml": [*frictionsim, "static", scenario],
        "frictionsim check pulley.toml": [*frictionsim, "check", scenario],
        "frictionsim --help": [*frictionsim, "--help"],
    }
    times: dict[str, list[float]] = {name: [] for name in commands}
    with tempfile.TemporaryDirectory() as folder:
        for run in range(RUNS + 1):
            for name, command in commands.items():
                elapsed = seconds(command, folder)
                if run:  # the first one warms the disk cache
                    times[name].append(elapsed)
    base = median(times["import numpy, h5py"])
    print(f"{'command':32s} {'median ms':>9s} {'least ms':>9s} {'ratio':>6s}")
    for name, measured in times.items():
        middle = median(measured)
        print(f"{name:32s} {middle * 1e3:9.1f} {min(measured) * 1e3:9.1f} {middle / base:6.2f}")


if __name__ == "__main__":
    main()
