"""Waves, weight and what is conserved: a belt that drives nothing, against closed forms."""

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from frictionsim.mechanisms.belt_drive.assembly import assemble
from frictionsim.results import Check, Record
from tests.benchmarks.results_common import quantity_of, say
from tests.benchmarks.validation_models import CORRECTED, MODELS, Model, run
from tests.support.belt_closed_forms import (
    SECTION_4,
    loop_mode,
    sag,
    transverse_mode,
    two_pulley_mode,
)
from tests.support.belt_scenarios import NO_FRICTION, scenario_of, shipped
from tests.support.belt_waves import Array, waves

WAVES = ("what", "model", "bodies", "found", "closed form", "off, %")
CONSERVED = (
    *("model", "bodies", "what", "share or trend"),
    *("energy audit", "torque audit", "warning"),
)
BODIES = (150, 300)
UNDAMPED = ("effects.contact.damping=0.0", "output.channels=['pulley_speed']")
LEFT_OUT = ("bending", "axial_damping")
PULSE, TORQUE = 5.0, 15.0  # N m
RINGING, LONG = 0.1, 10.0  # s
GRAVITY, LOOSE = 9.81, 20.0  # m/s^2, N


def waves_and_weight() -> list[tuple[Any, ...]]:
    """Compare frequencies, the tension in a span that hangs, and its sag."""
    rows = [row for model in MODELS for n in BODIES if (row := _pulleys(model, n)) is not None]
    for n in BODIES:
        rows += _belt(n)
    return rows + _weight(BODIES[0])


def _row(what: str, model: str, bodies: int, found: float, exact: float) -> tuple[Any, ...]:
    return (what, model, bodies, found, exact, 100.0 * (found / exact - 1.0))


def _swing(model: Model, bodies: int, *overrides: str) -> Record | None:
    """Run a drive at rest whose pulleys get opposite pulses; nothing slides and nothing damps."""
    return run(
        model,
        bodies,
        f"drive.driver={{torque = {{time = [0.0, 5e-4, 1e-3], value = [0.0, {-PULSE}, 0.0]}}}}",
        f"drive.driven={{torque = {{time = [0.0, 5e-4, 1e-3], value = [0.0, {PULSE}, 0.0]}}}}",
        *overrides,
        without=LEFT_OUT,
    )


def _pulleys(model: Model, bodies: int) -> tuple[Any, ...] | None:
    times = (f"solver.duration={RINGING}", "output.interval=5e-5")
    done = _swing(model, bodies, *UNDAMPED, *times)
    if done is None:
        return None
    speeds = done.channels["pulley_speed"]
    found = _frequency(done.time, speeds[:, 0] - speeds[:, 1], after=2e-3)
    exact = two_pulley_mode(SECTION_4)
    return _row("pulleys against each other, rad/s", model.name, bodies, found, exact)


def _frequency(time: Array, values: Array, after: float) -> float:
    """Return the angular frequency of a swing that may decay, rad/s."""
    kept = time > after
    t, y = time[kept] - after, values[kept]
    power = np.abs(np.fft.rfft(y * np.hanning(len(y))))
    guess = 2.0 * np.pi * float(np.argmax(power[1:]) + 1) / (t[-1] - t[0])

    def missing(p: Array) -> Array:
        swing = p[0] * np.cos(p[2] * t) + p[1] * np.sin(p[2] * t)
        return np.asarray(swing * np.exp(-p[3] * t) + p[4] - y)

    start = [float(np.ptp(y)) / 2.0, 0.0, guess, 0.0, float(np.mean(y))]
    scale = [1.0, 1.0, 1.0 / t[-1], 1.0 / t[-1], 1.0]
    return float(least_squares(missing, start, x_scale=scale).x[2])


def _belt(bodies: int) -> list[tuple[Any, ...]]:
    """Find waves of the belt itself by their shapes: along the loop, and across a span."""
    say(f"  waves of {bodies} bodies")
    still = {"effects__belt_friction": NO_FRICTION, "drive__driver__torque": 0.0}
    data = shipped("belt_drive", mechanism__belt__bodies=bodies, effects__bending=None, **still)
    model = assemble(scenario_of(data))
    n, width = bodies, model.system.layout.width
    x, y, angle = (model.state[row * width : row * width + n] for row in range(3))
    frequencies, shapes = waves(model)

    def nearest(*wanted: Array) -> float:
        """Return the highest frequency of as many shapes as are wanted, of those most like them."""
        shares = [(shape @ shapes) ** 2 / (shape @ shape) for shape in wanted]
        share = np.sum(shares, axis=0) / np.sum(shapes**2, axis=0)
        return float(np.max(frequencies[np.argsort(share)[-len(wanted) :]]))

    # Of the two waves along the loop one does not stretch the arcs, which the soft contacts make
    # more compliant than the spans: it is the faster one.
    phase, none = 2.0 * np.pi * np.arange(n) / n, np.zeros(n)
    along = [
        np.concatenate([wave * np.cos(angle), wave * np.sin(angle), none])
        for wave in (np.sin(phase), np.cos(phase))
    ]
    exact = loop_mode(SECTION_4)
    rows = [_row("wave along the loop, rad/s", "chain", n, nearest(*along), exact)]
    span = (y > 0.0) & (x > 0.0) & (x < SECTION_4.distance)
    for number in (1, 3):
        across = np.where(span, np.sin(number * np.pi * x / SECTION_4.distance), 0.0)
        found = nearest(np.concatenate([none, across, none]))
        what = f"wave {number} across a span, rad/s"
        rows.append(_row(what, "chain", n, found, transverse_mode(SECTION_4, number)))
    return rows


