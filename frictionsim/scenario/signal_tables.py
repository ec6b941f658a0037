"""The forms of a signal in a scenario, and their extreme values.

A signal is a number, points, a sine, a smooth step, or points from a CSV file.
"""

from collections.abc import Collection
from itertools import pairwise
from math import fmod, inf, pi, radians
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    PlainValidator,
    Tag,
    ValidationInfo,
    model_validator,
)
from pydantic_core import PydanticCustomError

from frictionsim.errors import InputError, closest
from frictionsim.scenario.arguments import ColumnKey
from frictionsim.scenario.model_fields import unit_of
from frictionsim.scenario.schema import Params, inconsistent, unit_field, unit_of_key
from frictionsim.scenario.signals import Constant, CubicPiece, Harmonic, Signal, linear, sum_of


class PointsTable(Params):
    """Points between which a value is linear: of time, of a speed or of an angle."""

    @model_validator(mode="after")
    def _points_make_a_signal(self) -> Self:
        (key, points), (_, values) = self
        field, name = type(self).model_fields[key], key.removesuffix("_deg")
        if len(points) != len(values):
            raise inconsistent(
                ("value",), f"{len(values)} values for {len(points)} {name}s; give one for each"
            )
        for i, (earlier, later) in enumerate(pairwise(points)):
            if not later > earlier:
                raise inconsistent(
                    (key,),
                    f"{name}s must increase from point to point, but point {i + 2} at {later}"
                    f" {unit_of(field)} follows one at {earlier} {unit_of(field)}"
                    + ("; a jump is a steep slope" if (name, later) == ("time", earlier) else ""),
                )
        return self


_POINTS: dict[str, Any] = {"min_length": 1, "strict": False}


class PiecewiseLinearTable(PointsTable):
    """`{time = [...], value = [...]}`: linear between the points, constant outside."""

    time: tuple[float, ...] = unit_field("s", "Times of the points, increasing.", **_POINTS)
    value: tuple[float, ...] = Field(
        description="Values at these times; constant before and after.", **_POINTS
    )

    def signal(self) -> Signal:
        return linear(self.time, self.value)


class SpeedTable(PointsTable):
    """`{speed = [...], value = [...]}`: a value that depends on a speed, not on time."""

    speed: tuple[float, ...] = unit_field("rad/s", "Speeds of the points, increasing.", **_POINTS)
    value: tuple[float, ...] = Field(
        description="Values at these speeds; constant beyond them.", **_POINTS
    )


class AngleTable(PointsTable):
    """`{angle_deg = [...], value = [...]}`: a value that depends on an angle, not on time."""

    angle_deg: tuple[float, ...] = unit_field(
        "deg", "Angles of the points, increasing; turns are counted.", **_POINTS
    )
    value: tuple[float, ...] = Field(
        description="Values at these angles; constant beyond them.", **_POINTS
    )


class SineParameters(Params):
    """Parameters of a sine signal."""

    mean: float = Field(0.0, description="Mean value.")
    amplitude: float = Field(description="Amplitude.")
    frequency_hz: float = unit_field("Hz", "Frequency.", gt=0)
    phase_deg: float = unit_field("deg", "Phase at the start.", 0.0)


class SineTable(Params):
    """`{sine = {mean, amplitude, frequency_hz, phase_deg}}`."""

    sine: SineParameters

    def signal(self) -> Signal:
        s = self.sine
        phase = radians(fmod(s.phase_deg, 360.0))  # a large one would leave time no digits
        if s.amplitude == 0.0:
            return Constant(s.mean)
        harmonic = Harmonic(s.amplitude, 2.0 * pi * s.frequency_hz, phase)
        return Signal([CubicPiece(0.0, s.mean)], harmonic)


class SmoothStepParameters(Params):
    """Parameters of a smooth step."""

    before: float = Field(alias="from", description="Value before the step.")
    after: float = Field(alias="to", description="Value after the step.")
    start: float = unit_field("s", "Time at which the step starts.")
    stop: float = unit_field("s", "Time at which it is complete.")

    @model_validator(mode="after")
    def _stop_after_start(self) -> Self:
        if not self.stop > self.start:
            raise inconsistent(("stop",), f"{self.stop} s is not after start = {self.start} s")
        return self


class SmoothStepTable(Params):
    """`{smooth_step = {from, to, start, stop}}`."""

    smooth_step: SmoothStepParameters

    def signal(self) -> Signal:
        s = self.smooth_step
        rise, duration = s.after - s.before, s.stop - s.start
        if rise == 0.0:
            return Constant(s.before)
        # 3 x^2 - 2 x^3: the first derivative is continuous, the second jumps at both ends.
        c2, c3 = 3.0 * rise / duration**2, -2.0 * rise / duration**3
        step = CubicPiece(s.start, s.before, 0.0, c2, c3)
        return Signal([CubicPiece(s.start, s.before), step, CubicPiece(s.stop, s.after)])


