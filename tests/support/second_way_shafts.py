"""Independent evaluation of the pulley and of the marble machine, see `second_way`."""

from math import cos, hypot, pi, radians, sin, tan
from typing import Any

import numpy as np

from tests.support.second_way import (
    ROUNDING,
    Array,
    Recorded,
    Seen,
    Table,
    closed,
    friction_radius,
    integral,
    least,
    of_any_motion,
    of_stick_and_slip,
    root,
    signal,
)

GRAM_FORCE = 9.80665e-3  # N: a gram times the standard gravity
STORED = 1e-10  # relative to the energy of all marbles: accumulated roundoff


def shaft_of(scenario: Table) -> tuple[float, float]:
    """Return the friction radii at rest and sliding, m; zero without friction."""
    journal = scenario["effects"].get("shaft_friction")
    if journal is None:
        return 0.0, 0.0
    radius = journal["shaft_radius"]
    return friction_radius(radius, journal["mu_s"]), friction_radius(radius, journal["mu_k"])


def pressing(scenario: Table, reaction: Any) -> Any:
    """Return what presses journal and shaft together, N: the reaction, or a constant load."""
    load = scenario["effects"].get("shaft_friction", {}).get("normal_load")
    return reaction if load is None else 0.0 * reaction + load


# --- pulley ---------------------------------------------------------------------------------------


def forces(scenario: Table, radius: float, direction: str) -> tuple[Seen, Seen]:
    """Return the smallest forces to lift and to hold, from |(P - W) r_e| = r R by bisection."""
    arm, load = scenario["mechanism"]["cord_radius"], scenario["mechanism"]["load"]

    def reaction(force: float) -> float:
        both = force + load if direction == "vertical" else hypot(force, load)
        return float(pressing(scenario, both))

    def surplus_to_lift(force: float) -> float:
        return (force - load) * arm - radius * reaction(force)

    def surplus_to_hold(force: float) -> float:
        return radius * reaction(force) - (load - force) * arm

    size = max(load, 1.0)
    lift = root(surplus_to_lift, load, size)
    hold = 0.0 if surplus_to_hold(0.0) >= 0.0 else root(surplus_to_hold, 0.0, load)
    # The error of the root is the rounding of two products over the slope of their difference.
    rounding = ROUNDING * (arm + radius) / abs(arm - radius)
    if pressing(scenario, 0.0):
        rounding, size = ROUNDING, size + radius * reaction(load) / arm
    return Seen(lift, rounding * max(size, lift or 0.0)), Seen(hold, rounding * size)


def pulley_statics(scenario: Table) -> dict[str, Seen]:
    r_s, r_k = shaft_of(scenario)
    own = scenario["drive"]["direction"]
    seen = {"friction_radius_static": closed(r_s), "friction_radius_kinetic": closed(r_k)}
    seen["force_to_keep_lifting"], seen["force_to_keep_lowering"] = forces(scenario, r_k, own)
    for direction, ending in ((own, ""), ("vertical", "_vertical"), ("horizontal", "_horizontal")):
        lift, hold = forces(scenario, r_s, direction)
        seen["force_to_lift" + ending], seen["force_to_hold" + ending] = lift, hold
    return seen


def pulley(record: Recorded) -> dict[str, Seen]:
    scenario, time, velocity = record.scenario, record.time, record.channels["angular_velocity"]
    geometry, effects = scenario["mechanism"], scenario["effects"]
    arm, load = geometry["cord_radius"], geometry["load"]
    force = signal(scenario["drive"]["force"], time)
    r_s, r_k = shaft_of(scenario)
    seen = of_any_motion(record)
    lift, hold = forces(scenario, r_s, scenario["drive"]["direction"])
    seen["force_to_lift"], seen["force_to_hold"] = lift, hold
    seen["energy_input"] = integral(time, force * arm * velocity)
    seen["energy_kinetic"] = closed(0.5 * geometry["inertia"] * float(velocity[-1]) ** 2)
    seen["energy_potential"] = closed(load * arm * float(record.channels["angle"][-1]))
    if "viscous_damping" in effects:
        seen["energy_damping"] = integral(
            time, effects["viscous_damping"]["coefficient"] * velocity**2
        )
    if "shaft_friction" in effects:
        seen |= of_stick_and_slip(record)
        vertical = scenario["drive"]["direction"] == "vertical"
        reaction = np.abs(force + load) if vertical else np.hypot(force, load)
        load_of_friction = pressing(scenario, reaction)
        seen["energy_friction"] = integral(time, r_k * load_of_friction * np.abs(velocity))
    return seen


