"""What the drawings of a pulley without and with masses on its cord have in common."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.journal_friction import friction_radius
from frictionsim.motion.parts import Arrow, Body, Disc, Part
from frictionsim.scenario.recorded import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array
    from frictionsim.results import Record

SHAFT_SEEN = 0.06  # of the pulley's radius: a shaft that the scenario does not have is drawn so
# Of the pulley's radius: a smaller friction circle is a dot, and left out where none is enlarged.
CIRCLE_SEEN = 0.02
# In radii of the pulley.
HIGHEST = 1.6  # of what hangs on the cord, below the axis
BLOCK, ARROW = 0.9, 2.0  # side of what hangs on the cord; length of the largest force
ARC_OF_TORQUE = 0.62  # of the drive


def shaft_parts(
    result: "Record", radius: float, still: "Array", enlarged: bool = False
) -> list[Part]:
    """Return the shaft, true to scale if its friction is simulated, and its friction circles.

    Parameters
    ----------
    result : Record
    radius : float, m
        Of the pulley.
    still : (frames,)
        Zeros.
    enlarged : bool
        Whether the circles are also shown larger, so that none is too small to be seen.
    """
    friction = scenario_of(result).get("effects", {}).get("shaft_friction")
    if friction is None:
        return [Body("shaft", (Disc(0.0, 0.0, SHAFT_SEEN * radius, "fixed"),), still, still, still)]
    shaft = float(scenario_value(result, "effects", "shaft_friction", "shaft_radius"))
    found: list[Part] = [Body("shaft", (Disc(0.0, 0.0, shaft, "fixed"),), still, still, still)]
    for name, key in (("static friction circle", "mu_s"), ("kinetic friction circle", "mu_k")):
        mu = float(scenario_value(result, "effects", "shaft_friction", key))
        size = friction_radius(shaft, mu)
        if size > (0.0 if enlarged else CIRCLE_SEEN * radius):
            circle = Disc(0.0, 0.0, size, "friction" if key == "mu_k" else "paper", open=True)
            found.append(Body(name, (circle,), still, still, still))
    return found


def reaction_arrow(across: "Array", up: "Array", torque: "Array", scale: float) -> Arrow:
    """Return the reaction of the shaft on the pulley, on its line of action.

    With the reaction (F_x, F_y) its foot (e_x, e_y), at right angles to it, has the moment
    e_x F_y - e_y F_x = friction torque.

    Parameters
    ----------
    across, up : (frames,), N
        F_x and F_y.
    torque : (frames,), N m
    scale : float, m/N
    """
    square = np.maximum(across**2 + up**2, np.finfo(float).tiny)
    x, y = torque * up / square, -torque * across / square
    return Arrow("reaction of the shaft", x, y, scale * across, scale * up, "friction")
