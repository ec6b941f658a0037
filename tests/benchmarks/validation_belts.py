"""Belts of bodies and guided ones, against closed forms and against Exudyn.

Creep, an unloaded drive and full slip; waves and weight of a belt that drives nothing; the speed of
`belt_verification.toml` by `peer_exudyn.py`, read from `results/belt_peer.json`, the difference
taken apart.
"""

import json
from itertools import product, starmap
from math import pi
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from frictionsim.results import Record
from tests.benchmarks.results_belts import IDLE, LOAD, RECORDED
from tests.benchmarks.results_common import (
    RESULTS,
    arc_over_span,
    moreau,
    quantity_of,
    say,
    slip,
    tensions_of,
    warning_on,
    where_it_sticks,
)
from tests.support.belt_closed_forms import (
    SECTION_4,
    capstan,
    capstan_with_bending,
    creep,
    loop_mode,
    sag,
    slip_over_creep,
    transverse_mode,
    two_pulley_mode,
)
from tests.support.belt_kernels import assemble
from tests.support.belt_scenarios import NO_FRICTION, scenario_of, shipped
from tests.support.belt_waves import Array, waves


class Model(NamedTuple):
    """A model of the belt: what chooses it in a scenario."""

    name: str
    overrides: tuple[str, ...]
    without: tuple[str, ...] = ()  # effects that it does without
    guided: bool = False  # it has no motion across the belt


POLYGON = Model("polygon", ("mechanism.belt.wrap=polygon",))
CORRECTED = Model("corrected", ("mechanism.belt.wrap=corrected",))
STRING = Model("string", (), ("contact", "bending", "gravity"), guided=True)
MODELS = (POLYGON, CORRECTED, STRING)
Row = tuple[Any, ...]


def run(
    model: Model,
    bodies: int,
    *overrides: str,
    base: str = "belt_drive",
    without: tuple[str, ...] = (),
) -> Record:
    """Run a shipped scenario with a model."""
    kept = [key for key in overrides if not (model.guided and key.startswith("effects.contact"))]
    done = moreau(base, bodies, *model.overrides, *kept, without={*without, *model.without})
    assert done.status == "done", done.reason
    return done


# Creep and full slip

MESHES = {POLYGON: (150, 300, 600), CORRECTED: (150, 300, 600), STRING: (60, 150, 600)}
MU, RIGIDITY = 1.0, 0.026  # 1, N m^2
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


def drive() -> list[Row]:
    """Measure creep and the unloaded drive, without bending."""
    steady = creep(SECTION_4, TORQUE, MU, 25.13 * SECTION_4.radius)
    share = 1.0 - steady.sliding / pi
    force = steady.tight - steady.slack
    exact = (steady.tight, steady.slack, force, 1.0, share, 1.0, 1.0)
    cases = ((model, bodies) for model, meshes in MESHES.items() for bodies in meshes)
    return [("closed form", "", *exact, ""), *starmap(_drive_row, cases)]


def _drive_row(model: Model, bodies: int) -> Row:
    loaded = run(model, bodies, *LOADED, without=("bending",))
    idle = run(model, bodies, *UNLOADED, without=("bending",))
    tight, slack = tensions_of(loaded)
    arcs = [quantity_of(loaded, f"{arc}_arc_driver") for arc in ("adhesion", "contact")]
    return (
        *(model.name, bodies, tight, slack, tight - slack),
        slip_over_creep(SECTION_4, slip(loaded), tight, slack),
        arcs[0] / arcs[1],
        where_it_sticks(loaded) / tight,
        arc_over_span(idle),
        warning_on(loaded) or warning_on(idle),
    )


def full_slip() -> list[Row]:
    """Measure the ratio of the tensions where the belt slips on the driver as a whole."""
    cases = [(model, False, bodies, SLOW) for model in MODELS for bodies in (150, 300)]
    cases += [(model, False, 300, FAST) for model in (CORRECTED, STRING)]
    cases += [(CORRECTED, True, bodies, SLOW) for bodies in (150, 300)]
    return list(starmap(slip_row, cases))