def first_breakaway(record: Recorded) -> Seen:
    """Return the time of the first breakaway of a pulley that starts at rest.

    Of the scenario alone: looked for in ten thousand parts of the run, then by bisection.
    """
    scenario = record.scenario
    arm, load = scenario["mechanism"]["cord_radius"], scenario["mechanism"]["load"]
    vertical, r_s = scenario["drive"]["direction"] == "vertical", shaft_of(scenario)[0]

    def surplus(time: Array) -> Array:
        force = signal(scenario["drive"]["force"], time)
        reaction = np.abs(force + load) if vertical else np.hypot(force, load)
        return np.abs(force - load) * arm - r_s * pressing(scenario, reaction)

    duration = scenario["solver"]["duration"]
    time = np.linspace(0.0, duration, 10_001)
    over = np.flatnonzero(surplus(time) > 0.0)
    if not over.size:
        return Seen(None)
    high = float(time[over[0]])
    low = float(time[max(over[0] - 1, 0)])
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (low, middle) if surplus(np.array([middle]))[0] > 0.0 else (middle, high)
    return Seen(high, ROUNDING * duration)


# --- marble machine -------------------------------------------------------------------------------


class Machine:
    def __init__(self, scenario: Table) -> None:
        geometry, effects = scenario["mechanism"], scenario["effects"]
        self.scenario = scenario
        self.ratio, self.pitch = geometry["gear_ratio"], 2.0 * pi / geometry["slots"]
        self.mass, self.circle = geometry["marble_mass"], geometry["marble_circle_radius"]
        self.on_rise = geometry["slots"] // 2
        self.gear_mass = geometry["gear_mass"]
        self.g = effects.get("gravity", {"g": 0.0})["g"]
        self.motor_inertia = effects.get("motor_inertia", {"inertia": 0.0})["inertia"]
        # The tooth force on the gear has a tangential part and a radial part to its centre.
        azimuth, angle = radians(geometry["mesh_azimuth_deg"]), geometry["pressure_angle_deg"]
        tangential = 1.0 / geometry["pinion_radius"]
        radial = tangential * tan(radians(angle))
        self.sideways = -tangential * sin(azimuth) - radial * cos(azimuth)
        self.up = tangential * cos(azimuth) - radial * sin(azimuth)
        self.inertia = (
            geometry["gear_inertia"]
            + self.on_rise * self.mass * self.circle**2
            + self.ratio**2 * self.motor_inertia
        )

    def positions(self, delta: float) -> list[float]:
        """Return the angles of the marbles from the bottom, rad; both of a transfer."""
        count = self.on_rise + (delta in (0.0, self.pitch))
        first = delta if delta < self.pitch else 0.0
        return [first + j * self.pitch for j in range(count)]

    def load_torque(self, delta: float) -> float:
        arms = (self.circle * sin(position) for position in self.positions(delta))
        return sum(self.mass * self.g * arm for arm in arms)

    def weight(self, delta: float) -> float:
        return (self.gear_mass + self.mass * len(self.positions(delta))) * self.g

    def height(self, delta: float) -> float:
        """Return the sum of the heights of the rising marbles, m."""
        rise = range(self.on_rise)
        return sum(self.circle * (1.0 - cos(delta + j * self.pitch)) for j in rise)

    def reaction(self, torque: Array, weight: float) -> Array:
        return np.hypot(self.sideways * torque, weight - self.up * torque)

    def torques(
        self, radius: float, delta: float, weight: float | None = None
    ) -> tuple[float | None, float]:
        """Return the pinion torques to lift and to hold in a position, by bisection, N m.

        Of gear and marbles of a weight, N, other than that of a transfer.
        """
        k, torque = self.ratio, self.load_torque(delta)
        weight = self.weight(delta) if weight is None else weight
        size = (torque + radius * pressing(self.scenario, weight)) / k or 1.0

        def friction(torque: float) -> float:
            reaction = hypot(self.sideways * torque, weight - self.up * torque)
            return float(radius * pressing(self.scenario, reaction))

        lift = root(lambda t: k * t - torque - friction(t), torque / k, size)
        # The smallest holding torque does not exceed that without friction; it may be negative.
        hold = root(lambda t: torque + k * t - friction(-t), -torque / k, size)
        return lift, 0.0 if hold is None else -hold

    def rounding(self, radius: float) -> float:
        """Return the relative rounding of a root: of products, over the slope of the difference."""
        teeth = 0.0
        if not pressing(self.scenario, 0.0):
            teeth = radius * hypot(self.sideways, self.up)
        return ROUNDING * (self.ratio + teeth) / (self.ratio - teeth)


