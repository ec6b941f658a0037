"""How fine a belt without wrap factors has to be divided: spans, slip, speeds over its bodies."""

from math import isnan, pi
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from frictionsim.plots.style import add_legend, line_style
from frictionsim.simulation.simulate import RunResult
from tests.benchmarks.results_common import (
    WARM_UP_FRACTION,
    WIDTH,
    Table,
    save_picture,
    say,
    solve,
    spans,
    warning_on,
    write,
)

RECORDED = ("pulley_speed", "pulley_angle", "pulley_index", "sticking", "tension", "y")
CHANNELS = f"output.channels=[{', '.join(map(repr, RECORDED))}]"
HEADING = (
    *("scenario", "bending", "bodies", "tight span [N]", "slack span [N]", "slip [%]"),
    *(
        "where it sticks to the driver [N]",
        "slip over elastic creep",
        "driven speed [rad/s]",
        "scatter [rad/s]",
        "crossings [Hz]",
        "rms at crossings [rad/s]",
        "wall time [s]",
        "warning",
    ),
)
BODIES, DRIVEN, SCATTER, CROSSINGS, POLYGON, TIME = 2, 8, 9, 10, 11, 12
COMPARED = {3: "tension of the tight span", 4: "tension of the slack span"}
COMPARED |= {5: "slip", DRIVEN: "driven speed"}
INTERVAL = 1e-3  # s
LITTLE = 0.01  # scatter over speed
BAND = 0.1  # about the frequency of crossings, of it


class BeltDriveScenario(NamedTuple):
    """A scenario, its meshes, how long it runs, and which pulley's speed scatters."""

    base: str
    bodies: tuple[int, ...]
    duration: float
    free: int


DRIVE = BeltDriveScenario("belt_drive", (60, 90, 150, 300, 600, 1200), 3.0, 0)
VERIFICATION = BeltDriveScenario("belt_verification", (30, 60, 120, 240), 2.1, 1)
MARKERS = ("o", "s", "^", "D")
FAMILIES = ((DRIVE, True), (DRIVE, False), (VERIFICATION, True), (VERIFICATION, False))


def mesh(scale: float = 1.0) -> None:
    """Measure, write the table and draw; runs are `scale` times as long."""
    families = [
        [_measure(scenario, bends, count, scale) for count in scenario.bodies]
        for scenario, bends in FAMILIES
    ]
    rows = [row for family in families for row in family]
    above = [
        "Fixed steps (`moreau`, as long as they are stable); means over the second half of 3 s"
        " (`belt_drive`) and of 2.1 s (`belt_verification`). Slip from the angles turned; scatter"
        " is the standard deviation of the speed of the pulley whose speed is not given: of the"
        " driver and of the driven pulley. Bodies run on to a pulley at the frequency of crossings;"
        " what the polygon excites is the scatter within a tenth of that frequency.",
        "Where it sticks to its driver an ideal string has the tension of the tight span, and its"
        " slip is the elastic creep (T1 - T2)/EA.",
        "Beyond 25.13 rad/s the resistance of `belt_drive` stays 15 N m, what the drive gives, too:"
        " next to nothing determines the speed of a coarse mesh that is excited beyond it.",
        "60 bodies are about the fewest for `belt_drive`: below 45 its pulleys are too small for"
        " the turn from body to body, and the scenario is refused.",
    ]
    below = [_errors(family) for family in families] + [_polygon(family) for family in families]
    write(Table("What the number of bodies costs", above, HEADING, rows, below), "belt_mesh")
    save_picture(_draw(families), "belt_mesh")


def _measure(scenario: BeltDriveScenario, bends: bool, count: int, scale: float) -> tuple[Any, ...]:
    say(f"  {scenario.base}, {count} bodies, {'with' if bends else 'without'} bending")
    mesh_of = (f"mechanism.belt.bodies={count}", "mechanism.belt.wrap=polygon")
    settings = ("solver.backend=moreau", *mesh_of, CHANNELS)
    without = () if bends else ("bending",)
    solve(scenario.base, *settings, *WARM_UP_FRACTION, without=without)
    duration = f"solver.duration={scenario.duration * scale}"
    found = solve(
        scenario.base, *settings, duration, f"output.interval={INTERVAL}", without=without
    )
    if found.status != "done":
        blank = [float("nan")] * (len(HEADING) - 4)
        return (scenario.base, _word(bends), count, *blank, warning_on(found))
    late = found.time >= 0.5 * found.time[-1]
    speed = found.channels["pulley_speed"][late]
    turned = np.ptp(found.channels["pulley_angle"][late], axis=0)
    crossings = _crossings(found, count, float(np.mean(speed[:, 0])))
    tight, slack = spans(found.channels, late)
    slip = float(1.0 - turned[1] / turned[0])
    return (
        *(scenario.base, _word(bends), count, tight, slack, 100.0 * slip),
        _where_it_sticks(found, late),
        slip * found.scenario.mechanism.belt.axial_rigidity / (tight - slack),
        float(np.mean(speed[:, 1])),
        float(np.std(speed[:, scenario.free])),
        crossings,
        _rms_about(crossings, speed[:, scenario.free], INTERVAL),
        found.statistics.wall_seconds,
        warning_on(found),
    )