def slip_row(model: Model, bends: bool, bodies: int, speed: float) -> Row:
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
    tight, slack = tensions_of(done)
    momentum = SECTION_4.mass * speed**2
    ratio = (tight - momentum) / (slack - momentum)
    exact = capstan(SLIPPING, pi)
    if bends:
        exact = capstan_with_bending(SLIPPING, pi, RIGIDITY, SECTION_4.radius, tight)
    off = 100.0 * (ratio / exact - 1.0)
    words = "with" if bends else "without"
    return (model.name, words, bodies, speed, ratio, exact, off, warning_on(done))


# Waves and weight

WAVES = ("what", "model", "bodies", "found", "closed form", "off, %")
WAVE_BODIES = (150, 300)
UNDAMPED = ("effects.contact.damping=0.0", "output.channels=['pulley_speed']")
LEFT_OUT = ("bending", "axial_damping")
PULLEYS = "driver", "driven"
PULSE, TORQUE = 5.0, 15.0  # N m
RINGING = 0.1  # s
GRAVITY, LOOSE = 9.81, 20.0  # m/s^2, N


def waves_and_weight() -> list[Row]:
    """Compare frequencies, the tension in a span that hangs, and its sag."""
    rows = list(starmap(pulleys, product(MODELS, WAVE_BODIES)))
    for n in WAVE_BODIES:
        rows += waves_of_belt(n)
    return rows + weight(WAVE_BODIES[0])


def _row(what: str, model: str, bodies: int, value: float, exact: float) -> Row:
    return (what, model, bodies, value, exact, 100.0 * (value / exact - 1.0))


def pulleys(model: Model, bodies: int) -> Row:
    """Run a drive at rest whose pulleys get opposite pulses; nothing slides and nothing damps."""
    pulse = "torque = {{time = [0.0, 5e-4, 1e-3], value = [0.0, {}, 0.0]}}"
    sizes = zip(PULLEYS, (-PULSE, PULSE), strict=True)
    drive = (f"drive.{name}={{{pulse.format(size)}}}" for name, size in sizes)
    times = (f"solver.duration={RINGING}", "output.interval=5e-5")
    done = run(model, bodies, *drive, *UNDAMPED, *times, without=LEFT_OUT)
    late, speeds = done.time > 2e-3, done.channels["pulley_speed"]
    t, y = done.time[late] - 2e-3, (speeds[:, 0] - speeds[:, 1])[late]
    power = np.abs(np.fft.rfft(y * np.hanning(len(y))))
    guess = 2.0 * np.pi * float(np.argmax(power[1:]) + 1) / (t[-1] - t[0])
    frequency, exact = _swing(t, y, guess, 0.0)[1], two_pulley_mode(SECTION_4)
    return _row("pulleys against each other, rad/s", model.name, bodies, frequency, exact)


def _swing(t: Array, y: Array, guess: float, decay: float) -> tuple[float, float]:
    """Return mean and angular frequency of a swing that decays, rad/s."""

    def missing(p: Array) -> Array:
        swing = p[0] * np.cos(p[2] * t) + p[1] * np.sin(p[2] * t)
        return np.asarray(swing * np.exp(-p[3] * t) + p[4] - y)

    start = [float(np.ptp(y)) / 2.0, 0.0, guess, decay, float(np.mean(y))]
    scale = [1.0, 1.0, 1.0 / t[-1], 1.0 / t[-1], 1.0]
    found = least_squares(missing, start, x_scale=scale).x
    return float(found[4]), float(found[2])


def waves_of_belt(bodies: int) -> list[Row]:
    """Find waves of the belt itself by their shapes: along the loop, and across a span."""
    say(f"  waves of {bodies} bodies")
    still = {"effects__belt_friction": NO_FRICTION, "drive__driver__torque": 0.0}
    data = shipped("belt_drive", mechanism__belt__bodies=bodies, effects__bending=None, **still)
    model = assemble(scenario_of(data))
    n, width = bodies, model.belt.width
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
        modes = nearest(np.concatenate([none, across, none]))
        what = f"wave {number} across a span, rad/s"
        rows.append(_row(what, "chain", n, modes, transverse_mode(SECTION_4, number)))
    return rows


