"""Kinetic friction of a dry contact: a number, or a curve over the speed of its sliding surface.

    {speed = [...], value = [...]}            linear between points, constant before and after
    {stribeck = {mu_c, speed, exponent}}      mu_c + (mu_s - mu_c) exp(-(|v|/v_s)^n) [1]_

The speed is that of the surface, in m/s, of a coefficient. Of a couple (`torque_c` in the place of
`mu_c`) and of an arm of rolling friction (`arm_c`) it is a rotation, in rad/s. The value at rest is
the first one of the points, and static friction of a Stribeck curve. It does not exceed static
friction; at speed it may.

References
----------
.. [1] L. C. Bo, D. Pavelescu, The friction-speed relation and its influence on the critical
   velocity of stick-slip motion, Wear 82, 1982, 277-289.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from math import exp, inf, log
from typing import Annotated, Any, NamedTuple

from pydantic import Discriminator, Field, Tag

from frictionsim.errors import closest
from frictionsim.scenario.schema import Params, check_kinetic, inconsistent, unit_field
from frictionsim.scenario.signal_tables import PointsTable
from frictionsim.scenario.signals import linear

MAX_POWER, MAX_EXPONENT = 7.0, 700.0  # exp(-exp(7)) is 0, exp(700) a number
FAR = 3.4  # exp(-exp(3.4)) is 1e-13: slower than that, a Stribeck curve differs from its limit
ROUNDING = 1e-12  # of a speed at a corner, relative


class Corners(NamedTuple):
    """The surfaces |v| = speed at which steps end: corners of friction, and rest.

    A step that was cut at a surface is tried for its error, so that one that slows down to rest
    does not pass over the fall of friction just above it.

    Attributes
    ----------
    place : int
        Of v in the state.
    speeds : tuple of float
        Ascending, the first one 0, in the unit of v.
    """

    place: int
    speeds: tuple[float, ...]
    event: str = ""

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return a number that is positive beyond the first corner in a step."""
        begin, end, speeds = step.y_old[self.place], y[self.place], self.speeds
        if begin < 0.0 or (begin == 0.0 and end < 0.0):
            begin, end = -begin, -end
        # A speed that stays at a corner, but for rounding, crosses none.
        above = bisect_right(speeds, begin * (1.0 + ROUNDING))
        below = bisect_left(speeds, begin * (1.0 - ROUNDING)) - 1
        slower = speeds[below] - end if below >= 0 else -inf
        return max(slower, abs(end) - speeds[above] if above < len(speeds) else -inf)


class OverSpeed(NamedTuple):
    """Kinetic friction over the velocity v of a contact, of either sign.

    Attributes
    ----------
    at : callable
        Of v: the value.
    at_rest, largest : float
        Values at rest, and of all speeds.
    corners : tuple of float
        The speeds above 0 at which its slope jumps, or at which a fall begins.
    """

    at: Callable[[float], float]
    at_rest: float
    largest: float
    corners: tuple[float, ...]

    def of(self, lever: float, function: Callable[[float], float]) -> "OverSpeed":
        """Return an increasing function of the values, over v with the speed |v| lever."""
        at, corners = self.at, tuple(speed / lever for speed in self.corners)
        return OverSpeed(
            lambda v: function(at(lever * v)),
            function(self.at_rest),
            function(self.largest),
            corners,
        )

    def surfaces(self, place: int) -> tuple[Corners]:
        """Return the surfaces of its corners, with the place of v in the state."""
        return (Corners(place, (0.0, *self.corners)),)


class KineticCurve(Params):
    """Kinetic friction over the speed."""

    def over_speed(self, static: float) -> OverSpeed | None:
        """Return the curve, with static friction at rest; None if it is constant."""
        raise NotImplementedError

    def at_rest(self, static: float) -> float:
        """Return the value at rest."""
        raise NotImplementedError

    def check(self, name: str, static_name: str, static: float) -> None:
        """Raise the error of a key whose friction at rest exceeds static friction."""
        raise NotImplementedError


_SPEEDS: dict[str, Any] = {"min_length": 1, "strict": False}
_NotNegative = Annotated[float, Field(ge=0)]


class KineticPoints(KineticCurve, PointsTable):
    """`{speed = [...], value = [...]}`."""

    def over_speed(self, static: float) -> OverSpeed | None:
        (_, speeds), (_, values) = self
        if len(set(values)) == 1:
            return None
        curve = linear(speeds, values)
        corners = tuple(speed for speed in speeds if speed > 0.0)
        return OverSpeed(lambda v: curve(abs(v)), values[0], max(values), corners)

    def at_rest(self, static: float) -> float:
        (_, _), (_, values) = self
        return float(values[0])

    def check(self, name: str, static_name: str, static: float) -> None:
        if (first := self.at_rest(static)) > static:
            raise inconsistent(
                (name, "value"),
                f"its first value, {first}, is above {static_name} = {static}; kinetic friction"
                f" must not exceed static friction at rest, so begin with 0 to {static}",
            )


class CoefficientPoints(KineticPoints):
    """`{speed = [...], value = [...]}`: a coefficient over the speed of the surface."""

    speed: tuple[_NotNegative, ...] = unit_field(
        "m/s", "Speeds of the sliding surface, increasing.", **_SPEEDS
    )
    value: tuple[_NotNegative, ...] = unit_field(
        "1", "Values at these speeds; constant before and after.", **_SPEEDS
    )


class RotationPoints(KineticPoints):
    """`{speed = [...], value = [...]}`: a couple, or an arm, over the speed of rotation."""

    speed: tuple[_NotNegative, ...] = unit_field(
        "rad/s", "Speeds of the rotation, increasing.", **_SPEEDS
    )
    value: tuple[_NotNegative, ...] = Field(
        description="Values at these speeds; constant before and after.", **_SPEEDS
    )


