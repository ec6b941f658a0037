"""Makes all tables and pictures of `results/` anew, but hard.json and those of `validation.py`.

Run it as `python -m tests.benchmarks.results`, or with the names of some of its parts behind;
it takes about half an hour, one process at a time.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from tests.benchmarks.results_common import RESULTS, command, provenance, say
from tests.benchmarks.results_creep import drawn_creep
from tests.benchmarks.results_drawn import drawn_belts
from tests.benchmarks.results_energy import energy
from tests.benchmarks.results_laws import laws
from tests.benchmarks.results_mesh import mesh
from tests.benchmarks.results_paper import paper
from tests.benchmarks.results_pulley import pulley
from tests.benchmarks.results_seat import seat
from tests.benchmarks.results_wrap import wrap

PICTURES = ("pulley_return", "marble_machine", "epicyclic")
FEW = ("--max-wall", "10", "--repeats", "2")
OVER_TIME = (*FEW, "--bodies", "none", "--set", "output.interval=1e-3")
# By the name of the files: scenario and options.
COSTS: dict[str, tuple[str, ...]] = {
    "pulley": ("pulley",),
    "pulley_return": ("pulley_return",),
    "marble_machine": ("marble_machine",),
    "epicyclic": ("epicyclic",),
    "belt_verification": ("belt_verification", *OVER_TIME, "--set", "solver.duration=0.6"),
    "belt_drive_time": ("belt_drive", *OVER_TIME, "--set", "solver.duration=0.3"),
    "belt_drive": (
        *("belt_drive", "--backends", "moreau,rkf45", "--laws", "set-valued"),
        *("--max-wall", "200", "--repeats", "1"),
    ),
}


OF_THE_LIFT = (
    *("drive_torque", "rope_tension_car", "friction_torque"),
    *("angular_velocity", "car_velocity", "cord_slip"),
)


def pictures() -> None:
    """Draw what the project's README shows."""
    for name in PICTURES:
        command("solve", f"scenarios/{name}.toml", "--quiet")
        command("plot", f"results/{name}.h5")
    target = "results/pulley_return_published.h5"
    scenario = "scenarios/pulley_return.toml"
    law = ["--set", "effects.shaft_friction.law=published", "--backend", "rkf45"]
    command("solve", scenario, *law, "-o", target, "--quiet")
    command("plot", target)
    command("solve", "scenarios/lift.toml", "--quiet")
    command("plot", "results/lift.h5", "--channels", ",".join(OF_THE_LIFT))


def cost() -> None:
    """Write what accuracy costs in each of the scenarios: lines, CSV and diagram."""
    for name, (scenario, *options) in COSTS.items():
        arguments = ("cost", f"scenarios/{scenario}.toml", *options)
        path = f"results/{name}_cost"
        # With its head of machine and versions it is no table that `cost` would write over.
        (RESULTS / f"{name}_cost.csv").unlink(missing_ok=True)
        text = command(*arguments, "--csv", f"{path}.csv", "--plot", f"{path}.png")
        head = [*provenance(), f"command: frictionsim {' '.join(arguments)}", ""]
        (RESULTS / f"{name}_cost.txt").write_text("\n".join(head) + text, encoding="utf-8")
        _put_provenance(RESULTS / f"{name}_cost.csv")
        say(text)


def _put_provenance(path: Path) -> None:
    table = path.read_text(encoding="utf-8")
    head = "".join(f"# {line}\n" for line in provenance())
    path.write_text(head + table, encoding="utf-8")


PARTS: dict[str, Callable[[], None]] = {
    "pictures": pictures,
    "pulley": pulley,
    "cost": cost,
    "laws": laws,
    "mesh": mesh,
    "paper": paper,
    "wrap": wrap,
    "seat": seat,
    "energy": energy,
    "drawn": drawn_belts,
    "creep": drawn_creep,
}


def main(names: list[str]) -> None:
    """Make the parts that are named, or all."""
    start = perf_counter()
    for name in names or PARTS:
        say(f"{name}, after {perf_counter() - start:.0f} s")
        PARTS[name]()
    say(f"done after {perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
