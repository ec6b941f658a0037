"""Courses in time of a force, a torque or a speed, and where they kink and turn.

A solver ends its steps on kinks, where a derivative jumps, so that no step straddles one.
Between two turns a course is monotone: whatever threshold it crosses there, it crosses once,
which is what makes the search for a breakaway rigorous.
"""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import ceil, cos, inf, pi, radians, sin
from pathlib import Path
from typing import Annotated, Any, Protocol, Self

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    model_validator,
)

from frictionsim.parameters import Params, misfit, quantity


class Course(Protocol):
    """A continuous, piecewise smooth function of time."""

    def __call__(self, t: float) -> float:
        """Return the value at time t, s."""

    def slope(self, t: float) -> float:
        """Return the derivative at time t, s; at a kink that of after it."""

    def next_kink(self, t: float) -> float:
        """Return the first time after t, s, at which a derivative jumps; inf if none."""

    def next_turn(self, t: float) -> float:
        """Return a time after t, s, up to which the course is monotone and smooth."""


class Constant:
    """The same value at all times."""

    def __init__(self, value: float) -> None:
        self._value = value

    def __call__(self, t: float) -> float:
        return self._value

    def slope(self, t: float) -> float:
        return 0.0

    def next_kink(self, t: float) -> float:
        return inf

    def next_turn(self, t: float) -> float:
        return inf


class PiecewiseLinear:
    """Straight lines from point to point, constant before the first and after the last."""

    def __init__(self, times: Sequence[float], values: Sequence[float]) -> None:
        self._times = list(times)
        # Horizontal lines outside: a point before the first and the last point stand in for them.
        self._from_time = [times[0], *times]
        self._from_value = [values[0], *values]
        slopes = [
            (v1 - v0) / (t1 - t0)
            for t0, t1, v0, v1 in zip(times, times[1:], values, values[1:], strict=False)
        ]
        self._slope = [0.0, *slopes, 0.0]

    def __call__(self, t: float) -> float:
        i = bisect_right(self._times, t)
        return self._from_value[i] + self._slope[i] * (t - self._from_time[i])

    def slope(self, t: float) -> float:
        return self._slope[bisect_right(self._times, t)]

    def next_kink(self, t: float) -> float:
        i = bisect_right(self._times, t)
        return self._times[i] if i < len(self._times) else inf

    next_turn = next_kink


class Sine:
    """mean + amplitude sin(angular_frequency t + phase)."""

    def __init__(
        self, mean: float, amplitude: float, angular_frequency: float, phase: float
    ) -> None:
        self._mean = mean
        self._amplitude = amplitude
        self._angular_frequency = angular_frequency
        self._phase = phase

    def __call__(self, t: float) -> float:
        return self._mean + self._amplitude * sin(self._angular_frequency * t + self._phase)

    def slope(self, t: float) -> float:
        omega = self._angular_frequency
        return self._amplitude * omega * cos(omega * t + self._phase)

    def next_kink(self, t: float) -> float:
        return inf

    def next_turn(self, t: float) -> float:
        half_turns = (self._angular_frequency * t + self._phase - pi / 2) / pi
        k = ceil(half_turns)
        while True:
            turn = (pi / 2 + k * pi - self._phase) / self._angular_frequency
            # Rounding can put the turn on t itself.
            if turn > t:
                return turn
            k += 1


class SmoothStep:
    """From one value to another along 3 x^2 - 2 x^3, constant before and after.

    The slope is continuous; the curvature jumps at both ends.
    """

    def __init__(self, before: float, after: float, start: float, stop: float) -> None:
        self._before = before
        self._rise = after - before
        self._start = start
        self._stop = stop
        self._duration = stop - start

    def __call__(self, t: float) -> float:
        x = min(max((t - self._start) / self._duration, 0.0), 1.0)
        return self._before + self._rise * (x * x * (3.0 - 2.0 * x))

    def slope(self, t: float) -> float:
        x = min(max((t - self._start) / self._duration, 0.0), 1.0)
        return self._rise * 6.0 * x * (1.0 - x) / self._duration

    def next_kink(self, t: float) -> float:
        if t < self._start:
            return self._start
        return self._stop if t < self._stop else inf

    next_turn = next_kink


class PointsTable(Params):
    """`{time = [...], value = [...]}`: linear between the points, constant outside."""

    time: tuple[float, ...] = quantity("s", min_length=1, strict=False)
    value: tuple[float, ...] = Field(min_length=1, strict=False)

    @model_validator(mode="after")
    def _points_make_a_course(self) -> Self:
        _see_points("time", self.time, "s", self.value)
        return self

    def course(self) -> Course:
        if len(set(self.value)) == 1:
            return Constant(self.value[0])
        return PiecewiseLinear(self.time, self.value)


class SpeedTable(Params):
    """`{speed = [...], value = [...]}`: a value that depends on a speed, not on time."""

    speed: tuple[float, ...] = quantity("rad/s", min_length=1, strict=False)
    value: tuple[float, ...] = Field(min_length=1, strict=False)

    @model_validator(mode="after")
    def _points_make_a_course(self) -> Self:
        _see_points("speed", self.speed, "rad/s", self.value)
        return self


def _see_points(name: str, places: Sequence[float], unit: str, values: Sequence[float]) -> None:
    """See that there is a value at each of the places, and that these increase."""
    if len(places) != len(values):
        raise misfit(
            ("value",), f"{len(values)} values for {len(places)} {name}s; give one for each"
        )
    for i, (earlier, later) in enumerate(pairwise(places)):
        if not later > earlier:
            raise misfit(
                (name,),
                f"{name}s must increase from point to point, but point {i + 2} at {later} {unit}"
                f" follows one at {earlier} {unit}",
            )


