"""The statics of a marble machine: its tooth forces, and the torques between which it rests.

At a transfer, n + 1 marbles are on the gear, the first and the last without a torque. Between
transfers there are n, with the largest torque half a pitch after a transfer. The scenario warns by
these torques: it is no type here.
"""

from math import cos, hypot, pi, radians, sin, sqrt
from typing import Any, NamedTuple

from frictionsim.mechanisms.effects import ROUNDING, radii_of
from frictionsim.results import Quantities, Quantity, StaticQuantities

GRAM_FORCE_CENTIMETRE = 9.80665e-5  # N m


class GearMesh(NamedTuple):
    """Components of the tooth force on the gear per torque of the pinion, 1/m: sideways, down."""

    c_z: float
    c_y: float


def mesh_of(geometry: Any) -> GearMesh:
    """Return the components of the tooth force per torque on the pinion."""
    alpha = radians(geometry.pressure_angle_deg)
    direction = radians(geometry.mesh_azimuth_deg) + 0.5 * pi + alpha
    force = 1.0 / (geometry.pinion_radius * cos(alpha))
    return GearMesh(force * cos(direction), -force * sin(direction))


class RestLimits(NamedTuple):
    """The limits of the pinion torque at rest, N m; `lift` is None if no torque lifts."""

    lift: float | None
    hold: float


def limits_at(scenario: Any, radius: float, moment: float, marbles: int) -> RestLimits:
    """Solve |k T - M| = r_f R_shaft(T) for the torque T of the pinion, eq 24.

    (k^2 - r_f^2 c^2) T^2 - 2 (k M + r_f^2 W c_y) T + M^2 - r_f^2 W^2 = 0,  c^2 = c_z^2 + c_y^2

    with the discriminant r_f^2 ((c M)^2 + 2 k M W c_y + (k W)^2 - (r_f W c_z)^2), which has no
    cancellation if the friction is small. Of a constant normal load N it is k T = M +- r_f N.

    Parameters
    ----------
    scenario : MarbleMachineScenario
    radius : float, m
        Friction radius r_f.
    moment : float, N m
        M of the marbles.
    marbles : int
        On the gear, whose weights are W.

    Returns
    -------
    RestLimits
        If `hold` is negative, friction alone holds the load.
    """
    geometry, journal = scenario.mechanism, scenario.effects.shaft_friction
    k = geometry.gear_ratio
    weight = (geometry.gear_mass + marbles * geometry.marble_mass) * scenario.effects.g
    c_z, c_y = mesh_of(geometry)
    if journal is not None and journal.normal_load is not None:
        weight, c_z, c_y = journal.normal_load, 0.0, 0.0
    # Products, not powers: those of extreme numbers are infinite, where powers raise an error.
    c_2 = c_z * c_z + c_y * c_y
    a = k * k - radius * radius * c_2
    if a <= 0.0:
        return RestLimits(None, 0.0)
    b = k * moment + radius * radius * weight * c_y
    lifted, sideways = k * weight, radius * weight * c_z
    inner = c_2 * moment * moment + 2.0 * k * moment * weight * c_y
    inner += lifted * lifted - sideways * sideways
    root = radius * sqrt(max(inner, 0.0))
    return RestLimits((b + root) / a, (b - root) / a)


def moments_of(geometry: Any, g: float) -> tuple[float, float]:
    """Return the moments of the marbles at a transfer and the largest, N m."""
    half, lift = 0.5 * geometry.pitch, geometry.marble_mass * g * geometry.marble_circle_radius
    return lift * cos(half) / sin(half), lift / sin(half)


def impending_motion_torques(scenario: Any) -> Quantities:
    """Return the torques to lift and to hold: at a transfer, as in the paper, and the largest."""
    geometry, motor = scenario.mechanism, scenario.drive.motor
    r_s, _ = radii_of(scenario.effects.shaft_friction)
    moment, largest = moments_of(geometry, scenario.effects.g)
    at_transfer = limits_at(scenario, r_s, moment, geometry.carried + 1)
    between = limits_at(scenario, r_s, largest, geometry.carried)
    worst = max(at_transfer, between, key=lambda limits: limits.lift or 0.0)
    held = max(at_transfer.hold, between.hold)
    quantities = {
        "torque_to_lift": Quantity(at_transfer.lift, "N m"),
        "torque_to_hold": Quantity(at_transfer.hold, "N m"),
        "torque_to_lift_worst": Quantity(worst.lift, "N m"),
        "torque_to_hold_worst": Quantity(held, "N m"),
        "self_locking": Quantity(float(held <= 0.0), "1"),
    }
    if at_transfer.lift is not None and worst.lift is not None:
        grams = at_transfer.lift / GRAM_FORCE_CENTIMETRE
        quantities["torque_to_lift_in_gf_cm"] = Quantity(grams, "gf cm")
        # A single marble has no torque at a transfer, except for rounding.
        if motor is not None and at_transfer.lift > ROUNDING * worst.lift:
            quantities["motor_margin"] = Quantity(motor.stall_torque / at_transfer.lift, "1")
        if motor is not None and worst.lift > 0.0:
            quantities["motor_margin_worst"] = Quantity(motor.stall_torque / worst.lift, "1")
    return quantities


def statics(scenario: Any) -> StaticQuantities:
    """Return the torques of impending motion on the pinion (eq 24) and their components."""
    geometry, g, n = scenario.mechanism, scenario.effects.g, scenario.mechanism.carried
    (c_z, c_y), (r_s, r_k) = mesh_of(geometry), radii_of(scenario.effects.shaft_friction)
    moment, largest = moments_of(geometry, g)
    quantities = StaticQuantities(impending_motion_torques(scenario))
    for where, at in (("", moment), ("_worst", largest)):
        lifting, lowering = limits_at(scenario, r_k, at, n)
        quantities[f"torque_to_keep_lifting{where}"] = Quantity(lifting, "N m")
        quantities[f"torque_to_keep_lowering{where}"] = Quantity(lowering, "N m")
    weight = (geometry.gear_mass + (n + 1) * geometry.marble_mass) * g
    for way in ("lift", "hold"):
        torque = quantities[f"torque_to_{way}"].value
        if torque is None:
            continue
        force, sideways = torque / geometry.pinion_radius, c_z * torque
        down = weight + c_y * torque
        for name, value in (
            ("tooth_force_tangential", force),
            ("tooth_force_radial", force * geometry.tooth_slope),
            ("shaft_force_sideways", sideways),
            ("shaft_force_down", down),
            ("shaft_reaction", hypot(sideways, down)),
        ):
            quantities[f"{name}_to_{way}"] = Quantity(value, "N")
    quantities.notes = (
        "torques to lift and to hold act on the pinion, load torques on the gear against its angle",
        f"torques to lift and to hold at a transfer are those of {n + 1} marbles,"
        f" torques to keep lifting and lowering those of the {n} of the motion",
    )
    quantities["load_torque_at_transfer"] = Quantity(moment, "N m")
    quantities["load_torque_worst"] = Quantity(largest, "N m")
    quantities["angle_of_the_worst"] = Quantity(0.5 * geometry.pitch, "rad")
    quantities["friction_radius_static"] = Quantity(r_s, "m")
    quantities["mesh_force_sideways_per_torque"] = Quantity(c_z, "1/m")
    quantities["mesh_force_down_per_torque"] = Quantity(c_y, "1/m")
    return quantities