class StribeckCurve(KineticCurve):
    """`{stribeck = {...}}`, of whose three keys the first one is friction at high speed."""

    stribeck: Any

    def over_speed(self, static: float) -> OverSpeed | None:
        (_, fast), (_, speed), (_, exponent) = self.stribeck
        fall = static - fast
        if fall == 0.0:
            return None

        def at(v: float) -> float:
            x = abs(v) / speed
            if x == 0.0:
                return static
            return fast + fall * exp(-exp(min(exponent * log(x), MAX_POWER)))

        return OverSpeed(at, static, static, (speed * exp(min(FAR / exponent, MAX_EXPONENT)),))

    def at_rest(self, static: float) -> float:
        return static

    def check(self, name: str, static_name: str, static: float) -> None:
        (key, fast), *_ = self.stribeck
        if fast > static:
            raise inconsistent(
                (name, "stribeck", key),
                f"{fast} is above {static_name} = {static}; the curve falls from {static_name} to"
                f" {key}, so give 0 <= {key} <= {static_name}, or {FORM_OF_POINTS} for one that"
                " rises",
            )


class CoefficientStribeckParameters(Params):
    """Parameters of a Stribeck curve of a coefficient."""

    mu_c: float = unit_field("1", "Coefficient of friction at high speed.", ge=0)
    speed: float = unit_field("m/s", "Speed of the surface over which it falls.", gt=0)
    exponent: float = unit_field("1", "Exponent of the speed.", gt=0)


class CoefficientStribeck(StribeckCurve):
    """`{stribeck = {mu_c, speed, exponent}}`."""

    stribeck: CoefficientStribeckParameters


class CoupleStribeckParameters(Params):
    """Parameters of a Stribeck curve of a couple."""

    torque_c: float = unit_field("N m", "Couple at high speed.", ge=0)
    speed: float = unit_field("rad/s", "Speed of rotation over which it falls.", gt=0)
    exponent: float = unit_field("1", "Exponent of the speed.", gt=0)


class CoupleStribeck(StribeckCurve):
    """`{stribeck = {torque_c, speed, exponent}}`."""

    stribeck: CoupleStribeckParameters


class ArmStribeckParameters(Params):
    """Parameters of a Stribeck curve of an arm."""

    arm_c: float = unit_field("m", "Arm at high speed.", ge=0)
    speed: float = unit_field("rad/s", "Speed of rotation over which it falls.", gt=0)
    exponent: float = unit_field("1", "Exponent of the speed.", gt=0)


class ArmStribeck(StribeckCurve):
    """`{stribeck = {arm_c, speed, exponent}}`."""

    stribeck: ArmStribeckParameters


FORM_OF_POINTS = "{speed = [...], value = [...]}"
FORMS_OF_FRICTION = f"{FORM_OF_POINTS} or {{stribeck = {{...}}}}"
# Tags of the forms, parts of the location of a validation error which are no keys.
NUMBER = "<kinetic number>"
KINETIC_TAGS: dict[str, type[Params]] = {
    "<coefficient speed>": CoefficientPoints,
    "<coefficient stribeck>": CoefficientStribeck,
    "<couple speed>": RotationPoints,
    "<couple stribeck>": CoupleStribeck,
    "<arm speed>": RotationPoints,
    "<arm stribeck>": ArmStribeck,
}
NO_FRICTION = "no_kinetic_friction"  # its message is in `validation`


def _by_form(of: str) -> Discriminator:
    """Return what tells the forms of the friction of a coefficient, couple or arm apart."""

    def form(given: Any) -> str | None:
        if not isinstance(given, dict | KineticCurve):
            return NUMBER
        known = ["stribeck", "speed", "value"]
        keys = [str(key) for key in (dict(given) if isinstance(given, KineticCurve) else given)]
        found = set(known).intersection(keys) or {closest(key, known) for key in keys} - {""}
        if not found:
            return None
        return f"<{of} {'stribeck' if 'stribeck' in found else 'speed'}>"

    return Discriminator(form, custom_error_type=NO_FRICTION, custom_error_message="no friction")


_Number = Annotated[float, Field(ge=0), Tag(NUMBER)]
KineticCoefficient = Annotated[
    _Number
    | Annotated[CoefficientPoints, Tag("<coefficient speed>")]
    | Annotated[CoefficientStribeck, Tag("<coefficient stribeck>")],
    _by_form("coefficient"),
]
KineticCouple = Annotated[
    _Number
    | Annotated[RotationPoints, Tag("<couple speed>")]
    | Annotated[CoupleStribeck, Tag("<couple stribeck>")],
    _by_form("couple"),
]
KineticArm = Annotated[
    _Number
    | Annotated[RotationPoints, Tag("<arm speed>")]
    | Annotated[ArmStribeck, Tag("<arm stribeck>")],
    _by_form("arm"),
]


def check_kinetic_friction(
    name: str, kinetic: float | KineticCurve, static_name: str, static: float
) -> None:
    """Raise the error of a key whose kinetic friction at rest exceeds static friction."""
    if isinstance(kinetic, KineticCurve):
        kinetic.check(name, static_name, static)
    else:
        check_kinetic(name, kinetic, static_name, static)


def friction_at_rest(kinetic: float | KineticCurve, static: float) -> float:
    """Return kinetic friction at the speed zero: the first point, static friction of Stribeck."""
    return kinetic.at_rest(static) if isinstance(kinetic, KineticCurve) else kinetic


def friction_over_speed(kinetic: float | KineticCurve, static: float) -> OverSpeed | None:
    """Return kinetic friction over the speed; None if it is a number, or as good as one."""
    return kinetic.over_speed(static) if isinstance(kinetic, KineticCurve) else None