class SineShape(Params):
    mean: float = 0.0
    amplitude: float
    frequency_hz: float = quantity("Hz", gt=0)
    phase_deg: float = quantity("deg", 0.0)


class SineTable(Params):
    """`{sine = {mean, amplitude, frequency_hz, phase_deg}}`."""

    sine: SineShape

    def course(self) -> Course:
        s = self.sine
        if s.amplitude == 0.0:
            return Constant(s.mean)
        return Sine(s.mean, s.amplitude, 2.0 * pi * s.frequency_hz, radians(s.phase_deg))


class SmoothStepShape(Params):
    before: float = Field(alias="from")
    after: float = Field(alias="to")
    start: float = quantity("s")
    stop: float = quantity("s")

    @model_validator(mode="after")
    def _stop_after_start(self) -> Self:
        if not self.stop > self.start:
            raise misfit(("stop",), f"{self.stop} s is not after start = {self.start} s")
        return self


class SmoothStepTable(Params):
    """`{smooth_step = {from, to, start, stop}}`."""

    smooth_step: SmoothStepShape

    def course(self) -> Course:
        s = self.smooth_step
        if s.before == s.after:
            return Constant(s.before)
        return SmoothStep(s.before, s.after, s.start, s.stop)


def _read_csv(table: Any, info: ValidationInfo) -> Any:
    """Replace `{csv = "file.csv"}` by its points; the path is relative to the scenario."""
    if not (isinstance(table, dict) and table.keys() == {"csv"}):
        return table
    name = table["csv"]
    if not isinstance(name, str):
        raise misfit(("csv",), "expected the name of a file, in quotes")
    folder: Path = (info.context or {}).get("folder", Path())
    path = folder / name
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or (
            "it is not text in UTF-8" if isinstance(error, UnicodeError) else error
        )
        raise misfit(
            ("csv",), f"cannot read '{path}' ({reason}); the path is relative to the scenario"
        ) from None
    times: list[float] = []
    values: list[float] = []
    for number, line in enumerate(text.splitlines(), start=1):
        cells = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not cells:
            continue
        try:
            time, value = map(float, cells)
        except ValueError:
            if not times and not any(_is_number(cell) for cell in cells):
                continue  # a line of column names above the numbers
            raise misfit(
                ("csv",),
                f"line {number} of '{path}' is not two numbers, a time and a value: '{line[:60]}'",
            ) from None
        times.append(time)
        values.append(value)
    if not times:
        raise misfit(("csv",), f"'{path}' has no line with a time and a value")
    return {"time": times, "value": values}


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


_NUMBER, _NUMBER_OR_OF_SPEED = "<number>", "<number or of speed>"
_FORMS = "{time = [...], value = [...]}, {sine = {...}}, {smooth_step = {...}}"
# The tag names the form in a validation error's location; it is no key of the scenario.
COURSE_TAGS: dict[str, type[Params]] = {
    "<points>": PointsTable,
    "<sine>": SineTable,
    "<smooth step>": SmoothStepTable,
    "<of speed>": SpeedTable,
}
# What may stand where a number of this tag may; the tag is also the type of the error if none does.
FORMS_BESIDE_NUMBER = {
    _NUMBER: f'{_FORMS} or {{csv = "file.csv"}}',
    _NUMBER_OR_OF_SPEED: f'{_FORMS}, {{csv = "file.csv"}} or {{speed = [...], value = [...]}}',
}


def _course_form(table: Any) -> str | None:
    if isinstance(table, Params):
        return next(tag for tag, model in COURSE_TAGS.items() if isinstance(table, model))
    if not isinstance(table, dict):
        return _NUMBER
    if "sine" in table:
        return "<sine>"
    if "smooth_step" in table:
        return "<smooth step>"
    if "time" in table or "value" in table:
        return "<points>"
    return None


def _course_form_or_of_speed(table: Any) -> str | None:
    if isinstance(table, dict) and "speed" in table:
        return "<of speed>"
    form = _course_form(table)
    return _NUMBER_OR_OF_SPEED if form == _NUMBER else form


def _discriminator(form: Any, number: str) -> Discriminator:
    # The type of the error says which forms there are; a context would not be hashable.
    return Discriminator(form, custom_error_type=number, custom_error_message="expected a course")


CourseInTime = Annotated[
    Annotated[float, Tag(_NUMBER)]
    | Annotated[PointsTable, Tag("<points>")]
    | Annotated[SineTable, Tag("<sine>")]
    | Annotated[SmoothStepTable, Tag("<smooth step>")],
    _discriminator(_course_form, _NUMBER),
    BeforeValidator(_read_csv),
]
CourseOfSpeedOrTime = Annotated[
    Annotated[float, Tag(_NUMBER_OR_OF_SPEED)]
    | Annotated[PointsTable, Tag("<points>")]
    | Annotated[SineTable, Tag("<sine>")]
    | Annotated[SmoothStepTable, Tag("<smooth step>")]
    | Annotated[SpeedTable, Tag("<of speed>")],
    _discriminator(_course_form_or_of_speed, _NUMBER_OR_OF_SPEED),
    BeforeValidator(_read_csv),
]


def course_of(table: float | PointsTable | SineTable | SmoothStepTable) -> Course:
    """Return the function of time that a course of the scenario describes."""
    return Constant(table) if isinstance(table, int | float) else table.course()
