"""The balance of a body at rest on a shaft in a hundred digits, from the data of a scenario.

It turns points and directions by rotation, sums forces and moments, and shares nothing with the
package. The unknown is a value in the data, and eq 24 follows from the balances with two values.
"""

import copy
from random import Random
from typing import Any, NamedTuple

import mpmath
import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

from tests.support.scenarios import Scenario

DIGITS = 100
# What is left of differences that vanish; a friction of 1e-30 leaves 1e-60 of those of squares.
NOISE_OF_SQUARES, NOISE = mpf("1e-85"), mpf("1e-45")
Vector = tuple[Any, Any]
Array = NDArray[np.float64]
SCANNED = 40_001


def written(number: Any) -> Any:
    """Return a number as a scenario has it: 0.15, not the nearest number of base 2."""
    return number if isinstance(number, mpf) else mpf(repr(number))


def turned(vector: Any, angle: Any) -> Vector:
    x, y = map(written, vector)
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    return c * x - s * y, s * x + c * y


def balance(data: Scenario, degrees: Any) -> tuple[Any, Any, Any]:
    """Return the moment, N m, and the components of the resultant, N."""
    effects = data.get("effects", {})
    degrees = written(degrees)
    angle = degrees * mp.pi / 180
    moment = across = up = mpf(0)
    for force in data.get("forces", ()):
        size = written(force["size"])
        x, y = map(written, force["direction"])
        length = mpmath.sqrt(x * x + y * y)
        direction = turned((x / length, y / length), angle if force.get("direction_turns") else 0)
        across, up = across + size * direction[0], up + size * direction[1]
        if "cord_radius" in force:
            moment += written(force["cord_radius"]) * size
            continue
        point = turned(force["point"], angle if force.get("point_turns", True) else 0)
        moment += size * (point[0] * direction[1] - point[1] * direction[0])
    for couple in data.get("couples", ()):
        moment += written(couple["size"])
    if "gravity" in effects:
        g = written(effects["gravity"]["g"])
        up -= g * written(data["mechanism"].get("mass", 0.0))
        if "eccentric_mass" in effects:
            eccentric = effects["eccentric_mass"]
            weight = g * written(eccentric["mass"])
            at = angle + written(eccentric.get("azimuth_deg", 0.0)) * mp.pi / 180
            up -= weight
            moment -= weight * written(eccentric["radius"]) * mpmath.cos(at)
    if "torsion_spring" in effects:
        spring = effects["torsion_spring"]
        twist = degrees - written(spring.get("free_angle_deg", 0.0))
        moment -= written(spring["stiffness"]) * twist * mp.pi / 180
    return moment, across, up


def placed(data: Scenario, value: Any) -> Scenario:
    copied = copy.deepcopy(data)
    *tables, last = data["statics"]["unknown"].split(".")
    table: Any = copied
    for name in tables:
        if isinstance(table, list):
            table = next(row for row in table if row["name"] == name)
        else:
            table = table[name]
    if last != "distance":
        table[last] = value
        return copied
    x, y = map(written, table["point"])
    length = mpmath.sqrt(x * x + y * y)
    table["point"] = [value * x / length, value * y / length]
    return copied


def friction_radius(data: Scenario) -> Any:
    journal = data.get("effects", {}).get("shaft_friction")
    if journal is None:
        return mpf(0)
    mu = written(journal["mu_s"])
    return written(journal["shaft_radius"]) * mu / mpmath.sqrt(1 + mu * mu)


def excess(data: Scenario, value: Any, degrees: Any) -> Any:
    """Return M^2 - r_s^2 F^2 with a value of the unknown."""
    of = placed(data, value)
    moment, across, up = balance(of, degrees)
    return moment**2 - friction_radius(of) ** 2 * (across**2 + up**2)


