"""The end stops of a body on a shaft: their torque at rest on them, and their quantities."""

from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.shaft.equation import Terms, first_excess_of
from frictionsim.results import Quantities, Quantity
from frictionsim.solvers.end_stops import EVENT
from frictionsim.solvers.mechanism import EndStops, Trajectory, Value

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.loads import Size
    from frictionsim.mechanisms.shaft.schema import ShaftScenario

# A run with more impacts has a capture speed that is far below the speeds of its motion.
MANY_IMPACTS = 1000


def stops_of(scenario: "ShaftScenario", terms: Terms) -> EndStops | None:
    """Return the end stops of a scenario; None without."""
    given = scenario.effects.end_stops
    if given is None:
        return None
    lowest, highest = given.lowest, given.highest

    def away(angle: float) -> tuple[int, ...]:
        return (-1,) if angle >= highest else (1,)

    return EndStops(
        lowest=lowest,
        highest=highest,
        restitution=given.restitution,
        capture_speed=given.capture_speed,
        first_departure=first_excess_of(scenario, terms, 0.0, away),
    )


def with_stops(applied_torque: "Size", stops: EndStops | None) -> "Size":
    """Return a torque with that of the stops at rest on them; the same torque without stops."""
    if stops is None:
        return applied_torque

    def with_torque_of_stops(time: Value, angle: Value, velocity: Value) -> Value:
        torque = applied_torque(time, angle, velocity)
        return torque + stops.torque(torque, angle, velocity)

    return with_torque_of_stops


def impact_quantities(trajectory: Trajectory) -> Quantities:
    """Return the number of impacts and the largest speed of one; None if there was none."""
    speeds = impact_speeds(trajectory)
    largest = float(speeds.max()) if speeds.size else None
    return {
        "impacts": Quantity(float(speeds.size), "1"),
        "impact_speed_max": Quantity(largest, "rad/s"),
    }


def impact_speeds(trajectory: Trajectory) -> Any:
    """Return the speeds of the body immediately before its impacts, (m,), rad/s.

    Events after the last sample, which a failed run may have, are ignored.
    """
    import numpy as np  # imported here because `check` does not need it

    if trajectory.velocity_before is None:
        return np.empty(0)
    end = trajectory.time[-1] if trajectory.time.size else -np.inf
    hits = [
        event.contact == EVENT and event.time <= end and speed != 0.0
        for event, speed in zip(trajectory.transitions, trajectory.velocity_before, strict=True)
    ]
    return np.abs(trajectory.velocity_before[np.array(hits, dtype=bool)])


def many_impacts(trajectory: Trajectory) -> list[str]:
    """Warn if the body bounces so often that the capture speed seems far too low."""
    count = impact_speeds(trajectory).size
    if count < MANY_IMPACTS:
        return []
    return [
        f"{count} impacts on the end stops: the last ones are of no account; give a larger"
        " effects.end_stops.capture_speed"
    ]
