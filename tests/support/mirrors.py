"""Scenarios seen in a mirror, and what the mirror makes of the channels of a run."""

from collections.abc import Callable, Mapping
from math import pi
from typing import Any, NamedTuple

import numpy as np

from tests.support import belt_scenarios, shaft_scenarios
from tests.support.scenarios import Scenario, changed

TURNED = frozenset({"angle", "angular_velocity", "angular_acceleration", "friction_torque", "mode"})


class Mirror(NamedTuple):
    """A mirror of one model of mechanisms, by names of channels but for `even`."""

    scenario: Callable[[Scenario], Scenario]  # returns that in the mirror
    odd: frozenset[str]  # change their sign; all others keep it
    exchanged: Mapping[str, str] = {}  # stand for each other
    other: frozenset[str] = frozenset()  # are not left comparable, with the reason beside
    half_turn: frozenset[str] = frozenset()  # are angles from the x axis: phi becomes pi - phi
    even: frozenset[str] = frozenset()  # contacts whose modes have no direction

    def event(self, contact: str, *modes: int) -> tuple[str, *tuple[int, ...]]:
        """Return contact and modes of a transition as the run in the mirror should have them."""
        sign = 1 if contact in self.even else -1
        return self._both.get(contact, contact), *(sign * mode for mode in modes)

    @property
    def _both(self) -> dict[str, str]:
        return {**self.exchanged, **{there: here for here, there in self.exchanged.items()}}

    def image(self, channels: Mapping[str, Any]) -> dict[str, Any]:
        """Return the channels of a run as the run in the mirror should have them."""
        both, image = self._both, {}
        for name, values in channels.items():
            if name in self.half_turn:
                image[name] = pi - values
            elif name not in self.other:
                sign = -1.0 if name in self.odd else 1.0
                image[both.get(name, name)] = sign * np.asarray(values, dtype=float)
        return image


def _shaft(data: Scenario) -> Scenario:
    """Return a body on a shaft, x to -x."""
    data = changed(data)
    if "torsion_spring" in data["effects"]:
        data["effects"]["torsion_spring"].setdefault("free_angle_deg", 0.0)
    data.setdefault("couples", [])
    data = shaft_scenarios.mirrored(data)
    stops = data["effects"].get("end_stops")
    if stops:
        lowest, highest = stops.pop("lowest_angle_deg", None), stops.pop("highest_angle_deg", None)
        if lowest is not None:
            stops["highest_angle_deg"] = -lowest
        if highest is not None:
            stops["lowest_angle_deg"] = -highest
    return data


def _pulley(data: Scenario) -> Scenario:
    """Return a pulley whose cord is pulled by its load, and carries its force."""
    force, load = data["drive"]["force"], data["mechanism"]["load"]
    return changed(data, mechanism__load=force, drive__force=load)


def _lift(data: Scenario) -> Scenario:
    """Return a lift with the car on the other side."""
    masses, torque = data["effects"]["hanging_masses"], data["drive"]["torque"]
    for table in [torque, torque.get("sine", {}), torque.get("smooth_step", {})]:
        for key in {"value", "mean", "amplitude", "from", "to"} & table.keys():
            table[key] = (-np.asarray(table[key])).tolist()
    return changed(
        data,
        effects__hanging_masses__car=masses["counterweight"],
        effects__hanging_masses__counterweight=masses["car"],
    )


def _gear(data: Scenario) -> Scenario:
    """Return a gear with its crank at pi - phi, x to -x, without its tracer point."""
    torque = data["drive"]["torque"]
    return changed(
        data,
        mechanism__initial_angle_deg=180.0 - data["mechanism"].get("initial_angle_deg", 0.0),
        mechanism__initial_angular_velocity=-data["mechanism"].get("initial_angular_velocity", 0.0),
        effects__tracer_point=None,
        drive__torque={**torque, "value": [-value for value in torque["value"]]},
    )


def _machine(data: Scenario) -> Scenario:
    """Return a machine without gravity, driven the other way."""
    return changed(data, drive={"torque": -data["drive"]["torque"]})


OF_SHAFT = Mirror(_shaft, TURNED | {"applied_torque", "reaction_x", "stop_torque"})
# The work of the one cord is input, that of the other potential energy.
OF_PULLEY = Mirror(
    _pulley, TURNED, other=frozenset({"drive_force", "energy_input", "energy_potential"})
)
OF_LIFT = Mirror(
    _lift,
    TURNED | {"drive_torque", "cord_slip", "cord_mode"},
    {name: name.replace("car", "counterweight") for name in
     ("rope_tension_car", "car_position", "car_velocity", "car_rope")},
    # There is no acceleration of the counterweight, and `slack` is a number for each side.
    other=frozenset({"car_acceleration", "slack"}),
    even=frozenset({"car_rope", "counterweight_rope"}),
)  # fmt: skip
OF_GEAR = Mirror(
    _gear,
    TURNED | {"drive_torque", "planet_velocity"},
    # Without its tracer point; the uniform torque is that of a motion in the positive sense.
    other=frozenset({"tracer_x", "tracer_y", "uniform_torque"}),
    half_turn=frozenset({"angle"}),
)
TEETH = {"tooth_force_tangential", "tooth_force_radial"}
OF_MACHINE = Mirror(_machine, TURNED | {"motor_torque", "load_torque"} | TEETH)
# The direction of the loop, the signs of n and t, sides and torques are all turned over.
OF_BELT = Mirror(
    belt_scenarios.mirrored,
    frozenset(
        {"x", "pulley_angle", "pulley_speed", "pulley_torque", "friction_force", "slip_velocity"}
    ),
    other=frozenset({"angle"}),  # of a body, from its own x axis: which is turned over as well
)
