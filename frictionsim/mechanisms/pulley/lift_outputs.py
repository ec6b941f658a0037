"""Channels, quantities, warnings and checks of a pulley with masses on its cord."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.journal_friction import CONTACT_NAME
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion_of_lift
from frictionsim.results import SLACK, STICK, Check, Quantities, Quantity, Transition
from frictionsim.scenario.signal_checks import extremes

if TYPE_CHECKING:
    from frictionsim.solvers.multi_contact import Contact, MultiContactTrajectory


TORQUE, CAR, OTHER = 0, 1, 2  # in `Balance.forces`: friction torque of the shaft, T1, T2
SLIP = 1  # coordinate of a cord that may slip, x - r theta
CORD, CAR_ROPE, COUNTERWEIGHT_ROPE = "cord", "car_rope", "counterweight_rope"
ROPES = {CAR_ROPE: "car", COUNTERWEIGHT_ROPE: "counterweight"}
# A tension at the located start of slack is below zero by the roundoff of the location.
TENSION_ROUNDOFF = 1e-12
Heights = Callable[[Any], tuple[Any, Any]]


def outputs(
    scenario: PulleyScenario, contacts: "tuple[Contact, ...]", heights: Heights
) -> dict[str, Any]:
    """Return the arguments of the mechanism that say what is recorded.

    Parameters
    ----------
    scenario : PulleyScenario
    contacts : tuple of Contact
    heights : callable
        The heights of car and counterweight, of the coordinates.
    """
    names = [contact.name for contact in contacts]
    n = scenario.lift_parameters
    weights = n.weight_1 + n.weight_2 + _largest_force(scenario)

    def channels(trajectory: "MultiContactTrajectory") -> dict[str, Any]:
        q, v, a = trajectory.position, trajectory.velocity, trajectory.acceleration
        forces, modes = trajectory.forces, dict(zip(names, trajectory.modes, strict=True))
        x1, x2 = heights(_from_start(q, scenario))
        v1, v2 = heights(v)
        found = {
            "angle": q[0],
            "angular_velocity": v[0],
            "angular_acceleration": a[0],
            "drive_torque" if n.by_torque else "drive_force": trajectory.drive,
            "shaft_reaction": forces[CAR] + forces[OTHER],
            "rope_tension_car": forces[CAR],
            "rope_tension_counterweight": forces[OTHER],
            "car_position": x1,
            "car_velocity": v1,
            "car_acceleration": heights(a)[0],
            "counterweight_position": x2,
            "counterweight_velocity": v2,
        }
        if CONTACT_NAME in modes:
            found |= {"friction_torque": forces[TORQUE], "mode": modes[CONTACT_NAME]}
        if CORD in modes:
            found |= {"cord_slip": q[SLIP], "cord_mode": modes[CORD]}
        else:
            ropes = [mode == SLACK for name, mode in modes.items() if name != CONTACT_NAME]
            found["slack"] = sum(side << i for i, side in enumerate(np.asarray(ropes, dtype=int)))
        return found

    def quantities(trajectory: "MultiContactTrajectory") -> Quantities:
        return impending_motion_of_lift(scenario) | _of_samples(
            trajectory, channels(trajectory), names
        )

    def checks(trajectory: "MultiContactTrajectory") -> dict[str, Check]:
        tensions = trajectory.forces[CAR:]
        lowest = float(np.min(tensions, initial=0.0))
        largest = max(weights, float(np.max(np.abs(tensions), initial=0.0)))
        return {"rope_tension": Check(-lowest / largest if lowest else 0.0, TENSION_ROUNDOFF)}

    def run_warnings(trajectory: "MultiContactTrajectory") -> list[str]:
        return _run_warnings(trajectory.transitions)

    torque = (
        max(map(abs, extremes(scenario.drive.torque, scenario.solver.duration)))
        if (n.by_torque)
        else 0.0
    )
    speed = scenario.mechanism.initial_angular_velocity
    inertia = n.inertia + (n.m1 + n.m2) * n.r**2
    return {
        "channels": channels,
        "quantities": quantities,
        "checks": checks,
        "run_warnings": run_warnings,
        "energy_scale": n.r * weights + torque + 0.5 * inertia * speed**2,
    }


def _largest_force(scenario: PulleyScenario) -> float:
    """Return the largest magnitude of the force on the cord, N."""
    force = scenario.drive.force
    if force is None:
        return 0.0
    return max(map(abs, extremes(force, scenario.solver.duration)))


def _from_start(q: Any, scenario: PulleyScenario) -> Any:
    """Return the coordinates, the angle from its start."""
    moved = np.array(q)
    moved[0] -= np.radians(scenario.mechanism.initial_angle_deg)
    return moved


def _of_samples(
    trajectory: "MultiContactTrajectory", channels: dict[str, Any], names: Sequence[str]
) -> Quantities:
    """Return the quantities of samples and events; none without a sample."""
    if not trajectory.time.size:
        return {}
    found = {}
    for name in ("rope_tension_car", "rope_tension_counterweight"):
        found[f"{name}_max"] = Quantity(float(np.max(channels[name])), "N")
        found[f"{name}_min"] = Quantity(float(np.min(channels[name])), "N")
    largest = float(np.max(np.abs(channels["car_acceleration"])))
    found["car_acceleration_max"] = Quantity(largest, "m/s^2")
    found["car_travel"] = Quantity(float(channels["car_position"][-1]), "m")
    if CORD in names:
        slip = float(np.max(np.abs(channels["cord_slip"])))
        found["cord_slip_max"] = Quantity(slip, "m")
        found["cord_slip_time"] = Quantity(
            _first(trajectory, lambda e: e.contact == CORD and e.mode_from == STICK), "s"
        )
    else:
        found["slack_time"] = Quantity(_first(trajectory, lambda e: e.mode_to == SLACK), "s")
    return found


def _first(
    trajectory: "MultiContactTrajectory", applies: Callable[[Transition], bool]
) -> float | None:
    """Return the time of the first event of a sort up to the last sample, s; None if none."""
    end = float(trajectory.time[-1])
    return next((e.time for e in trajectory.transitions if applies(e) and e.time <= end), None)


def _run_warnings(transitions: Sequence[Transition]) -> list[str]:
    """Return a warning for each rope that fell slack: the model has no elasticity."""
    found = []
    for contact, body in ROPES.items():
        slack = [
            e for e in transitions if e.contact == contact and e.mode_to == SLACK != e.mode_from
        ]
        if not slack:
            continue
        first = f"{slack[0].time:.6g} s"
        when = f"once, at {first}" if len(slack) == 1 else f"{len(slack)} times, first at {first}"
        found.append(
            f"the rope of the {body} falls slack {when}; where it is taken up, the impact is that"
            " of a rigid rope: its force has no value, and the energy lost depends on restitution"
        )
    return found
