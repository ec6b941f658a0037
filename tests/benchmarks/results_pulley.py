"""Fig. 10 of the pulley's paper to its end: force, angle, velocity and acceleration over 10 s."""

from typing import Any, NamedTuple

from matplotlib.figure import Figure

from frictionsim.display import BLACK, BLUE, ORANGE, PURPLE, VERMILION
from frictionsim.plots.style import add_legend, grid, line_style
from frictionsim.results import Record
from tests.benchmarks.results_common import WIDTH, quantity_of, save_picture, say, solve
from tests.support.problems import RAMP

DURATION = 10.0  # s
ALPHA = "\N{GREEK SMALL LETTER ALPHA}"
ENLARGED = 100.0  # what the paper multiplies angle, velocity and acceleration by
LEAST, MOST = -800.0, 21_000.0  # of the diagram's only axis, with room at both ends
EARLY, LOW = 3.0, 3300.0  # s, and the axis of the enlarged part
INSET = (0.10, 0.47, 0.40, 0.48)  # of the diagram, where no curve is
FIRST = "drive_force"
CURVES = {  # in colours that the paper names: blue, yellow, red, purple
    FIRST: (1.0, "force P, N", BLUE),
    "angle": (ENLARGED, "100 times θ, rad", ORANGE),
    "angular_velocity": (ENLARGED, "100 times ω, rad/s", VERMILION),
    "angular_acceleration": (ENLARGED, f"100 times {ALPHA}, rad/s²", PURPLE),
}
COLUMNS = tuple(name for name in CURVES if name != FIRST)


class Row(NamedTuple):
    """What the table says of one time."""

    time: float
    found: tuple[float, ...]
    exact: tuple[float, ...]


def pulley() -> None:
    """Solve the paper's ramp to 10 s, draw it as the paper does, and print the table."""
    done = to_the_end()
    save_picture(_figure(done), "pulley_fig10")
    say(table(done))


def to_the_end() -> Record:
    """Return the run of the shipped scenario over the paper's 10 s."""
    return solve("pulley", f"solver.duration={DURATION}")


def rows(done: Record) -> list[Row]:
    """Return what was found where the closed form is known to more digits than a run can have."""
    found = []
    for time, *exact in RAMP:
        at = abs(done.time - time).argmin()
        values = tuple(float(done.channels[name][at]) for name in COLUMNS)
        found.append(Row(time, values, tuple(exact)))
    return found


def table(done: Record) -> str:
    """Return the table of `results/README.md`."""
    head = f"| time, s | θ, rad | ω, rad/s | {ALPHA}, rad/s² | largest difference |"
    lines = [head, "|---" * 5 + "|"]
    start = quantity_of(done, "breakaway_time")
    lines.append(f"| {start:.9f} | 0 | 0 | 0 before, 8.931678707 after | breakaway |")
    for time, found, exact in rows(done):
        worst = max(abs(a - b) for a, b in zip(found, exact, strict=True))
        cells = " | ".join(f"{value:.9f}" for value in exact)
        lines.append(f"| {time:g} | {cells} | {worst:.0e} |")
    return "\n".join(lines)


def _figure(done: Record) -> Figure:
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    figure.suptitle(
        "Fig. 10 of the pulley's paper to its end, scenarios/pulley.toml over 10 s",
        fontsize="medium",
    )
    whole = figure.add_subplot()
    handles = _draw(whole, done)
    whole.set_xlim(0.0, DURATION)
    whole.set_ylim(LEAST, MOST)
    whole.set_xlabel("time, s")
    whole.set_ylabel(f"P in N; θ, ω and {ALPHA} times 100")
    last = float(done.channels["angular_velocity"][-1])
    whole.annotate(
        f"ω = {last:.3f} rad/s",
        (DURATION, ENLARGED * last),
        (-6.0, -4.0),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize="small",
    )
    early = whole.inset_axes(INSET)
    _draw(early, done)
    early.set_xlim(0.0, EARLY)
    early.set_ylim(-100.0, LOW)
    early.tick_params(labelsize="small")
    early.set_title("the first 3 s", fontsize="small")
    add_legend(figure, handles, columns=3)
    return figure


def _draw(axes: Any, done: Record) -> list[Any]:
    handles = []
    for number, (name, (factor, words, colour)) in enumerate(CURVES.items()):
        style = line_style(number) | {"color": colour}
        handles += axes.plot(done.time, factor * done.channels[name], **style, label=words)
    dots: dict[str, Any] = {"color": BLACK, "marker": "o", "markersize": 3.5, "linestyle": "none"}
    for time, *exact in RAMP:
        values = [ENLARGED * value for value in exact]
        handle = axes.plot([time] * len(values), values, **dots, label="closed form", zorder=3)
    handles += handle
    start = quantity_of(done, "breakaway_time")
    style = {"color": BLACK, "linewidth": 0.8, "linestyle": (0, (1, 1))}
    label = f"breakaway, {start:.4f} s"
    handles.append(axes.axvline(start, **style, label=label))
    grid(axes)
    return handles
