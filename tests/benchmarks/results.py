"""Regenerates tables and pictures of `results/`, but those of `validation.py`.

Run it as `python -m tests.benchmarks.results`, or with the names of some of its parts behind;
it takes about half an hour, one process at a time.
"""

import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any

from matplotlib.figure import Figure

from frictionsim.display import BLACK, BLUE, ORANGE, PURPLE, VERMILION
from frictionsim.plots.style import add_legend, line_look, save
from frictionsim.results import Record
from tests.benchmarks.results_belts import paper, seat, wrap
from tests.benchmarks.results_common import RESULTS, command, provenance, quantity_of, say, solve
from tests.benchmarks.results_guided import creep
from tests.benchmarks.results_slip import slip
from tests.support.problems import RAMP

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
    """Draw the pictures of the project's README."""
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
        made = RESULTS / f"{name}_cost.csv"
        made.unlink(missing_ok=True)
        text = command(*arguments, "--csv", f"{path}.csv", "--plot", f"{path}.png")
        head = [*provenance(), f"command: frictionsim {' '.join(arguments)}", ""]
        (RESULTS / f"{name}_cost.txt").write_text("\n".join(head) + text, encoding="utf-8")
        with_head = [*(f"# {line}\n" for line in provenance()), made.read_text(encoding="utf-8")]
        made.write_text("".join(with_head), encoding="utf-8")
        say(text)


DURATION = 10.0  # s
ALPHA = "\N{GREEK SMALL LETTER ALPHA}"
ENLARGED = 100.0  # what the paper multiplies angle, velocity and acceleration by
CURVES = {  # in colours that the paper names: blue, yellow, red, purple
    "drive_force": (1.0, "force P, N", BLUE),
    "angle": (ENLARGED, "100 times θ, rad", ORANGE),
    "angular_velocity": (ENLARGED, "100 times ω, rad/s", VERMILION),
    "angular_acceleration": (ENLARGED, f"100 times {ALPHA}, rad/s²", PURPLE),
}


def pulley() -> None:
    """Draw fig. 10 of the pulley's paper to its end, over 10 s, with the closed form."""
    done = solve("pulley", f"solver.duration={DURATION}")
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    figure.suptitle(
        "Fig. 10 of the pulley's paper to its end, scenarios/pulley.toml over 10 s",
        fontsize="medium",
    )
    whole = figure.add_subplot()
    handles = _draw(whole, done)
    whole.set(xlim=(0.0, DURATION), ylim=(-800.0, 21_000.0), xlabel="time, s")
    whole.set_ylabel(f"P in N; θ, ω and {ALPHA} times 100")
    last, words = float(done.channels["angular_velocity"][-1]), {"fontsize": "small", "va": "top"}
    end = DURATION, ENLARGED * last
    whole.annotate(
        f"ω = {last:.3f} rad/s", end, (-6.0, -4.0), textcoords="offset points", ha="right", **words
    )
    early = whole.inset_axes((0.10, 0.47, 0.40, 0.48))  # where no curve is
    _draw(early, done)
    early.set(xlim=(0.0, 3.0), ylim=(-100.0, 3300.0))
    early.tick_params(labelsize="small")
    early.set_title("the first 3 s", fontsize="small")
    add_legend(figure, {str(one.get_label()): one for one in handles}, columns=3)
    save(figure, RESULTS / "pulley_fig10.png")


def _draw(axes: Any, done: Record) -> list[Any]:
    handles = []
    for number, (name, (factor, words, colour)) in enumerate(CURVES.items()):
        style = line_look(number) | {"color": colour}
        handles += axes.plot(done.time, factor * done.channels[name], **style, label=words)
    dots: dict[str, Any] = {"color": BLACK, "marker": "o", "markersize": 3.5, "linestyle": "none"}
    for time, *exact in RAMP:
        values = [ENLARGED * value for value in exact]
        handle = axes.plot([time] * len(values), values, **dots, label="closed form", zorder=3)
    start = quantity_of(done, "breakaway_time")
    style = {"color": BLACK, "linewidth": 0.8, "linestyle": (0, (1, 1))}
    label = f"breakaway, {start:.4f} s"
    axes.margins(x=0.0)
    axes.grid(linewidth=0.3)
    return [*handles, *handle, axes.axvline(start, **style, label=label)]


PARTS: dict[str, Callable[[], None]] = {
    "pictures": pictures,
    "pulley": pulley,
    "cost": cost,
    "paper": paper,
    "wrap": wrap,
    "seat": seat,
    "creep": creep,
    "slip": slip,
}


def main(names: list[str]) -> None:
    start = perf_counter()
    for name in names or PARTS:
        say(f"{name}, after {perf_counter() - start:.0f} s")
        PARTS[name]()
    say(f"done after {perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
