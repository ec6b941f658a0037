"""How exact `events` is on drawn epicyclic gears, against an integration with more digits.

Run it as `python -m tests.benchmarks.gears` (a minute). The reference shares nothing with
the package: extrapolated midpoint steps (Gragg, Bulirsch, Stoer; Hairer et al. 1993, II.9) in the
processor's long double, 18 digits, that end where the motion stops and where the rolling load has a
kink. It is itself compared with steps of half the length.
"""

from math import ceil, floor, pi
from typing import Any, NamedTuple

import numpy as np

from tests.support.scenarios import simulate

Long = np.longdouble
COLUMNS = 9  # order 18
STEP = 0.02  # s
REST = Long(1e-17)  # rad/s, below which it stands
GEARS, SEED, DURATION = 50, 2014, 2.0
CHECKED = 10  # every so many the reference is integrated in steps of half the length, too
EXCESSES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
SLOW = 4.0  # s, for a crank that nearly stands still on its way
NUDGE = 1e-9  # rad, of the start: small against what bends the motion, large against roundings
RTOL, ATOL = 1e-11, 1e-13


class Gear(NamedTuple):
    """A gear under a constant torque, as coefficients of its equation.

    J phi'' = torque - weight cos phi - s (couple + roll |sin phi|); the static couple is `hold`.
    """

    inertia: Any
    torque: Any
    weight: Any
    couple: Any
    hold: Any
    roll: Any


class State(NamedTuple):
    angle: Any
    speed: Any


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """Return a scenario: any torque up to what lifts the crank, from any angle and either way."""
    crank, planet = rng.uniform(0.2, 2.0, 2)
    sun, wheel = rng.uniform(0.05, 0.2, 2)
    lifting = (0.5 * crank + planet) * 9.81 * (sun + wheel)
    static = rng.uniform(0.0, 0.1) * lifting
    return {
        "kind": "epicyclic",
        "mechanism": {
            "sun_radius": sun,
            "planet_radius": wheel,
            "crank_mass": crank,
            "planet_mass": planet,
            "initial_angle_deg": rng.uniform(-180.0, 180.0),
            "initial_angular_velocity": rng.uniform(-12.0, 12.0),
        },
        "drive": {"torque": rng.uniform(-1.2, 1.2) * lifting},
        "effects": {
            "gravity": {"g": 9.81},
            "hinge_friction": {
                "torque_static": static,
                "torque_kinetic": rng.uniform(0.3, 1.0) * static,
            },
            "rolling_friction": {"arm": rng.uniform(0.0, 2e-3)},
        },
        "solver": {"duration": DURATION, "rtol": RTOL, "atol": ATOL, "backend": "events"},
    }


def gear_of(data: dict[str, Any]) -> tuple[Gear, State]:
    mechanism, effects = data["mechanism"], data["effects"]
    sun, wheel = Long(mechanism["sun_radius"]), Long(mechanism["planet_radius"])
    crank, planet = Long(mechanism["crank_mass"]), Long(mechanism["planet_mass"])
    g, arm = Long(effects["gravity"]["g"]), Long(effects["rolling_friction"]["arm"])
    length, hinge = sun + wheel, effects["hinge_friction"]
    gear = Gear(
        (2 * crank + 9 * planet) * length**2 / 6,
        Long(data["drive"]["torque"]),
        (crank / 2 + planet) * g * length,
        Long(hinge["torque_kinetic"]) * sun / wheel,
        Long(hinge["torque_static"]) * sun / wheel,
        arm * planet * g * length / wheel,
    )
    degree = Long(np.arccos(Long(-1))) / 180
    start = Long(mechanism["initial_angle_deg"]) * degree
    return gear, State(start, Long(mechanism["initial_angular_velocity"]))


def final(gear: Gear, start: State, duration: float, step: float = STEP) -> State:
    """Return the state at the end, piece by piece between stops and multiples of pi."""
    t, now = Long(0), start
    half_turn = Long(np.arccos(Long(-1)))
    while t < duration:
        way = direction(gear, now)
        if way == 0:
            return State(now.angle, Long(0))
        half = float(now.angle / half_turn) + 1e-12 * way
        edges = half_turn * floor(half), half_turn * ceil(half)
        side = 1 if floor(half) % 2 == 0 else -1  # the sign of sin phi between them
        while t < duration:
            h = min(Long(step), duration - t)
            after = extrapolated(gear, now, h, way, side)
            ends = [after.speed * way < 0, after.angle > edges[1], after.angle < edges[0]]
            if any(ends):
                h, now = located(gear, now, h, way, side, edges)
                t += h
                break
            t, now = t + h, after
    return now


def direction(gear: Gear, now: State) -> int:
    """Return which way it moves or starts to; 0 where it rests, for ever: the torque stays."""
    if abs(now.speed) > REST:
        return 1 if now.speed > 0 else -1
    moment = gear.torque - gear.weight * np.cos(now.angle)
    limit = gear.hold + gear.roll * abs(np.sin(now.angle))
    return 0 if abs(moment) <= limit else (1 if moment > 0 else -1)


