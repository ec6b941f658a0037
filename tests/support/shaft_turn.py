"""The extreme roots of eq 24 over a turn: a dense scan in floats, refined in many digits."""

from random import Random
from typing import Any, NamedTuple

import mpmath
import numpy as np
from mpmath import mpf
from numpy.typing import NDArray

from tests.support import shaft_balance
from tests.support.scenarios import Scenario

Array = NDArray[np.float64]
SCANNED = 40_001
# Beside a pole the scan is as large; what is smaller has a bound.
POLE = 1e5


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
        of = shaft_balance.placed(data, mpf(value))
        rows = [shaft_balance.balance(of, quarter) for quarter in (0, 90, 180, 270)]
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
    r = float(shaft_balance.friction_radius(data))
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


def refined(data: Scenario, direction: int, sign: int, value: float, degrees: float) -> Any:
    """Return the extreme root near one of the scan by a golden section in many digits."""

    def at(angle: Any) -> Any:
        roots = [x for x, s in shaft_balance.roots(data, angle) if s in (direction, 0)]
        near = [x for x in roots if x >= 0 or may_be_negative(data)]
        return min(near, key=lambda x: abs(x - value)) if near else None

    def height(angle: Any) -> Any:
        x = at(angle)
        return -mpmath.inf if x is None else sign * x

    width, golden = mpf(720) / SCANNED, (mpmath.sqrt(5) - 1) / 2
    low, high = mpf(degrees) - width, mpf(degrees) + width
    inner, outer = high - golden * (high - low), low + golden * (high - low)
    one, two = height(inner), height(outer)
    for _ in range(28):  # to 1e-7 of the width, and the value to the square of that
        if two > one:
            low, inner, one = inner, outer, two
            outer = low + golden * (high - low)
            two = height(outer)
        else:
            high, outer, two = outer, inner, one
            inner = high - golden * (high - low)
            one = height(inner)
    return at((low + high) / 2), (low + high) / 2


def drawn(seed: int) -> Scenario:
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