def machine_at_rest(scenario: Table) -> dict[str, Seen]:
    """Return the quantities of the summary that depend on the scenario only."""
    machine, (r_s, _) = Machine(scenario), shaft_of(scenario)
    inside = 1e-9 * machine.pitch
    lift, hold = machine.torques(r_s, 0.0)

    def between(index: int) -> float:
        return -least(
            lambda delta: -(machine.torques(r_s, delta)[index] or 0.0),
            inside,
            machine.pitch - inside,
        )

    worst_lift, worst_hold = max(lift or 0.0, between(0)), max(hold, between(1))
    rounding = machine.rounding(r_s) * worst_lift

    def seen(value: float | None) -> Seen:
        return Seen(value, rounding)

    deltas = np.linspace(inside, machine.pitch - inside, 2001)
    places = (0.0, *map(float, deltas))
    surplus = [machine.load_torque(d) - r_s * pressing(scenario, machine.weight(d)) for d in places]
    quantities = {
        "torque_to_lift": seen(lift),
        "torque_to_hold": seen(hold),
        "torque_to_lift_worst": seen(worst_lift),
        "torque_to_hold_worst": seen(worst_hold),
        # Without a torque, the load nowhere exceeds the static limit.
        "self_locking": Seen(float(max(surplus) <= 0.0)),
        "torque_to_lift_in_gf_cm": Seen(
            lift / (GRAM_FORCE * 0.01) if lift is not None else None, rounding / (GRAM_FORCE * 0.01)
        ),
    }
    motor = scenario["drive"].get("motor")
    # A single marble has no torque at a transfer, except for rounding.
    if motor is not None and lift is not None and lift > rounding:
        quantities["motor_margin"] = _ratio(motor["stall_torque"], quantities["torque_to_lift"])
    if motor is not None and worst_lift > 0.0:
        worst = quantities["torque_to_lift_worst"]
        quantities["motor_margin_worst"] = _ratio(motor["stall_torque"], worst)
    return quantities


def _ratio(over: float, under: Seen) -> Seen:
    assert under.value is not None
    return Seen(over / under.value, over / under.value**2 * under.uncertainty)