def _column(value: Any) -> ColumnKey:
    if isinstance(value, str) and value.strip():
        return value.strip()
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise PydanticCustomError("column", "expected a column")  # worded in validation.py


_COLUMN_SCHEMA: Any = Annotated[str, Field(pattern=r"\S")] | Annotated[int, Field(ge=1)]
_Column = Annotated[ColumnKey, PlainValidator(_column, json_schema_input_type=_COLUMN_SCHEMA)]


class CsvTable(Params):
    """`{csv = "log.csv", time = "t", value = "F_N"}`: points from columns of a file."""

    csv: str = Field(
        min_length=1, description="File, relative to the scenario; # begins a comment in it."
    )
    time: _Column | None = Field(
        None, description="Column of the times, by name or number; the first if left out."
    )
    value: _Column | None = Field(
        None, description="Column of the values, by name or number; the second if left out."
    )
    delimiter: Literal[";", "\t", ",", " ", "|"] | None = Field(
        None, description="Character between cells; if left out `;`, tab, `,` or blank, as found."
    )
    decimal: Literal[".", ","] | None = Field(
        None, description="Decimal mark of the numbers; if left out as found."
    )

    def points(self, folder: Path, unit: str) -> dict[str, list[float]]:
        """Return the points in the file, which is relative to a folder, with the values in `unit`.

        Raises a PydanticCustomError if the file cannot be read, or lacks a column or a number, or
        if a unit is not known or does not fit.
        """
        from frictionsim.scenario.csv_columns import read_columns  # few scenarios have files

        path, of_speed = folder / self.csv, getattr(self, "speed", None)
        argument, its_unit = ("speed", "rad/s") if of_speed else ("time", "s")
        wanted: list[ColumnKey] = [of_speed or self.time or 1, self.value or 2]
        dialect = {"delimiter": self.delimiter, "decimal": self.decimal}
        are_all = not self.model_fields_set - {"csv"}
        try:
            columns, lines = read_columns(path, wanted, wanted, are_all=are_all, **dialect)
            x, y = (columns[column] for column in wanted)
            if x.place == y.place:
                raise InputError(f"'{path}': column {y.place + 1} is that of the {argument}, too")
            of_x, of_y = x.factor(its_unit), y.factor(unit)
            points, values = [n * of_x for n in x.values], [n * of_y for n in y.values]
            for line, (earlier, later) in zip(lines[1:], pairwise(points), strict=True):
                if not later > earlier:
                    raise InputError(
                        f"line {line} of '{path}': {argument}s must increase from line to line, but"
                        f" {later} {its_unit} follows {earlier} {its_unit}"
                    )
        except InputError as error:
            relative = "" if path.exists() else "; the path is relative to the scenario"
            raise inconsistent(("csv",), f"{error}{relative}") from None
        return {argument: points, "value": values}


class CsvSpeedTable(CsvTable):
    """`{csv = "log.csv", speed = "w", value = "M_Nm"}`: points from columns, over a speed."""

    speed: _Column | None = Field(
        None, description="Column of speeds, by name or number, in the place of time."
    )

    @model_validator(mode="after")
    def _over_time_or_speed(self) -> Self:
        if self.speed is not None and self.time is not None:
            raise inconsistent(("speed",), "expected a column of time or of speed; found both")
        return self


class _FileReader(NamedTuple):
    """The validator that replaces `{csv = "file.csv", ...}` by the points in the file."""

    model: type[CsvTable]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        unit = unit_of_key.get()

        def read(table: Any, info: ValidationInfo) -> Any:
            folder: Path | None = (info.context or {}).get("folder", Path())
            if folder is None:
                raise inconsistent(
                    ("csv",),
                    "a scenario in a result holds its numbers itself, and refers to no file; was"
                    " the result changed?",
                )
            return self.model.model_validate(table).points(folder, unit)

        reader = BeforeValidator(read, json_schema_input_type=self.model)
        return reader.__get_pydantic_core_schema__(source, handler)


# Tags of forms that are no tables of their own: of a signal, and of a table that may be a list.
NUMBER, SUM, ONE = "<number>", "<sum>", "<one>"
# Those of tables are named for the first of these keys that they have. A tag is a part of the
# location of a validation error; it is not a key of the scenario.
SIGNAL_TAGS: dict[str, type[Params]] = {
    "<csv>": CsvTable,
    "<speed>": SpeedTable,
    "<angle_deg>": AngleTable,
    "<sine>": SineTable,
    "<smooth_step>": SmoothStepTable,
    "<time>": PiecewiseLinearTable,
}
_KEYS = [tag.strip("<>") for tag in SIGNAL_TAGS]