def _where_it_sticks(found: RunResult, late: Any) -> float:
    """Return the median tension of the joints on the driver whose body sticks there, N.

    Most of that arc has one tension; at its entry it rises, or falls, to it.
    """
    driver = found.channels["pulley_index"][late] == 0.0
    inside = driver & np.roll(driver, 1, axis=1) & (found.channels["sticking"][late] > 0.0)
    return float(np.median(found.channels["tension"][late][inside]))


def _rms_about(frequency: float, values: Any, interval: float) -> float:
    """Return the root mean square of what is within a band about a frequency.

    It is nan where samples are too far apart to show that band.
    """
    if (1.0 + BAND) * frequency > 0.5 / interval:
        return float("nan")
    window = np.hanning(len(values))
    power = np.abs(np.fft.rfft(window * (values - np.mean(values)))) ** 2
    near = np.abs(np.fft.rfftfreq(len(values), interval) - frequency) <= BAND * frequency
    return float(np.sqrt(2.0 * np.sum(power[near]) / (len(values) * np.sum(window**2))))


def _word(bends: bool) -> str:
    return "with" if bends else "without"


def _crossings(found: RunResult, count: int, speed: float) -> float:
    """Return how many bodies run on to a pulley in a second."""
    pulleys = found.scenario.mechanism.pulleys
    radius = pulleys[0].radius
    length = 2.0 * pi * radius + 2.0 * (pulleys[1].center[0] - pulleys[0].center[0])
    return abs(speed) * radius * count / length


def _errors(family: list[tuple[Any, ...]]) -> str:
    """Return in words what the coarser meshes are off by."""
    finest = family[-1]
    parts = []
    for row in family[:-1]:
        off = ", ".join(
            f"{name} {100.0 * abs(row[i] / finest[i] - 1.0):.2g} %" for i, name in COMPARED.items()
        )
        parts.append(f"{row[BODIES]} bodies: {off}")
    return f"{_name(finest)}, off the finest of its kind by - {'; '.join(parts)}."


def _polygon(family: list[tuple[Any, ...]]) -> str:
    """Return in words how the excitation by the polygon fades."""
    shares = [
        f"{_share(row, SCATTER)} and {_share(row, POLYGON)}"
        f" at {row[BODIES]} ({row[CROSSINGS]:.0f} Hz)"
        for row in family
        if not isnan(row[POLYGON])
    ]
    return (
        f"{_name(family[-1])}, scatter of the speed in all and about the crossings, over the driven"
        f" speed: {', '.join(shares)}; about the crossings {_end(family)}."
    )


def _share(row: tuple[Any, ...], column: int) -> str:
    return f"{100.0 * row[column] / abs(row[DRIVEN]):.2g} %"


def _end(family: list[tuple[Any, ...]]) -> str:
    """Return in words from which mesh on the polygon excites next to nothing."""
    over = [row[BODIES] for row in family if row[POLYGON] > LITTLE * abs(row[DRIVEN])]
    fine = [row[BODIES] for row in family if row[BODIES] > max(over, default=0)]
    share = f"{100.0 * LITTLE:g} %"
    return f"below {share} from {fine[0]} bodies on" if fine else f"above {share} to the last"


def _name(row: tuple[Any, ...]) -> str:
    return f"{row[0]} {row[1]} bending"


def _draw(families: list[list[tuple[Any, ...]]]) -> Figure:
    figure = Figure(figsize=(WIDTH, 9.5), layout="constrained")
    figure.suptitle("Belts of more and more bodies", fontsize="medium")
    panels = figure.subplots(4, 2, sharex=True)
    for panel, column in zip(panels.flat, (*COMPARED, SCATTER, POLYGON, TIME), strict=False):
        handles = [_draw_family(panel, rows, column, i) for i, rows in enumerate(families)]
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xticks(sorted({row[BODIES] for rows in families for row in rows}))
        panel.tick_params(axis="x", labelrotation=60, labelsize="small")
        panel.xaxis.set_major_formatter(ScalarFormatter())
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.grid(linewidth=0.3)
        name = COMPARED.get(column)
        panel.set_ylabel(f"{name},\noff the finest, %" if name else HEADING[column])
    panels[-1][1].remove()
    panels[-1][0].set_xlabel("bodies of the belt")
    add_legend(figure, handles, columns=2)
    return figure


def _draw_family(panel: Any, rows: list[tuple[Any, ...]], column: int, number: int) -> Any:
    bodies = [row[BODIES] for row in rows]
    values = np.array([row[column] for row in rows], dtype=float)
    if column in COMPARED:
        bodies, values = bodies[:-1], 100.0 * np.abs(values[:-1] / values[-1] - 1.0)
    style = line_style(number) | {"marker": MARKERS[number]}
    return panel.plot(bodies, values, **style, label=_name(rows[0]))[0]