def machine_statics(scenario: Table) -> dict[str, Seen]:
    machine, (_, r_k) = Machine(scenario), shaft_of(scenario)
    inside, half = 1e-9 * machine.pitch, 0.5 * machine.pitch
    worst = -least(lambda delta: -machine.load_torque(delta), inside, machine.pitch - inside)
    at_rest = machine_at_rest(scenario)
    weight, seen = machine.weight(half), dict[str, Seen]()
    for delta, ending in ((0.0, ""), (half, "_worst")):
        for way, torque in zip(
            ("lifting", "lowering"), machine.torques(r_k, delta, weight), strict=True
        ):
            size = machine.torques(r_k, half, weight)[0] or 0.0
            seen[f"torque_to_keep_{way}{ending}"] = Seen(torque, machine.rounding(r_k) * size)
    for way in ("lift", "hold"):
        torque, rounding = at_rest[f"torque_to_{way}"]
        if torque is None:
            continue
        teeth = scenario["mechanism"]["pinion_radius"]
        slope = tan(radians(scenario["mechanism"]["pressure_angle_deg"]))
        up = machine.up * torque - machine.weight(0.0)
        for name, force in (
            ("tooth_force_tangential", torque / teeth),
            ("tooth_force_radial", slope * torque / teeth),
            ("shaft_force_sideways", machine.sideways * torque),
            ("shaft_force_down", -up),
            ("shaft_reaction", hypot(machine.sideways * torque, up)),
        ):
            seen[f"{name}_to_{way}"] = Seen(force, 2.0 * rounding / teeth + ROUNDING * abs(up))
    return (
        at_rest
        | seen
        | {
            "load_torque_at_transfer": Seen(machine.load_torque(0.0), ROUNDING * worst),
            "load_torque_worst": closed(worst),
            "angle_of_the_worst": closed(half),
            "friction_radius_static": closed(shaft_of(scenario)[0]),
            "mesh_force_sideways_per_torque": Seen(
                machine.sideways, ROUNDING * hypot(machine.sideways, machine.up)
            ),
            "mesh_force_down_per_torque": Seen(
                -machine.up, ROUNDING * hypot(machine.sideways, machine.up)
            ),
        }
    )


def marble_machine(record: Recorded) -> dict[str, Seen]:
    scenario, time, velocity = record.scenario, record.time, record.channels["angular_velocity"]
    machine, effects, drive = Machine(scenario), scenario["effects"], scenario["drive"]
    if "motor" in drive:
        slowing = machine.ratio * velocity / drive["motor"]["no_load_speed"]
        torque = drive["motor"]["stall_torque"] * (1.0 - slowing)
    else:
        torque = signal(drive["torque"], time)
    seen = of_any_motion(record) | machine_at_rest(scenario)
    work = integral(time, torque * machine.ratio * velocity)
    duration = scenario["solver"]["duration"]
    assert work.value is not None
    seen["energy_input"] = work
    seen["motor_power_mean"] = Seen(work.value / duration, work.uncertainty / duration)
    peak = float(np.max(np.abs(torque)))
    seen["motor_torque_peak"] = Seen(peak, ROUNDING * peak)
    seen["marbles_delivered"] = Seen(_delivered(record, machine.pitch))
    seen["energy_kinetic"] = closed(0.5 * machine.inertia * float(velocity[-1]) ** 2)
    if "gravity" in effects:
        seen["energy_potential"] = _lifted(record, machine)
    if "viscous_damping" in effects:
        seen["energy_damping"] = integral(
            time, effects["viscous_damping"]["coefficient"] * velocity**2
        )
    if "shaft_friction" in effects:
        seen |= of_stick_and_slip(record)
        inert = machine.motor_inertia * machine.ratio * record.channels["angular_acceleration"]
        weight = (machine.gear_mass + machine.on_rise * machine.mass) * machine.g
        reaction = machine.reaction(torque - inert, weight)
        r_k = shaft_of(scenario)[1]
        load = pressing(scenario, reaction)
        seen["energy_friction"] = integral(time, r_k * load * np.abs(velocity))
    return seen


def _delivered(record: Recorded, pitch: float) -> float:
    """Count the marbles delivered: the positions of transfers above the start."""
    furthest = float(np.max(record.channels["angle"]))
    furthest = max([furthest, *(e.angle for e in record.events if e.contact == "transfer")])
    count, angle = 0, float(record.channels["angle"][0])
    position = pitch * np.floor(angle / pitch)
    # A transfer is located to rounding of the angle.
    while (position := position + pitch) <= furthest + 1e-12 * max(1.0, abs(furthest)):
        count += 1
    return float(count)


def _lifted(record: Recorded, machine: Machine) -> Seen:
    """Return the potential energy of all marbles; delivered ones are two radii up."""
    angle = float(record.channels["angle"][-1])
    gone = float(np.floor(angle / machine.pitch))
    heights = 2.0 * machine.circle * gone + machine.height(angle - gone * machine.pitch)
    lifted = machine.mass * machine.g * (heights - machine.height(0.0))
    size = machine.mass * machine.g * machine.circle * (machine.on_rise + abs(gone))
    return Seen(lifted, STORED * size)
