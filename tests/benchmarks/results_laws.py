"""Exact stick against friction that is smoothed over a speed, or creeps, as published."""

from typing import Any, NamedTuple

import numpy as np

from frictionsim.results import Record
from tests.benchmarks.results_common import (
    WARM_UP_FRACTION,
    Table,
    quantity_of,
    say,
    solve,
    warning_on,
    write,
)

TOLERANCES = (1e-2, 1e-3, 1e-4)
SPEEDS = (1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5)  # m/s
SHORT, LONG = 0.02, 0.1  # s
LATE = 0.8  # of the run, after which the means of the summary are taken
MAX_WALL = 60.0  # s
EXACT, SMOOTHED, PUBLISHED = "exact stick", "smoothed", "published"
HEADING = (
    *("run [s]", "law", "over [m/s]", "rtol", "slip [%]", "share that sticks"),
    *("median relative speed [m/s]", "driven speed [rad/s]", "error of the slip"),
    *("wall time [s]", "steps", "rejected", "warning"),
)


class Case(NamedTuple):
    """A law at a tolerance; `speed` is what it is smoothed over, m/s."""

    law: str
    speed: float
    rtol: float
    duration: float

    @property
    def name(self) -> str:
        return self.law if self.law == EXACT else f"{self.law} over {self.speed:g} m/s"

    @property
    def base(self) -> str:
        return "belt_drive_published" if self.law == PUBLISHED else "belt_drive"

    @property
    def overrides(self) -> tuple[str, ...]:
        found = ("solver.backend=rkf45", f"solver.rtol={self.rtol:g}")
        if self.law != SMOOTHED:
            return found
        friction = "effects.belt_friction"
        return (
            *(*found, f"{friction}.law=regularised"),
            f"{friction}.transition_speed={self.speed:g}",
        )


class Row(NamedTuple):
    """What a case came to; the figures are nan where the budget ran out."""

    case: Case
    slip: float
    share: float
    relative_speed: float
    driven_speed: float
    wall: float
    steps: int
    rejected: int
    warning: str


def laws(max_wall: float = MAX_WALL) -> None:
    """Measure, and write the table."""
    rows = [_measure(case, max_wall) for case in _cases(SHORT, TOLERANCES, SPEEDS)]
    rows += [_measure(case, max_wall) for case in _cases(LONG, TOLERANCES[:2], SPEEDS)]
    above = [
        "`belt_drive.toml`: set-valued friction, solved for exactly; the same smoothed over a speed"
        " (`regularised`); and the published creep law (`belt_drive_published.toml`, mu_s = 1.05),"
        f" all by `rkf45`. Means over the last fifth of a run, of {MAX_WALL:g} s of wall time at"
        " most. A body under a smoothed law counts as sticking below its transition speed, so that"
        " a large speed makes everything stick; the median relative speed of the bodies that touch"
        " a pulley has no such threshold. The error is against exact stick at the tightest"
        " tolerance.",
    ]
    table = [_cells(row, _reference(rows, row.case.duration)) for row in rows]
    write(Table("Exact stick and smoothed friction", above, HEADING, table), "belt_laws")


def _cases(duration: float, tolerances: Any, speeds: Any) -> list[Case]:
    found = [Case(EXACT, float("nan"), rtol, duration) for rtol in tolerances]
    found += [Case(PUBLISHED, 1e-5, rtol, duration) for rtol in tolerances]
    return found + [Case(SMOOTHED, v, rtol, duration) for rtol in tolerances for v in speeds]


def _measure(case: Case, max_wall: float) -> Row:
    say(f"  {case.name}, rtol {case.rtol:g}, {case.duration:g} s")
    solve(case.base, *case.overrides, *WARM_UP_FRACTION)
    times = (f"solver.duration={case.duration}", f"output.interval={case.duration / 200}")
    found = solve(case.base, *case.overrides, *times, max_wall=max_wall)
    done = found.status == "done"
    names = ("slip_percent", "stick_fraction", "driven_speed")
    slip, share, driven = (quantity_of(found, name) if done else float("nan") for name in names)
    statistics = found.statistics
    relative = _relative_speed(found) if done else float("nan")
    work = statistics.wall_seconds, statistics.steps, statistics.rejected
    return Row(case, slip, share, relative, driven, *work, warning_on(found))


def _relative_speed(found: Record) -> float:
    """Return the median speed, against its pulley, of the bodies that touch one, m/s."""
    late = found.time >= LATE * found.time[-1]
    touching = found.channels["pulley_index"][late] >= 0
    return float(np.median(np.abs(found.channels["slip_velocity"][late][touching])))


def _reference(rows: list[Row], duration: float) -> Row:
    exact = [r for r in rows if r.case.law == EXACT and r.case.duration == duration]
    return min(exact, key=lambda row: row.case.rtol)


def _error(row: Row, reference: Row) -> float:
    return abs(row.slip / reference.slip - 1.0)


def _cells(row: Row, reference: Row) -> tuple[Any, ...]:
    case = row.case
    return (
        *(case.duration, case.law, case.speed, case.rtol, row.slip, row.share),
        *(row.relative_speed, row.driven_speed, _error(row, reference)),
        *(row.wall, row.steps, row.rejected, row.warning),
    )