def forms_of(models: Collection[Any]) -> str:
    """Return the tables that a signal may be, of which some are among the models of its key."""
    of_motion: dict[str, Any] = {"speed": SpeedTable, "angle_deg": AngleTable}
    points = ["time", *[key for key, model in of_motion.items() if model in models]]
    forms = [f"{{{key} = [...], value = [...]}}" for key in points]
    return ", ".join([*forms, "{sine = {...}}", "{smooth_step = {...}}"]) + ' or {csv = "file.csv"}'


def _form(given: Any) -> str | None:
    """Return the tag of what is given for a signal; None of a table that is none."""
    if isinstance(given, Params):
        return next(tag for tag, model in SIGNAL_TAGS.items() if isinstance(given, model))
    if isinstance(given, list | tuple):
        return SUM
    if not isinstance(given, dict):
        return NUMBER
    found = [key for key in _KEYS if key in given]
    if not found:  # it is misspelt
        found = [near for key in given if (near := closest(str(key), _KEYS))]
    return f"<{found[0]}>" if found else None


# Its message is in `validation`: braces would be placeholders here.
NO_SIGNAL = "no_signal"
_ByForm = Discriminator(_form, custom_error_type=NO_SIGNAL, custom_error_message="no signal")

_AnyForms = (
    Annotated[float, Tag(NUMBER)]
    | Annotated[PiecewiseLinearTable, Tag("<time>")]
    | Annotated[SineTable, Tag("<sine>")]
    | Annotated[SmoothStepTable, Tag("<smooth_step>")]
)
_TimeForms = _AnyForms | Annotated[PiecewiseLinearTable, _FileReader(CsvTable), Tag("<csv>")]
_SpeedOrTimeForms = (
    _AnyForms
    | Annotated[SpeedTable, Tag("<speed>")]
    | Annotated[PiecewiseLinearTable | SpeedTable, _FileReader(CsvSpeedTable), Tag("<csv>")]
)
TimeSignal = Annotated[_TimeForms, _ByForm]
SpeedOrTimeSignal = Annotated[_SpeedOrTimeForms, _ByForm]

# A signal, or a list of signals that add.
_AtLeastOne = Field(min_length=1, strict=False)
TimeSignals = Annotated[
    _TimeForms | Annotated[tuple[TimeSignal, ...], _AtLeastOne, Tag(SUM)], _ByForm
]
SpeedOrTimeSignals = Annotated[
    _SpeedOrTimeForms | Annotated[tuple[SpeedOrTimeSignal, ...], _AtLeastOne, Tag(SUM)], _ByForm
]

# Over time, over the speed of the body, or over its angle.
MotionSignal = Annotated[_SpeedOrTimeForms | Annotated[AngleTable, Tag("<angle_deg>")], _ByForm]


def signal_from(table: Any) -> Signal:
    """Return the signal, a function of time, of a number or signal table, or a tuple that adds."""
    if isinstance(table, tuple):
        return sum_of([signal_from(term) for term in table])
    return table.signal() if hasattr(table, "signal") else Constant(table)


def signal_and_curve(given: Any) -> tuple[Signal, Signal | None]:
    """Return the sum of the signals over time, and that over speed if there are any."""
    terms = given if isinstance(given, tuple) else (given,)
    curves = [linear(term.speed, term.value) for term in terms if isinstance(term, SpeedTable)]
    over_time = tuple(term for term in terms if not isinstance(term, SpeedTable))
    return signal_from(over_time), sum_of(curves) if curves else None


def last_change(signal: Any) -> float:
    """Return the time after which a signal is constant, s; inf of a sine, 0 of one of motion."""
    if isinstance(signal, tuple):
        return max(map(last_change, signal))
    curve = signal.signal() if hasattr(signal, "signal") else Constant(0.0)
    return curve.pieces[-1].knot if curve.harmonic is None else inf


def held_value(signal: Any, end: float) -> float | None:
    """Return the value at which a signal over time stays up to a time `end`; None if at none."""
    terms = signal if isinstance(signal, tuple) else (signal,)
    if signal is None or any(isinstance(term, SpeedTable | AngleTable) for term in terms):
        return None
    return sum(signal_from(term)(end) for term in terms) if last_change(signal) < end else None


def extremes(signal: Any, end: float) -> tuple[float, float]:
    """Return the minimum and maximum of a number or signal table between 0 and `end`, s.

    Of a sum, those of its part over speed add to those of its part over time.
    """
    curve, over_speed = signal_and_curve(signal)
    values, t = [curve(0.0), curve(end)], curve.next_extremum(0.0)
    if curve.harmonic is not None and curve.harmonic.angular_frequency * end >= 2.0 * pi:
        values, t = list(curve.extremes(0.0, end)), end
    while t < end:
        values.append(curve(t))
        t = curve.next_extremum(t)
    others = [0.0]
    if over_speed is not None:
        others = [over_speed(s * w) for w in (0.0, *over_speed.corners()) for s in (-1.0, 1.0)]
    return min(values) + min(others), max(values) + max(others)