def weight(bodies: int) -> list[Row]:
    """Measure the sag of a level drive, and how tension grows upwards in an upright one."""
    level, upright = (_hanging(bodies, center) for center in ("[0.515, 0.0]", "[0.0, 0.515]"))
    x, y, tension, free = level
    free &= y > 0.0
    length, pull = SECTION_4.distance, float(np.mean(tension[free]))
    computed = np.polyfit(x[free] - 0.5 * length, y[free], 2)[0] * 0.25 * length**2
    hung = sag(SECTION_4, pull, GRAVITY)
    x, y, tension, free = upright
    free &= x > 0.0
    slope = float(np.polyfit(y[free], tension[free], 1)[0])
    exact = SECTION_4.mass * GRAVITY / (1.0 + LOOSE / SECTION_4.axial)
    return [
        _row("sag of a span, mm", "chain", bodies, 1e3 * float(computed), 1e3 * hung),
        _row("tension over height in an upright span, N/m", "chain", bodies, slope, exact),
    ]


def _hanging(bodies: int, center: str) -> tuple[Array, Array, Array, Array]:
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
    x, y, tension, under = (
        done.channels[name][0] for name in ("x", "y", "tension", "pulley_index")
    )
    free = (under < 0) & (np.roll(under, 1) < 0)
    return 0.5 * (x + np.roll(x, 1)), 0.5 * (y + np.roll(y, 1)), tension, free


# A peer

PEER = (
    *("program", "case", "mean after the load, rad/s", "vibration, Hz"),
    *("rms off ours of 480 bodies, rad/s", "rms off the peer, rad/s"),
)
LOAD_ON, END = 0.3, 0.6  # s
OF_BOTH = (
    *("mechanism.belt.pretension=256.0", "effects.axial_damping.basis=section"),
    "output.channels=['pulley_speed']",
)
BEST = "corrected, 480 bodies"
CASES: dict[str, tuple[Any, ...]] = {
    **{f"corrected, {bodies} bodies": (CORRECTED, bodies) for bodies in (60, 120, 240, 480)},
    **{f"{model.name}, 480 bodies": (model, 480) for model in (POLYGON, STRING)},
    "240 bodies, contact 16 times stiffer": (CORRECTED, 240, "effects.contact.c2=8e7"),
    "240 bodies, damping=0": (CORRECTED, 240, "effects.axial_damping.coefficient=1e-6"),
}


def peer() -> list[Row]:
    """Compare the speed of the driven pulley in all cases of both."""
    speeds: dict[tuple[str, str], Array] = {}
    for name, (model, bodies, *changed) in CASES.items():
        done = run(model, bodies, *OF_BOTH, *changed, base="belt_verification")
        speeds["ours", name] = done.channels["pulley_speed"][:, 1]
    theirs = json.loads((RESULTS / "belt_peer.json").read_text(encoding="utf-8"))["cases"]
    speeds |= {("peer", name): np.array(case["driven_speed"]) for name, case in theirs.items()}
    references = speeds["ours", BEST], speeds["peer", "standard"]
    rows = []
    for names, curve in speeds.items():
        off = [float(np.sqrt(np.mean((curve - other) ** 2))) for other in references]
        rows.append((*names, *_vibration(curve), *off))
    return rows


def _vibration(curve: Array) -> tuple[float, float]:
    """Return mean and frequency of the speed once the load is on, rad/s and Hz."""
    time = np.linspace(0.0, END, len(curve))
    late = time > LOAD_ON + 0.01
    mean, turning = _swing(time[late] - LOAD_ON, curve[late], 2.0 * pi * 22.5, 3.0)
    return mean, turning / (2.0 * pi)