def _weight(bodies: int) -> list[tuple[Any, ...]]:
    """Measure the sag of a level drive, and how tension grows upwards in an upright one."""
    level, upright = (_hanging(bodies, center) for center in ("[0.515, 0.0]", "[0.0, 0.515]"))
    if level is None or upright is None:
        return []
    x, y, tension, free = level
    free &= y > 0.0
    length, pull = SECTION_4.distance, float(np.mean(tension[free]))
    found = np.polyfit(x[free] - 0.5 * length, y[free], 2)[0] * 0.25 * length**2
    hung = sag(SECTION_4, pull, GRAVITY)
    x, y, tension, free = upright
    free &= x > 0.0
    slope = float(np.polyfit(y[free], tension[free], 1)[0])
    exact = SECTION_4.mass * GRAVITY / (1.0 + LOOSE / SECTION_4.axial)
    return [
        _row("sag of a span, mm", "chain", bodies, 1e3 * float(found), 1e3 * hung),
        _row("tension over height in an upright span, N/m", "chain", bodies, slope, exact),
    ]


def _hanging(bodies: int, center: str) -> tuple[Array, Array, Array, Array] | None:
    """Return x, y and tension of the joints at rest, and which of them touch nothing."""
    first, second = (
        f"{{name = '{name}', center = {at}, radius = 0.027, inertia = 2.4e-4}}"
        for name, at in (("driver", "[0.0, 0.0]"), ("driven", center))
    )
    done = run(
        CORRECTED,
        bodies,
        f"mechanism.pulleys=[{first}, {second}]",
        f"mechanism.belt.pretension={LOOSE}",
        f"effects.gravity={{g = {GRAVITY}}}",
        "drive.driver.torque={time = [0.0], value = [0.0]}",
        "solver.duration=1e-4",
        "output.interval=1e-4",
        "output.channels=['x', 'y', 'tension', 'pulley_index']",
        without=("bending",),
    )
    if done is None:
        return None
    x, y, tension, under = (
        done.channels[name][0] for name in ("x", "y", "tension", "pulley_index")
    )
    free = (under < 0) & (np.roll(under, 1) < 0)
    return 0.5 * (x + np.roll(x, 1)), 0.5 * (y + np.roll(y, 1)), tension, free


def conserved() -> list[tuple[Any, ...]]:
    """Say what is kept over 10 s: energy where nothing damps, torques under load."""
    rows: list[tuple[Any, ...]] = []
    for model in MODELS:
        rows += filter(None, (_ringing(model, BODIES[0]), _loaded(model, BODIES[0])))
    return rows


def _ringing(model: Model, bodies: int) -> tuple[Any, ...] | None:
    energies = ("input", "kinetic", "potential", "friction")
    names = ", ".join(f"'energy_{name}'" for name in energies)
    times = (f"solver.duration={LONG}", "output.interval=1e-3")
    done = _swing(model, bodies, UNDAMPED[0], f"output.channels=[{names}]", *times)
    if done is None:
        return None
    work, kinetic, potential, _ = (done.channels[f"energy_{name}"] for name in energies)
    after = done.time > 2e-3
    stored = (kinetic + potential)[after]
    trend = np.polyfit(done.time[after], stored, 1)[0] * LONG / work[-1]
    return _conserved(
        done, model, bodies, "stored energy of a swing, trend over its work", float(trend)
    )


def _loaded(model: Model, bodies: int) -> tuple[Any, ...] | None:
    channels = "output.channels=['pulley_speed']"
    duration = f"solver.duration={LONG}"
    done = run(model, bodies, channels, duration, without=("bending",))
    if done is None:
        return None
    force = quantity_of(done, "tension_tight") - quantity_of(done, "tension_slack")
    off = force * SECTION_4.radius / TORQUE - 1.0
    return _conserved(done, model, bodies, "T1 - T2 under load, off M/R", off)


def _conserved(done: Record, model: Model, bodies: int, what: str, value: float) -> tuple[Any, ...]:
    none = Check(float("nan"), 0.0)
    audits = [done.checks.get(name, none) for name in ("energy_balance", "torque_balance")]
    failed = ", ".join(name for name, check in done.checks.items() if not check.ok)
    numbers = (audit.value for audit in audits)
    return (model.name, bodies, what, value, *numbers, failed)
