"""Creep, an unloaded drive and full slip, over bodies and models, against closed forms."""

from math import pi
from typing import Any

import numpy as np

from frictionsim.simulation.simulate import RunResult
from tests.benchmarks.results_common import quantity_of, warning_on
from tests.benchmarks.validation_models import CORRECTED, MODELS, POLYGON, STRING, Model, run
from tests.support.belt_closed_forms import SECTION_4, capstan, capstan_with_bending, creep

BODIES = (60, 150, 300, 600)
TORQUE, MU, RIGIDITY = 15.0, 1.0, 0.026  # N m, 1, N m^2
RECORDED = "output.channels=['pulley_speed', 'pulley_index', 'sticking', 'tension']"
# The resistance goes on with the speed: so coarse meshes have one, too.
LOAD = (
    "drive.driven.torque={speed = [-251.327412, 251.327412], value = [150.0, -150.0]}",
    "solver.duration=2.0",
)
IDLE = (
    "drive.driver={speed = {time = [0.0, 0.1], value = [0.0, -25.0]}}",
    "drive.driven.torque={time = [0.0], value = [0.0]}",
    "solver.duration=0.8",
)
DRIVE = (
    *("model", "bodies", "T1, N", "T2, N", "T1 - T2, N", "slip over creep"),
    *("share that sticks, driver", "driven", "sticking arc over T1"),
    *("unloaded: slip, %", "arc over span", "wall time, s", "warning"),
)
FULL_SLIP = (
    *("model", "bending", "bodies", "speed of the belt, m/s", "ratio of tensions"),
    *("closed form", "off, %", "warning"),
)
SLIPPING = 0.3  # mu
SPEEDS = (10.0, 30.0, 60.0)  # m/s
SLOW = 1.0


def drive() -> list[tuple[Any, ...]]:
    """Measure creep and the unloaded drive, without bending."""
    steady = creep(SECTION_4, TORQUE, MU, 25.13 * SECTION_4.radius)
    share = 1.0 - steady.sliding / pi
    force = steady.tight - steady.slack
    exact = (steady.tight, steady.slack, force, 1.0, share, share, 1.0, 0.0, 1.0)
    rows: list[tuple[Any, ...]] = [("closed form", "", *exact, "", "")]
    for model in MODELS:
        rows += filter(None, (_drive_row(model, bodies) for bodies in BODIES))
    return rows


def _drive_row(model: Model, bodies: int) -> tuple[Any, ...] | None:
    loaded = run(model, bodies, *LOAD, RECORDED, without=("bending",))
    idle = run(model, bodies, *IDLE, RECORDED, without=("bending",)) if loaded else None
    if loaded is None or idle is None:
        return None
    late = loaded.time >= 0.4 * loaded.time[-1]
    tight, slack = quantity_of(loaded, "tension_tight"), quantity_of(loaded, "tension_slack")
    shares = [
        quantity_of(loaded, f"adhesion_arc_{pulley}") / quantity_of(loaded, f"contact_arc_{pulley}")
        for pulley in ("driver", "driven")
    ]
    unloaded = idle.time >= 0.4 * idle.time[-1]
    return (
        *(model.name, bodies, tight, slack, tight - slack),
        _slip(loaded, late) * (SECTION_4.axial + tight) / (tight - slack),
        *shares,
        _where_it_sticks(loaded, late) / tight,
        100.0 * _slip(idle, unloaded),
        _arc_over_span(idle, unloaded),
        loaded.statistics.wall_seconds,
        warning_on(loaded) or warning_on(idle),
    )


def _slip(found: RunResult, late: Any) -> float:
    """Return the slip; a window that fades at its ends leaves nothing of the pulleys' swing."""
    speed = found.channels["pulley_speed"][late]
    driver, driven = np.hanning(len(speed)) @ speed
    return float(1.0 - driven / driver)


def _inside(found: RunResult, late: Any, pulley: float) -> Any:
    """Return which joints are between two bodies on a pulley, or on none, -1."""
    on = found.channels["pulley_index"][late] == pulley
    return on & np.roll(on, 1, axis=1)


def _where_it_sticks(found: RunResult, late: Any) -> float:
    """Return the median tension of the joints on the driver whose body sticks there, N."""
    inside = _inside(found, late, 0.0) & (found.channels["sticking"][late] > 0.0)
    return float(np.median(found.channels["tension"][late][inside]))


def _arc_over_span(found: RunResult, late: Any) -> float:
    """Return the mean tension on the driver over that of the joints that touch nothing."""
    tension = found.channels["tension"][late]
    arc, span = (tension[_inside(found, late, pulley)] for pulley in (0.0, -1.0))
    return float(np.mean(arc) / np.mean(span))


def full_slip() -> list[tuple[Any, ...]]:
    """Measure the ratio of the tensions where the belt slips on the driver as a whole."""
    rows = [_slip_row(model, False, bodies, SLOW) for model in MODELS for bodies in BODIES[:3]]
    rows += [_slip_row(m, False, 300, speed) for m in (CORRECTED, STRING) for speed in SPEEDS]
    rows += [
        _slip_row(m, True, bodies, SLOW) for m in (POLYGON, CORRECTED) for bodies in (150, 300)
    ]
    return [row for row in rows if row is not None]


def _slip_row(model: Model, bends: bool, bodies: int, speed: float) -> tuple[Any, ...] | None:
    turning = speed / SECTION_4.radius  # rad/s, of the driven pulley, which holds the belt
    done = run(
        model,
        bodies,
        "effects.belt_friction={mu_s = 0.3, mu_k = 0.3, "
        "pulleys = {driven = {mu_s = 3.0, mu_k = 3.0}}}",
        f"drive.driver={{speed = {{time = [0.0, 0.1], value = [0.0, {-1.5 * turning - 100.0}]}}}}",
        f"drive.driven={{speed = {{time = [0.0, 0.1], value = [0.0, {-turning}]}}}}",
        "output.channels=['pulley_speed']",
        "solver.duration=0.3",
        without=() if bends else ("bending",),
    )
    if done is None:
        return None
    tight, slack = quantity_of(done, "tension_tight"), quantity_of(done, "tension_slack")
    momentum = SECTION_4.mass * speed**2
    ratio = (tight - momentum) / (slack - momentum)
    exact = capstan(SLIPPING, pi)
    if bends:
        exact = capstan_with_bending(SLIPPING, pi, RIGIDITY, SECTION_4.radius, tight)
    off = 100.0 * (ratio / exact - 1.0)
    words = "with" if bends else "without"
    return (model.name, words, bodies, speed, ratio, exact, off, warning_on(done))
