"""A block on a belt, held by a spring: m r^2 dw/dt = -k r^2 (q + u) + T, of its slip q."""

from typing import ClassVar, Literal

from frictionsim.mechanisms import extension as ext

METRICS, PANELS = ext.METRICS, ("friction_torque", "angular_velocity", "angle")


class Block(ext.Params):
    radius: float = ext.unit_field("m", "Radius r of the pulley.", gt=0)
    mass: float = ext.unit_field("kg", "Mass m of the block.", gt=0)
    stiffness: float = ext.unit_field("N/m", "Stiffness k of the spring.", gt=0)


class Drive(ext.Params):
    turn: ext.TimeSignal = ext.unit_field("rad", "Turn u of the pulley, which moves the belt.")


class Friction(ext.FrictionLaw):
    mu_s: float = ext.unit_field("1", "Static coefficient, not below mu_k.", ge=0)
    mu_k: float = ext.unit_field("1", "Kinetic coefficient.", ge=0)


class Effects(ext.Params):
    belt_friction: Friction


class SCENARIO(ext.SingleDofScenario):
    CHANNELS: ClassVar = ext.base_channels("block")
    kind: Literal["belt_block"]
    mechanism: Block
    drive: Drive
    effects: Effects


def build(scenario: SCENARIO) -> ext.Mechanism:
    block, law = scenario.mechanism, scenario.effects.belt_friction
    inertia, c = block.mass * block.radius**2, block.stiffness * block.radius**2
    turn, weight = ext.signal_from(scenario.drive.turn), 9.81 * block.mass * block.radius
    friction = ext.Friction(
        "belt",
        static=lambda u, q: law.mu_s * weight,
        kinetic=lambda u, q, w, s, applied: law.mu_k * weight,
        roundoff=lambda u, q: 1e-15 * (c * (abs(q) + abs(u)) + weight),
        **law.law_of_contact(),
    )
    terms = [ext.Term(lambda u, q, w: -c * (q + u), ext.INPUT)]
    system = ext.OneCoordinate(turn, None, inertia, terms, friction)
    return ext.one_coordinate(scenario, system, lambda samples: {})


def statics(scenario: SCENARIO) -> ext.Quantities:
    block, law = scenario.mechanism, scenario.effects.belt_friction
    return {"stretch": ext.Quantity(law.mu_s * 9.81 * block.mass / block.stiffness, "m")}


simulation = ext.simulation_of(build)
