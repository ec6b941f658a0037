"""The statics of a marble machine: its tooth forces, and the torques between which it rests."""

from collections.abc import Callable
from math import cos as cosine
from math import hypot, pi, radians, sqrt
from math import sin as sine
from typing import NamedTuple

from frictionsim.mechanisms.effects import ROUNDING
from frictionsim.mechanisms.marble_machine.tables import (
    MarbleMachineEffects,
    MarbleMachineParameters,
    MotorTable,
)
from frictionsim.results import Quantities, Quantity, StaticQuantities

GRAM_FORCE_CENTIMETRE = 9.80665e-5  # N m


class GearMesh(NamedTuple):
    """Components of the tooth force on the gear per torque of the pinion, 1/m: sideways, down."""

    c_z: float
    c_y: float


def mesh_of(geometry: MarbleMachineParameters) -> GearMesh:
    """Return the components of the tooth force per torque on the pinion."""
    alpha = radians(geometry.pressure_angle_deg)
    direction = radians(geometry.mesh_azimuth_deg) + 0.5 * pi + alpha
    force = 1.0 / (geometry.pinion_radius * cosine(alpha))
    return GearMesh(force * cosine(direction), -force * sine(direction))


class RestLimits(NamedTuple):
    """The limits of the pinion torque at rest, N m; `lift` is None if no torque lifts."""

    lift: float | None
    hold: float


def limit_torques(
    k: float, radius: float, mesh: GearMesh, applied_torque: float, weight: float
) -> RestLimits:
    """Solve |k T_p - M| = r_f R_shaft(T_p) for T_p, eq 24.

    (k^2 - r_f^2 c^2) T^2 - 2 (k M + r_f^2 W c_y) T + M^2 - r_f^2 W^2 = 0,  c^2 = c_z^2 + c_y^2

    with the discriminant r_f^2 ((c M)^2 + 2 k M W c_y + (k W)^2 - (r_f W c_z)^2), which has no
    cancellation if the friction is small. `shaft.balance.roots_of` solves eq 24 for any loads; its
    roots differ in the last digits.

    Parameters
    ----------
    k : float
        Gear ratio.
    radius : float, m
        Friction radius.
    mesh : GearMesh
    applied_torque : float, N m
        M_L.
    weight : float, N

    Returns
    -------
    RestLimits
        If `hold` is negative, friction alone holds the load.
    """
    # Products, not powers: those of extreme numbers are infinite, where powers raise an error.
    c_2 = mesh.c_z * mesh.c_z + mesh.c_y * mesh.c_y
    a = k * k - radius * radius * c_2
    if a <= 0.0:
        return RestLimits(None, 0.0)
    b = k * applied_torque + radius * radius * weight * mesh.c_y
    inner = c_2 * applied_torque * applied_torque
    inner += 2.0 * k * applied_torque * weight * mesh.c_y
    lifted, sideways = k * weight, radius * weight * mesh.c_z
    inner += lifted * lifted - sideways * sideways
    root = radius * sqrt(max(inner, 0.0))
    return RestLimits((b + root) / a, (b - root) / a)


def limits_at(
    geometry: MarbleMachineParameters, effects: MarbleMachineEffects, friction_radius: float
) -> Callable[[float, int], RestLimits]:
    """Return the limits as a function of the moment of the marbles, N m, and of their number.

    A constant normal load N takes the place of the reaction: k T_p = M +- r_f N.
    """
    journal, mesh = effects.shaft_friction, mesh_of(geometry)
    g = effects.gravity.g if effects.gravity else 0.0

    def limits(moment: float, marbles: int) -> RestLimits:
        weight = (geometry.gear_mass + marbles * geometry.marble_mass) * g
        return limit_torques(geometry.gear_ratio, friction_radius, mesh, moment, weight)

    if journal is None or journal.normal_load is None:
        return limits
    load = journal.normal_load
    return lambda moment, marbles: limit_torques(
        geometry.gear_ratio, friction_radius, GearMesh(0.0, 0.0), moment, load
    )


def impending_motion_torques(
    geometry: MarbleMachineParameters, effects: MarbleMachineEffects, motor: MotorTable | None
) -> Quantities:
    """Return the torques to lift and to hold: at a transfer, as in the paper, and the largest.

    At a transfer, n + 1 marbles are on the gear, the first and the last without a torque. Between
    transfers there are n, with the largest torque half a pitch after a transfer.
    """
    journal = effects.shaft_friction
    radius = journal.static_radius if journal else 0.0
    g = effects.gravity.g if effects.gravity else 0.0
    half, limits = 0.5 * geometry.pitch, limits_at(geometry, effects, radius)
    lift = geometry.marble_mass * g * geometry.marble_circle_radius
    at_transfer = limits(lift * cosine(half) / sine(half), geometry.carried + 1)
    between = limits(lift / sine(half), geometry.carried)
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


def statics_of(
    geometry: MarbleMachineParameters, effects: MarbleMachineEffects, motor: MotorTable | None
) -> StaticQuantities:
    """Return the torques of impending motion on the pinion (eq 24) and their components."""
    journal = effects.shaft_friction
    mesh, g = mesh_of(geometry), effects.gravity.g if effects.gravity else 0.0
    half = 0.5 * geometry.pitch
    lift = geometry.marble_mass * g * geometry.marble_circle_radius
    moments = {"": lift * cosine(half) / sine(half), "_worst": lift / sine(half)}
    quantities = StaticQuantities(impending_motion_torques(geometry, effects, motor))
    steady = limits_at(geometry, effects, journal.kinetic_radius if journal else 0.0)
    for where, moment in moments.items():
        lifting, lowering = steady(moment, geometry.carried)
        quantities[f"torque_to_keep_lifting{where}"] = Quantity(lifting, "N m")
        quantities[f"torque_to_keep_lowering{where}"] = Quantity(lowering, "N m")
    weight = (geometry.gear_mass + (geometry.carried + 1) * geometry.marble_mass) * g
    for way in ("lift", "hold"):
        torque = quantities[f"torque_to_{way}"].value
        if torque is not None:
            force, sideways, down = (
                torque / geometry.pinion_radius,
                mesh.c_z * torque,
                mesh.c_y * torque,
            )
            quantities[f"tooth_force_tangential_to_{way}"] = Quantity(force, "N")
            quantities[f"tooth_force_radial_to_{way}"] = Quantity(force * geometry.tooth_slope, "N")
            quantities[f"shaft_force_sideways_to_{way}"] = Quantity(sideways, "N")
            quantities[f"shaft_force_down_to_{way}"] = Quantity(weight + down, "N")
            quantities[f"shaft_reaction_to_{way}"] = Quantity(hypot(sideways, weight + down), "N")
    quantities.notes = (
        "torques to lift and to hold act on the pinion, load torques on the gear against its angle",
        f"torques to lift and to hold at a transfer are those of {geometry.carried + 1} marbles,"
        f" torques to keep lifting and lowering those of the {geometry.carried} of the motion",
    )
    quantities["load_torque_at_transfer"] = Quantity(moments[""], "N m")
    quantities["load_torque_worst"] = Quantity(moments["_worst"], "N m")
    quantities["angle_of_the_worst"] = Quantity(half, "rad")
    quantities["friction_radius_static"] = Quantity(journal.static_radius if journal else 0.0, "m")
    quantities["mesh_force_sideways_per_torque"] = Quantity(mesh.c_z, "1/m")
    quantities["mesh_force_down_per_torque"] = Quantity(mesh.c_y, "1/m")
    return quantities
