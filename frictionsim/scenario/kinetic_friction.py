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
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import Discriminator, Field, Tag, create_model

from frictionsim.errors import closest
from frictionsim.scenario.schema import Params, check_kinetic, unit_field
from frictionsim.scenario.signal_tables import PointsTable
from frictionsim.scenario.signals import linear

MAX_POWER, MAX_EXPONENT = 7.0, 700.0  # exp(-exp(7)) is 0, exp(700) a number
FAR = 3.4  # exp(-exp(3.4)) is 1e-13: slower than that, a Stribeck curve differs from its limit
ROUNDING = 1e-12  # of a speed at a corner, relative
EXPONENT = "Exponent of the speed; 2, of a Gaussian curve, if left out."

FORMS_OF_FRICTION = "{speed = [...], value = [...]} or {stribeck = {...}}"
# Parts of the location of a validation error which are no keys: tags of the forms.
NUMBER = "<kinetic number>"
KINETIC_TAGS: dict[str, type[Params]] = {}
NOT_NEGATIVE: Any = Annotated[float, Field(ge=0)]
NO_FRICTION = "no_kinetic_friction"  # its message is in `validation`


class Corners(NamedTuple):
    """The surfaces |v| = speed at which steps end: corners of friction, and rest.

    A step that is cut there is tried for its error, so that none to rest passes over the fall of
    friction just above it. `place` is that of v in the state; `speeds` ascend from 0.
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


def in_motion(surfaces: tuple[Any, ...], place: int) -> tuple[Any, ...]:
    """Return surfaces without the rest of a velocity in this place, which is given."""
    return tuple(
        s._replace(speeds=tuple(filter(None, s.speeds)))
        if isinstance(s, Corners) and s.place == place
        else s
        for s in surfaces
    )


class OverSpeed(NamedTuple):
    """Kinetic friction over the velocity v of a contact, of either sign."""

    at: Callable[[float], float]  # of v: the value
    largest: float  # of all speeds
    # Speeds above 0 at which its slope jumps, or a fall begins; none if it is constant.
    corners: tuple[float, ...] = ()

    @property
    def at_rest(self) -> float:
        return self.at(0.0)

    @property
    def varies(self) -> bool:
        return bool(self.corners)

    def of(self, lever: float, function: Callable[[float], float]) -> "OverSpeed":
        """Return an increasing function of the values, over v with the speed |v| lever."""
        at, corners = self.at, tuple(speed / lever for speed in self.corners)
        return OverSpeed(lambda v: function(at(lever * v)), function(self.largest), corners)

    def surfaces(self, place: int) -> tuple[Corners, ...]:
        """Return the surfaces of its corners, with the place of v in the state."""
        return (Corners(place, (0.0, *self.corners)),) if self.varies else ()


class KineticCurve(Params):
    """Kinetic friction over the speed."""


class KineticPoints(KineticCurve, PointsTable):
    """`{speed = [...], value = [...]}`."""

    speed: tuple[float, ...]
    value: tuple[float, ...]


class StribeckCurve(KineticCurve):
    """`{stribeck = {...}}`, of whose three keys the first one is friction at high speed."""

    stribeck: Any


def over_speed(kinetic: float | KineticCurve, static: float) -> OverSpeed:
    """Return kinetic friction over the speed."""
    if isinstance(kinetic, KineticPoints):
        curve, values = linear(kinetic.speed, kinetic.value), kinetic.value
        corners = tuple(speed for speed in kinetic.speed if speed > 0.0 and len(set(values)) > 1)
        return OverSpeed(lambda v: curve(abs(v)), max(values), corners)
    if not isinstance(kinetic, StribeckCurve):
        return OverSpeed(lambda v: kinetic, kinetic)  # type: ignore
    (_, fast), (_, speed), (_, exponent) = kinetic.stribeck
    fall, far = static - fast, speed * exp(min(FAR / exponent, MAX_EXPONENT))

    def at(v: float) -> float:
        x = abs(v) / speed
        return fast + fall * exp(-exp(min(exponent * log(x), MAX_POWER))) if x else static

    return OverSpeed(at, static, (far,) if fall else ())


def check_kinetic_friction(
    name: str, kinetic: float | KineticCurve, static_name: str, static: float
) -> None:
    """Raise the error of a key whose kinetic friction at rest exceeds static friction."""
    where: tuple[str | int, ...] = ()
    value: Any = kinetic
    if isinstance(kinetic, KineticPoints):
        where, value = ("value", 0), kinetic.value[0]
    elif isinstance(kinetic, StribeckCurve):
        (key, value), *_ = kinetic.stribeck
        where = ("stribeck", key)
    check_kinetic(name, value, static_name, static, *where)


def _models(of: str, unit: str, fast: str, speed_unit: str) -> tuple[Any, Any, Any]:
    """Return the models of points, of a Stribeck curve and of its parameters, with their units."""
    several: dict[str, Any] = {"min_length": 1, "strict": False}
    numbers: Any = tuple[NOT_NEGATIVE, ...]
    words = "Values at these speeds; constant before and after."
    columns: dict[str, Any] = {
        "speed": (numbers, unit_field(speed_unit, "Speeds, increasing.", **several)),
        "value": (numbers, unit_field(unit, words, **several)),
    }
    keys: dict[str, Any] = {
        fast: (float, unit_field(unit, "Value at high speed.", ge=0)),
        "speed": (float, unit_field(speed_unit, "Speed over which it falls.", gt=0)),
        "exponent": (float, unit_field("1", EXPONENT, 2.0, gt=0)),
    }

    def model(name: str, base: type[Params], words: str | None, **fields: Any) -> Any:
        options: Any = {"__base__": base, "__module__": __name__, "__doc__": words}
        return create_model(of + name, **options, **fields)

    points = model("Points", KineticPoints, KineticPoints.__doc__, **columns)
    inner = model("StribeckParameters", Params, "Parameters of a Stribeck curve.", **keys)
    curve = model("Stribeck", StribeckCurve, StribeckCurve.__doc__, stribeck=(inner, ...))
    return points, curve, inner


def _forms(points: type[Params], curve: type[Params]) -> Any:
    """Return the type of a key: a number, points or a Stribeck curve."""
    tags = f"<{points.__name__}>", f"<{curve.__name__}>"
    KINETIC_TAGS.update(zip(tags, (points, curve), strict=True))

    def form(given: Any) -> str | None:
        if not isinstance(given, dict | KineticCurve):
            return NUMBER
        known = ["speed", "value", "stribeck"]  # or what is misspelt, for the message
        near = [key if key in known else closest(str(key), known) for key in dict(given)]
        return tags["stribeck" in near] if any(near) else None

    by_form = Discriminator(form, custom_error_type=NO_FRICTION, custom_error_message="no friction")
    return Annotated[
        Annotated[NOT_NEGATIVE, Tag(NUMBER)]
        | Annotated[points, Tag(tags[0])]
        | Annotated[curve, Tag(tags[1])],
        by_form,
    ]


# Pickles, of runs that are handed to other processes, find the models by these names.
CoefficientPoints, CoefficientStribeck, CoefficientStribeckParameters = _models(
    "Coefficient", "1", "mu_c", "m/s"
)
CouplePoints, CoupleStribeck, CoupleStribeckParameters = _models(
    "Couple", "N m", "torque_c", "rad/s"
)
ArmPoints, ArmStribeck, ArmStribeckParameters = _models("Arm", "m", "arm_c", "rad/s")

if TYPE_CHECKING:
    KineticCoefficient = float | KineticCurve
    KineticCouple = float | KineticCurve
    KineticArm = float | KineticCurve
else:
    KineticCoefficient = _forms(CoefficientPoints, CoefficientStribeck)
    KineticCouple = _forms(CouplePoints, CoupleStribeck)
    KineticArm = _forms(ArmPoints, ArmStribeck)
