"""A block brake on a flywheel: a force F(t) presses a block on the rim.

    I dw/dt = M - b w + T,    |T| <= mu_s F r sticking,    T = -s mu_k F r sliding

M is the torque of the drive, constant; r the radius of the rim. The block only pushes, F >= 0.
"""

from collections.abc import Mapping
from pathlib import Path
from sys import float_info
from typing import Any, ClassVar, Literal, Self

from pydantic import model_validator

from frictionsim.mechanisms.extension import (
    INPUT,
    STICK,
    Channel,
    Friction,
    FrictionLaw,
    Mechanism,
    OneCoordinate,
    Params,
    Quantities,
    Quantity,
    Record,
    Samples,
    SingleDofScenario,
    Term,
    TimeSignal,
    ViscousDamping,
    base_channels,
    check_kinetic,
    extremes,
    inconsistent,
    one_coordinate,
    signal_from,
    simulation_of,
    start_of,
    unit_field,
    viscous_damping,
)
from frictionsim.mechanisms.extension import METRICS as METRICS

EXAMPLE = Path(__file__).with_name("block_brake.toml").read_text(encoding="utf-8")

CHANNELS = base_channels("flywheel") | {
    "block_force": Channel("N", "force of the block on the rim"),
    "energy_input": Channel("J", "work of the drive"),
    "energy_kinetic": Channel("J", "kinetic energy of the flywheel"),
    "energy_friction": Channel("J", "heat of the brake"),
    "energy_damping": Channel("J", "heat of viscous damping"),
}

# The channels of the picture over time, from top to bottom.
PANELS = ("block_force", "friction_torque", "angular_velocity", "angle")

# The torque of the drive and the static limit are sums of a few products.
ROUNDING = 16 * float_info.epsilon


class BrakeParameters(Params):
    """`[mechanism]`."""

    inertia: float = unit_field("kg m^2", "Moment of inertia of the flywheel.", gt=0)
    rim_radius: float = unit_field("m", "Radius of the rim, where the block slides.", gt=0)
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)


class BrakeDrive(Params):
    """`[drive]`."""

    force: TimeSignal = unit_field("N", "Force of the block on the rim, not negative.")
    torque: float = unit_field("N m", "Torque of the drive on the flywheel, constant.", 0.0)


class BlockFriction(FrictionLaw):
    """Dry friction of the block on the rim."""

    mu_s: float = unit_field("1", "Static coefficient of friction, not below mu_k.", ge=0)
    mu_k: float = unit_field("1", "Kinetic coefficient of friction.", ge=0)

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic("mu_k", self.mu_k, "mu_s", self.mu_s)
        return self


class BrakeEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    block_friction: BlockFriction | None = None
    viscous_damping: ViscousDamping | None = None


class BrakeScenario(SingleDofScenario):
    """A scenario of kind `block_brake`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["block_brake"]
    mechanism: BrakeParameters
    drive: BrakeDrive
    effects: BrakeEffects = BrakeEffects()

    @model_validator(mode="after")
    def _block_pushes(self) -> Self:
        minimum, _ = extremes(self.drive.force, self.solver.duration)
        if minimum < 0.0:
            raise inconsistent(
                ("drive", "force"),
                f"has a minimum of {minimum:.6g} N; a block cannot pull, so give 0 N or more",
            )
        return self


SCENARIO = BrakeScenario


def build(scenario: BrakeScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    # What acts is the force F of the block.
    torque, radius = scenario.drive.torque, scenario.mechanism.rim_radius
    block, friction = scenario.effects.block_friction, None
    if block is not None:
        arm_s, arm_k = block.mu_s * radius, block.mu_k * radius
        friction = Friction(
            "block",
            static=lambda F, q: arm_s * F,
            kinetic=lambda F, q, w, s, applied: arm_k * F,
            roundoff=lambda F, q: ROUNDING * abs(torque),
            **block.law_of_contact(),
        )
    system = OneCoordinate(
        signal_from(scenario.drive.force),
        None,
        scenario.mechanism.inertia,
        [Term(torque, INPUT), *viscous_damping(scenario.effects.viscous_damping)],
        friction,
        start=start_of(scenario),
        channels=("block_force",),
        recorded=lambda F, q, w, a: [F],
    )
    return one_coordinate(scenario, system, lambda samples: braking(scenario, samples))


simulation = simulation_of(build)


def braking(scenario: BrakeScenario, samples: Samples) -> Quantities:
    """Return time and angle from the start to the first rest; None if it does not come to rest."""
    first = next((e for e in samples.transitions if e.mode_to == STICK), None)
    start = samples["angle"][0] if samples.time.size else 0.0
    angle = None if first is None or first.position is None else float(first.position - start)
    return {
        "braking_time": Quantity(None if first is None else first.time, "s"),
        "braking_angle": Quantity(angle, "rad"),
        **impending_motion(scenario),
    }


def impending_motion(scenario: BrakeScenario) -> Quantities:
    """Return the force that holds the flywheel at rest; None if no force does."""
    block, torque = scenario.effects.block_friction, abs(scenario.drive.torque)
    arm = 0.0 if block is None else block.mu_s * scenario.mechanism.rim_radius
    force = 0.0 if torque == 0.0 else torque / arm if arm else None
    return {"force_to_hold": Quantity(force, "N")}


def statics(scenario: BrakeScenario) -> Quantities:
    """Return the limits of the torque and of the force of the block."""
    block, radius = scenario.effects.block_friction, scenario.mechanism.rim_radius
    _, largest = extremes(scenario.drive.force, scenario.solver.duration)
    mu_s, mu_k = (0.0, 0.0) if block is None else (block.mu_s, block.mu_k)
    return {
        **impending_motion(scenario),
        "static_torque_max": Quantity(mu_s * radius * largest, "N m"),
        "kinetic_torque_max": Quantity(mu_k * radius * largest, "N m"),
    }


def heat(result: Record, figure: Any) -> None:
    """Draw the power of the brake, and where the energy is, over time."""
    channels = result.channels
    power, energy = figure.subplots(2, 1, sharex=True)
    power.plot(channels["time"], -channels["friction_torque"] * channels["angular_velocity"])
    power.set_ylabel("power of the brake, W")
    for name in ("energy_kinetic", "energy_friction"):
        energy.plot(channels["time"], channels[name], label=result.long_names[name])
    energy.set(xlabel="time, s", ylabel="energy, J")
    energy.legend()


VIEWS = {"heat": heat}