def extrapolated(gear: Gear, now: State, h: Any, way: int, side: int) -> State:
    """Take a step by midpoint rules of 2, 4, 6 ... parts, extrapolated to infinitely many."""
    rows: list[list[Any]] = []
    for k in range(COLUMNS):
        parts = 2 * (k + 1)
        row = [midpoint(gear, now, h, parts, way, side)]
        for j in range(1, k + 1):
            ratio = (Long(parts) / (2 * (k - j + 1))) ** 2
            row.append(row[j - 1] + (row[j - 1] - rows[k - 1][j - 1]) / (ratio - 1))
        rows.append(row)
    angle, speed = rows[-1][-1]
    return State(angle, speed)


def midpoint(gear: Gear, now: State, h: Any, parts: int, way: int, side: int) -> Any:
    """Return angle and speed after `parts` steps of the midpoint rule."""
    part = h / parts
    before = np.array(now)
    here = before + part * rate(gear, before, way, side)
    for _ in range(parts - 1):
        before, here = here, before + 2 * part * rate(gear, here, way, side)
    return here


def rate(gear: Gear, y: Any, way: int, side: int) -> Any:
    """Return the derivatives while it slips `way` and sin phi has the sign `side`."""
    friction = way * (gear.couple + gear.roll * side * np.sin(y[0]))
    moment = gear.torque - gear.weight * np.cos(y[0]) - friction
    return np.array([y[1], moment / gear.inertia])


def located(
    gear: Gear, now: State, longest: Any, way: int, side: int, edges: tuple[Any, Any]
) -> tuple[Any, State]:
    """Return when, within a step, it first stops or reaches an edge, and the state there."""
    low, high = Long(0), longest
    for _ in range(64):
        h = (low + high) / 2
        after = extrapolated(gear, now, h, way, side)
        beyond = after.speed * way < 0 or not edges[0] <= after.angle <= edges[1]
        low, high = (low, h) if beyond else (h, high)
    stops = abs(after.speed) < 1e-14 * max(1, abs(now.speed))
    return low, State(after.angle, Long(0) if stops else after.speed)


class Found(NamedTuple):
    """The error of the final angle, by how much an error of the start grows, and turns."""

    error: float
    growth: float
    turns: float


def compared(data: dict[str, Any]) -> Found:
    gear, start = gear_of(data)
    duration = data["solver"]["duration"]
    exact = final(gear, start, duration)
    nudged = final(gear, start._replace(angle=start.angle + NUDGE), duration)
    run = simulate(data)
    if run.status != "done":
        raise ValueError(run.reason)
    return Found(
        abs(float(run.channels["angle"][-1] - exact.angle)),
        abs(float(nudged.angle - exact.angle)) / NUDGE,
        float(exact.angle - start.angle) / (2 * pi),
    )


def over_the_top(excess: float) -> dict[str, Any]:
    """Return a crank that comes over its top with so much of its first speed to spare."""
    data = drawn(np.random.default_rng(SEED))
    data["drive"]["torque"] = 0.0
    data["mechanism"]["initial_angle_deg"] = -90.0
    data["solver"]["duration"] = SLOW
    gear, _ = gear_of(data)
    top = Long(pi / 2)  # a little beyond it the weight drives as much as friction takes
    for _ in range(60):
        top = np.arccos(-(gear.couple + gear.roll * np.sin(top)) / gear.weight)
    half_turn = Long(np.arccos(Long(-1)))
    work = gear.weight * (np.sin(top) + 1) + gear.couple * (top + half_turn / 2)
    work += gear.roll * (2 - np.cos(top))
    speed = np.sqrt(2 * work / gear.inertia) * (1 + excess)
    data["mechanism"]["initial_angular_velocity"] = float(speed)
    return data


def main() -> None:
    """Print the errors of `events`, the reference's own, and what an error of the start becomes."""
    rng = np.random.default_rng(SEED)
    gears = [drawn(rng) for _ in range(GEARS)]
    errors = np.array([compared(data).error for data in gears])
    print(f"{GEARS} gears, {DURATION:g} s, seed {SEED}, events at rtol {RTOL:g}")
    quartiles = np.quantile(errors, [0.25, 0.5, 0.75, 1.0])
    print("error of the final angle, rad, quartiles and worst:", *(f"{q:.1e}" for q in quartiles))
    print(f"within 1e-8 rad: {np.sum(errors < 1e-8)} of {GEARS}")
    halved = [
        abs(
            float(
                final(*gear_of(data), DURATION).angle
                - final(*gear_of(data), DURATION, STEP / 2).angle
            )
        )
        for data in gears[::CHECKED]
    ]
    print(f"reference against steps of half the length: {max(halved):.1e} rad at worst")
    print("barely over the top: excess of speed, error rad, growth of an error of the start, turns")
    for excess in EXCESSES:
        found = compared(over_the_top(excess))
        print(f"  {excess:.0e} {found.error:.1e} {found.growth:.1e} {found.turns:.2f}")


if __name__ == "__main__":
    main()
