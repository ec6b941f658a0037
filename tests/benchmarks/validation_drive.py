"""Creep, an unloaded drive and full slip, over bodies and models, against closed forms."""

from math import pi
from typing import Any

from tests.benchmarks.results_common import (
    arc_over_span,
    quantity_of,
    slip,
    warning_on,
    where_it_sticks,
)
from tests.benchmarks.results_wrap import IDLE, LOAD, RECORDED
from tests.benchmarks.validation_models import CORRECTED, MODELS, POLYGON, STRING, Model, run
from tests.support.belt_closed_forms import SECTION_4, capstan, capstan_with_bending, creep

MESHES = {POLYGON: (150, 300, 600), CORRECTED: (150, 300, 600), STRING: (60, 150, 600)}
TORQUE, MU, RIGIDITY = 15.0, 1.0, 0.026  # N m, 1, N m^2
LOADED = (*LOAD, "solver.duration=2.0", RECORDED)
UNLOADED = (*IDLE, "solver.duration=0.8", RECORDED)
DRIVE = (
    *("model", "bodies", "T1, N", "T2, N", "T1 - T2, N", "slip over creep"),
    *("share that sticks, driver", "sticking arc over T1"),
    *("unloaded: arc over span", "warning"),
)
FULL_SLIP = (
    *("model", "bending", "bodies", "speed of the belt, m/s", "ratio of tensions"),
    *("closed form", "off, %", "warning"),
)
SLIPPING = 0.3  # mu
SLOW, FAST = 1.0, 60.0  # m/s


def drive() -> list[tuple[Any, ...]]:
    """Measure creep and the unloaded drive, without bending."""
    steady = creep(SECTION_4, TORQUE, MU, 25.13 * SECTION_4.radius)
    share = 1.0 - steady.sliding / pi
    force = steady.tight - steady.slack
    exact = (steady.tight, steady.slack, force, 1.0, share, 1.0, 1.0)
    rows: list[tuple[Any, ...]] = [("closed form", "", *exact, "")]
    for model, meshes in MESHES.items():
        rows += filter(None, (_drive_row(model, bodies) for bodies in meshes))
    return rows


def _drive_row(model: Model, bodies: int) -> tuple[Any, ...] | None:
    loaded = run(model, bodies, *LOADED, without=("bending",))
    idle = run(model, bodies, *UNLOADED, without=("bending",)) if loaded else None
    if loaded is None or idle is None:
        return None
    tight, slack = quantity_of(loaded, "tension_tight"), quantity_of(loaded, "tension_slack")
    arcs = [quantity_of(loaded, f"{arc}_arc_driver") for arc in ("adhesion", "contact")]
    return (
        *(model.name, bodies, tight, slack, tight - slack),
        slip(loaded) * (SECTION_4.axial + tight) / (tight - slack),
        arcs[0] / arcs[1],
        where_it_sticks(loaded) / tight,
        arc_over_span(idle),
        warning_on(loaded) or warning_on(idle),
    )


def full_slip() -> list[tuple[Any, ...]]:
    """Measure the ratio of the tensions where the belt slips on the driver as a whole."""
    rows = [_slip_row(model, False, bodies, SLOW) for model in MODELS for bodies in (150, 300)]
    rows += [_slip_row(model, False, 300, FAST) for model in (CORRECTED, STRING)]
    rows += [_slip_row(CORRECTED, True, bodies, SLOW) for bodies in (150, 300)]
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