def roots(data: Scenario, degrees: Any) -> list[tuple[Any, int]]:
    """Return all real roots in ascending order, with the signs of their moments."""
    if data["statics"]["unknown"].endswith(("mu_s", "shaft_radius")):
        return friction_roots(data, degrees)
    without, with_one = (balance(placed(data, mpf(x)), degrees) for x in (0, 1))
    slope = [one - zero for one, zero in zip(with_one, without, strict=True)]
    r = friction_radius(data)
    a, b, c = (
        one[0] * two[0] - r * r * (one[1] * two[1] + one[2] * two[2])
        for one, two in ((slope, slope), (slope, without), (without, without))
    )
    root = b * b - a * c
    if abs(root) <= NOISE_OF_SQUARES * (b * b + abs(a * c)):
        root = mpf(0)
    if abs(a) <= NOISE * slope[0] ** 2:
        values = {-c / (2 * b)} if b else set()
    elif root < 0:
        values = set()
    else:
        values = {(-b - mpmath.sqrt(root)) / a, (-b + mpmath.sqrt(root)) / a}
    return [(x, direction(data, x, degrees)) for x in sorted(values)]


def direction(data: Scenario, value: Any, degrees: Any) -> int:
    """Return the sign of the moment with a value of the unknown; zero where it vanishes."""
    moment, without = (balance(placed(data, x), degrees)[0] for x in (value, mpf(0)))
    if abs(moment) <= NOISE * (abs(without) + abs(moment - without)):
        return 0
    return int(mpmath.sign(moment))


def friction_roots(data: Scenario, degrees: Any) -> list[tuple[Any, int]]:
    """Return the root for the coefficient or the radius, found by bisection of the excess."""
    moment, across, up = balance(data, degrees)
    if abs(moment) <= NOISE * mpmath.hypot(across, up):
        return [(mpf(0), 0)]
    high = mpf(1)
    while excess(data, high, degrees) > 0:
        high *= 2
        if high > mpf(10) ** 60:
            return []
    low = mpf(0)
    for _ in range(400):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(data, middle, degrees) > 0 else (low, middle)
    return [(high, int(mpmath.sign(moment)))]


# --- over a turn: a dense scan in floats


class Scan(NamedTuple):
    """The roots of a direction at the angles of a scan, deg; nan where there is none."""

    degrees: Array
    values: Array  # (2, n)

    def best(self, sign: int) -> tuple[float, float] | None:
        """Return value and angle of the largest (1) or the smallest (-1)."""
        if np.all(np.isnan(self.values)):
            return None
        row, column = np.unravel_index(np.nanargmax(sign * self.values), self.values.shape)
        return float(self.values[row, column]), float(self.degrees[column])

    @property
    def missing(self) -> Array:
        return np.all(np.isnan(self.values), axis=0)


def coefficients(data: Scenario, degrees: Array) -> tuple[list[Array], list[Array]]:
    """Return the balance without the unknown and per unit of it: moment and components.

    They are of the first degree in cosine and sine of the angle, and follow from four angles.
    """
    matrices = []
    for value in (0, 1):
        of = placed(data, mpf(value))
        rows = [balance(of, quarter) for quarter in (0, 90, 180, 270)]
        matrices.append(np.array([[float(x) for x in row] for row in rows]))
    angle, sums = np.radians(degrees), []
    for values in (matrices[0], matrices[1] - matrices[0]):
        mean, c, s = values.mean(axis=0), (values[0] - values[2]) / 2, (values[1] - values[3]) / 2
        sums.append(
            [m + x * np.cos(angle) + y * np.sin(angle) for m, x, y in zip(mean, c, s, strict=True)]
        )
    return sums[0], sums[1]


def scans(data: Scenario) -> dict[int, Scan]:
    """Return the scan of each direction over the turn of a scenario."""
    middle = data["statics"]["angle_deg"]
    degrees = np.linspace(middle - 180.0, middle + 180.0, SCANNED)
    given, sought = coefficients(data, degrees)
    r = float(friction_radius(data))
    a = sought[0] ** 2 - r**2 * (sought[1] ** 2 + sought[2] ** 2)
    b = given[0] * sought[0] - r**2 * (given[1] * sought[1] + given[2] * sought[2])
    c = given[0] ** 2 - r**2 * (given[1] ** 2 + given[2] ** 2)
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - a * c)
        values = np.array([(-b - root) / a, (-b + root) / a])
        moments = given[0] + sought[0] * values
        some = values >= (-np.inf if may_be_negative(data) else 0.0)
    return {s: Scan(degrees, np.where(some & (s * moments > 0.0), values, np.nan)) for s in (1, -1)}


