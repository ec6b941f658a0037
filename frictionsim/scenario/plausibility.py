"""Questions about values of a valid scenario that look like a slip of a unit."""

from collections.abc import Iterator
from math import floor, log10
from typing import Any

from frictionsim.scenario.schema import Params

MAX_RADIUS = 5.0  # m; the largest winders and flywheels have about as much
MAX_MU = 2.0  # soft rubber on dry rough ground stays below it
MAX_G = 30.0  # m/s^2; on Jupiter it is 25
# kg, of a disc with the moment of inertia and the radius; a mill's drum has about as much.
MAX_DISC = 2e5
RADII = ("radius", "cord_radius")  # of the body itself


def questions(table: Params, path: str = "") -> Iterator[str]:
    """Yield a question for each value of a table, and of those in it, that is hardly meant."""
    values = table.__dict__
    for name, value in values.items():
        key = f"{path}{name}"
        if isinstance(value, Params):
            yield from questions(value, f"{key}.")
        elif isinstance(value, dict | tuple):
            for of, row in _rows(value):
                yield from questions(row, f"{key}.{of}.")
        elif not isinstance(value, float):
            continue
        elif name.endswith("radius") and abs(value) > MAX_RADIUS:
            yield (
                f"{key} = {value:g} m is a radius above {MAX_RADIUS:g} m; did you mean"
                f" {value / 1000.0:.6g}, for {value:g} mm?"
            )
        elif name in ("mu_s", "mu_k") and value > MAX_MU:
            yield (
                f"{key} = {value:g} is a coefficient of friction above {MAX_MU:g}; did you mean"
                f" {value / 10.0 ** (floor(log10(value)) + 1):.6g}?"
            )
        elif name == "g" and value > MAX_G:
            yield f"{key} = {value:g} m/s^2 is above {MAX_G:g} m/s^2; did you mean 9.81?"
        elif name == "inertia":
            radius = next((values[r] for r in RADII if r in values), 0.0)
            mass = 2.0 * value / radius**2 if 0.0 < radius <= MAX_RADIUS else 0.0
            if mass > MAX_DISC:
                yield (
                    f"{key} = {value:g} kg m^2 is that of a disc of {mass:.3g} kg with the radius"
                    f" {radius:g} m; did you mean another unit?"
                )


def _rows(values: Any) -> Iterator[tuple[Any, Params]]:
    """Yield the tables by name, or of a list, by the names that they have."""
    items = values.items() if isinstance(values, dict) else enumerate(values)
    for of, row in items:
        if isinstance(row, Params):
            yield getattr(row, "name", of), row
