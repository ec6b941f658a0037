"""What the picture of a friction circle shows at its instant, and how it is named."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import CONTACT_WORDS, with_minus
from frictionsim.mechanisms.shaft.free_body import (
    AppliedCouple,
    FreeBody,
    channels_needed,
    free_body,
)
from frictionsim.motion.shaft import reaction_foot, scenario_in
from frictionsim.plots.style import require_channels

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import ShaftScenario
    from frictionsim.results import Record

    Pair = tuple[float, float]

STOP = "end stop"
MILLIMETRES = 0.1  # m: shorter lengths are written in mm


class Resultant(NamedTuple):
    """A force on its line of action.

    Attributes
    ----------
    across, up : float, N
    foot : (float, float), m
        Of the perpendicular from the axis.
    torque : float, N m
        Its moment about the axis.
    vanishes : bool
        Whether it is rounding.
    """

    across: float
    up: float
    foot: "Pair"
    torque: float
    vanishes: bool

    @property
    def size(self) -> float:
        """Its size, N."""
        return float(np.hypot(self.across, self.up))

    @property
    def arm(self) -> float:
        """Its distance from the axis, m."""
        return float(np.hypot(*self.foot))

    @property
    def direction(self) -> "Pair":
        """Its unit vector."""
        size = self.size or 1.0
        return self.across / size, self.up / size


class Instant(NamedTuple):
    """A body on a shaft at one instant.

    Attributes
    ----------
    scenario : ShaftScenario
    time : float, s
    angle : (1,), rad
    found : FreeBody
    couples : tuple of AppliedCouple
        With that of an end stop.
    reaction, resultant : Resultant
        The force of the shaft on the body; all applied forces and couples together.
    state : str
        What the contact does; empty if it is not known.
    """

    scenario: "ShaftScenario"
    time: float
    angle: Any
    found: FreeBody
    couples: tuple[AppliedCouple, ...]
    reaction: Resultant
    resultant: Resultant
    state: str


def instant_of(result: "Record", view: str) -> Instant:
    """Return the forces on the body at the last sample."""
    scenario = scenario_in(result)
    needed = channels_needed(scenario)
    require_channels(result, view, needed)

    def last(name: str) -> Any:
        known = name in result.channels
        return np.array([float(result.channels[name][-1]) if known else 0.0])

    rates = [last(name) for name in ("angular_velocity", "angular_acceleration")]
    time, angle = last("time"), last("angle")
    found = free_body(scenario, (time, angle, rates[0], rates[1]))
    stop = last("stop_torque")
    couples = found.couples
    if stop[0]:
        couples = (*couples, AppliedCouple(STOP, stop))
    reaction = _on_its_line(
        found, found.reaction_across, found.reaction_up, last("friction_torque")
    )
    resultant = _on_its_line(found, found.across, found.up, found.moment + stop)
    mode = int(result.channels["mode"][-1]) if "mode" in result.channels else None
    state = "" if mode is None else CONTACT_WORDS.get(mode, "")
    return Instant(scenario, float(time[0]), angle, found, couples, reaction, resultant, state)


def _on_its_line(found: FreeBody, across: Any, up: Any, torque: Any) -> Resultant:
    vanishes = found.vanishes(np.hypot(across, up))
    x, y = reaction_foot(across, up, torque, vanishes)
    foot = float(x[0]), float(y[0])
    return Resultant(float(across[0]), float(up[0]), foot, float(torque[0]), bool(vanishes[0]))


def number(value: float, unit: str) -> str:
    """Return a number with its unit, as "12.5 N"."""
    return f"{with_minus(f'{value:.4g}')} {unit}"


def length(value: float) -> str:
    """Return a length in mm or m."""
    return number(1e3 * value, "mm") if value < MILLIMETRES else number(value, "m")


def words_of_resultant(now: Instant, reach: float) -> str:
    """Return the name of the resultant with its size and place, for the key."""
    resultant = now.resultant
    if resultant.vanishes:
        return f"resultant: none, but a couple of {number(resultant.torque, 'N m')}"
    size = number(resultant.size, "N")
    if resultant.arm > reach:
        return f"resultant, {size}, with a couple of {number(resultant.torque, 'N m')}"
    return f"resultant, {size} at {length(resultant.arm)}"


def words_of_reaction(now: Instant) -> str:
    """Return the name of the reaction with its size and lever arm, for the key."""
    reaction = now.reaction
    if reaction.vanishes:
        return "reaction of the shaft: none"
    return f"reaction of the shaft, {number(reaction.size, 'N')} at c = {length(reaction.arm)}"


def notes_of(now: Instant) -> list[str]:
    """Return sentences on what is special."""
    state = f"at {now.time:.6g} s" + (f": {now.state}" if now.state else "")
    found = [state]
    if now.scenario.effects.shaft_friction is None:
        found.append("no dry friction: the reaction goes through the axis")
    elif now.reaction.vanishes:
        found.append("no reaction: the shaft has no friction at this instant")
    return found