def may_be_negative(data: Scenario) -> bool:
    """Return whether the unknown may be below zero: a mass or its radius may not."""
    return data["statics"]["unknown"].partition(".")[0] in ("forces", "couples")


def drawn_turn(seed: int) -> Scenario:
    """Return a body with arms and friction of like size: roots end, cross, and have poles."""
    rng = Random(seed)

    def number(size: float) -> float:
        return rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 1.0) * size

    def force(name: str) -> Any:
        table = {"name": name, "size": number(10.0), "direction": [number(1.0), number(1.0)]}
        if rng.random() < 0.3:
            table["direction"] = rng.choice([[0.0, -1.0], [1.0, 0.0]])
        if rng.random() < 0.2:
            return table | {"cord_radius": number(1.0)}
        turns = {"point_turns": rng.random() < 0.7, "direction_turns": rng.random() < 0.4}
        return table | {"point": [number(1.0), number(1.0)]} | turns

    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1e3, "mass": rng.choice([0.0, rng.uniform(0.1, 3.0)])},
        "forces": [force(name) for name in ("one", "two", "three")[: rng.randint(1, 3)]],
        "couples": [{"name": "couple", "size": rng.choice([0.0, number(3.0)])}],
        "effects": {
            "gravity": {"g": 9.81},
            "eccentric_mass": {"mass": rng.uniform(0.1, 2.0), "radius": rng.uniform(0.1, 1.0),
                               "azimuth_deg": rng.uniform(-180.0, 180.0)},
            "shaft_friction": {"shaft_radius": rng.uniform(0.1, 0.9),
                               "mu_s": rng.choice([0.1, 0.5, 2.0]), "mu_k": 0.0},
        },
    }  # fmt: skip
    first = data["forces"][0]
    arm = "cord_radius" if "cord_radius" in first else "distance"
    unknown = rng.choice([*["forces.one.size"] * 4, f"forces.one.{arm}", "couples.couple.size",
                          "mechanism.mass", "effects.eccentric_mass.mass",
                          "effects.eccentric_mass.radius"])  # fmt: skip
    data["statics"] = {"unknown": unknown, "angle_deg": round(rng.uniform(-90.0, 90.0), 2)}
    return data


def drawn_place(seed: int) -> Scenario:
    """Return such a body, or one of its degenerate cases, at one angle, for one of many keys."""
    rng, data = Random(f"place {seed}"), drawn_turn(seed)
    effects, friction = data["effects"], ("shaft_radius", "mu_s")
    effects["shaft_friction"]["mu_s"] = rng.choice([0.0, 0.75, 1e-30, rng.uniform(0.0, 3.0)])
    effects["torsion_spring"] = {"stiffness": rng.uniform(0.1, 1.0), "free_angle_deg": 90.0}
    for force in data["forces"]:
        force["size"] *= rng.choice([0.0, 1.0, 1.0, 1.0, 1e20])
        force["direction"] = rng.choice([force["direction"], [0.0, -1.0], [1.0, 1.0]])
    arm = "cord_radius" if "cord_radius" in data["forces"][0] else "distance"
    keys = ["forces.one.size", "couples.couple.size", "mechanism.mass", "effects.gravity.g"]
    keys += [f"effects.eccentric_mass.{key}" for key in ("mass", "radius")]
    keys += [f"effects.torsion_spring.{key}" for key in ("stiffness", "free_angle_deg")]
    keys += [f"effects.shaft_friction.{key}" for key in friction]
    keys += [f"forces.one.{arm}"] if data["forces"][0]["size"] else []
    angle = rng.choice([0.0, 90.0, -90.0, 180.0, 45.0, 450.0, round(rng.uniform(-720, 720), 6)])
    data["statics"] = {"unknown": keys[seed % len(keys)], "angle_deg": angle}
    return data
