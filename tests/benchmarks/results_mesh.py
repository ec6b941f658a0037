"""How fine a belt without wrap factors has to be divided: spans, slip, speeds over its bodies."""

from math import pi
from typing import Any, NamedTuple

import numpy as np

from frictionsim.results import Record
from tests.benchmarks.results_common import (
    WARM_UP_FRACTION,
    Table,
    late,
    say,
    solve,
    spans,
    warning_on,
    where_it_sticks,
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
INTERVAL = 1e-3  # s
LATE = 0.5  # of a run, after which means are taken
BAND = 0.1  # about the frequency of crossings, of it


class BeltDriveScenario(NamedTuple):
    """A scenario, its meshes, how long it runs, and which pulley's speed scatters."""

    base: str
    bodies: tuple[int, ...]
    duration: float
    free: int


DRIVE = BeltDriveScenario("belt_drive", (60, 90, 150, 300, 600, 1200), 3.0, 0)
VERIFICATION = BeltDriveScenario("belt_verification", (30, 60, 120, 240), 2.1, 1)


def mesh(scale: float = 1.0) -> None:
    """Measure, and write the table; runs are `scale` times as long."""
    rows = [
        _measure(scenario, bends, count, scale)
        for scenario in (DRIVE, VERIFICATION)
        for bends in (True, False)
        for count in scenario.bodies
    ]
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
    write(Table("What the number of bodies costs", above, HEADING, rows), "belt_mesh")


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
    which = late(found, LATE)
    speed = found.channels["pulley_speed"][which]
    turned = np.ptp(found.channels["pulley_angle"][which], axis=0)
    crossings = _crossings(found, count, float(np.mean(speed[:, 0])))
    tight, slack = spans(found.channels, which)
    slip = float(1.0 - turned[1] / turned[0])
    return (
        *(scenario.base, _word(bends), count, tight, slack, 100.0 * slip),
        where_it_sticks(found, LATE),
        slip * found.scenario.mechanism.belt.axial_rigidity / (tight - slack),
        float(np.mean(speed[:, 1])),
        float(np.std(speed[:, scenario.free])),
        crossings,
        _rms_about(crossings, speed[:, scenario.free], INTERVAL),
        found.statistics.wall_seconds,
        warning_on(found),
    )


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


def _crossings(found: Record, count: int, speed: float) -> float:
    """Return how many bodies run on to a pulley in a second."""
    pulleys = found.scenario.mechanism.pulleys
    radius = pulleys[0].radius
    length = 2.0 * pi * radius + 2.0 * (pulleys[1].center[0] - pulleys[0].center[0])
    return abs(speed) * radius * count / length
