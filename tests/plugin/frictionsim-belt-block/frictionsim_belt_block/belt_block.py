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
    force: float = ext.unit_field("N", "Friction F_s that holds.", ge=0)

    def sliding(self, v: float) -> float:
        return self.force / (1.0 + 3.0 * abs(v))  # N, at the speed v, m/s


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
    r, turn = block.radius, ext.signal_from(scenario.drive.turn)
    inertia, c, limit = block.mass * r**2, block.stiffness * r**2, law.force * r
    friction = ext.Friction(
        "belt",
        static=lambda u, q: limit,
        kinetic=lambda u, q, w, s, applied: law.sliding(r * w) * r,
        roundoff=lambda u, q: 1e-15 * (c * (abs(q) + abs(u)) + limit),
        **law.law_of_contact(),
    )
    terms = [ext.Term(lambda u, q, w: -c * (q + u), ext.INPUT)]
    system = ext.OneCoordinate(turn, None, inertia, terms, friction)
    return ext.one_coordinate(scenario, system, lambda samples: {})


def statics(scenario: SCENARIO) -> ext.Quantities:
    block, law = scenario.mechanism, scenario.effects.belt_friction
    return {"stretch": ext.Quantity(law.force / block.stiffness, "m")}


simulation = ext.simulation_of(build)
