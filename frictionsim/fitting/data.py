"""The measured data of a fit: time series of one run, or a table of runs and their noise."""

from collections.abc import Iterable, Iterator, Mapping
from math import isfinite, pi
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.csv_columns import Column, NoSuchColumn, heading, read_columns
from frictionsim.scenario.model_fields import unit_of_key
from frictionsim.scenario.model_validation import MAX_NUMBER, MIN_NUMBER
from frictionsim.scenario.options import (
    Columns,
    Options,
    as_list,
    as_path,
    by_name,
    columns_of,
    function_of,
    number_or_name,
)
from frictionsim.scenario.schema import inconsistent, unit_field

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Array
    from frictionsim.scenario.settings import Scenario


# The SI unit of each unit, and how many of it one is.
UNITS: dict[str, tuple[str, float]] = {
    "1": ("1", 1.0),
    "%": ("1", 0.01),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "rad": ("rad", 1.0),
    "deg": ("rad", pi / 180.0),
    "rev": ("rad", 2.0 * pi),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", pi / 180.0),
    "rev/s": ("rad/s", 2.0 * pi),
    "rpm": ("rad/s", pi / 30.0),
    "1/min": ("rad/s", pi / 30.0),
    "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", pi / 180.0),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
    "in": ("m", 0.0254),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "km/h": ("m/s", 1.0 / 3.6),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "kN": ("N", 1e3),
    "lbf": ("N", 4.4482216152605),
    "N m": ("N m", 1.0),
    "mN m": ("N m", 1e-3),
    "kN m": ("N m", 1e3),
    "gf cm": ("N m", 9.80665e-5),
    "lbf ft": ("N m", 1.3558179483314004),
    "J": ("J", 1.0),
    "mJ": ("J", 1e-3),
    "kJ": ("J", 1e3),
    "W": ("W", 1.0),
    "mW": ("W", 1e-3),
    "kW": ("W", 1e3),
}


def factor(unit: str, own: str) -> float:
    """Return how many of the model's own unit one of another unit is."""
    if unit == own:
        return 1.0
    si, size = UNITS.get(own, (own, 1.0))
    fitting = [name for name, (of, _) in UNITS.items() if of == si]
    if unit not in fitting:
        known = f"one of {', '.join(fitting)}" if fitting else f"'{own}'"
        raise InputError(f"expected {known}, got '{unit}'")
    return UNITS[unit][1] / size


EXACT = 1e-9  # of the spread: data are not taken to be more exact


class Noise:
    """The standard deviations of the data, given or estimated."""

    def __init__(self, targets: "Iterable[Target]") -> None:
        targets = list(targets)
        # Of each value (n,).
        self.spread = np.concatenate([t.scale for t in targets])
        self.sigma = np.concatenate([t.scale if t.sigma is None else t.sigma for t in targets])
        names = [t.group if t.sigma is None else "" for t in targets for _ in t.values]
        groups = [name for name in dict.fromkeys(names) if name]
        self.groups = [np.array([n == name for n in names]) for name in groups]
        self.all_given = not self.groups
        self.is_to_be_balanced = len(dict.fromkeys(names)) > 1

    def estimate(self, residuals: "Array", determined: int) -> float:
        """Estimate the standard deviations that were not given; return their relative change.

        So many values were determined from the data.
        """
        change, left = 0.0, max(1.0 - determined / residuals.size, 0.0)
        for group in self.groups:
            relative = residuals[group] / self.spread[group]
            size = np.sqrt(np.mean(relative**2) / left) if left else np.sqrt(np.mean(relative**2))
            sigma = self.spread[group] * max(float(size), EXACT)
            change = max(change, abs(float(sigma[0] / self.sigma[group][0]) - 1.0))
            self.sigma[group] = sigma
        return change


AT_END = 1e-9  # of the duration: a time this far outside the run is at its start or end
DEFAULT_TIME = "time"
SHARED = "quantities"  # group of single quantities without sigma, whose errors are relative


class Target(NamedTuple):
    """Measured values of a channel or quantity."""

    name: str  # as `angular_velocity`, or `pulley_speed.driven` of a channel with members
    of: Literal["channel", "quantity"]
    unit: str  # of the channel; of a quantity that of the data, empty if not said
    values: "Array"
    sigma: "Array | None"  # standard deviations
    times: "Array"  # in the run, s; empty for a quantity
    runs: "npt.NDArray[np.int64]"  # that each value is of
    group: str  # values of one group without sigma have one noise level
    scale: "Array"  # what their errors are relative to before that is known
    column: Column | None = None  # of the data; None of a value that was given
    data_unit: str = ""  # that the data were read in; empty for that of the quantity


class Measured(NamedTuple):
    """Measured data."""

    targets: tuple[Target, ...]
    runs: tuple[dict[str, float], ...]  # the keys that each sets; of time series one that sets none
    over: tuple[str, ...] = ()  # these keys

    @property
    def times(self) -> "Array":
        """All times of the channels, s, each once, in their order."""
        return np.unique(np.concatenate([t.times for t in self.targets] or [np.empty(0)]))

    @property
    def size(self) -> int:
        """How many values there are."""
        return sum(target.values.size for target in self.targets)


BOUNDS = "KEY=LOW:HIGH or KEY=LOW:HIGH:START, e.g. effects.shaft_friction.mu_s=0.05:0.4"


def _file_or_columns(data: Any) -> Any:
    if isinstance(data, str | PathLike):
        return as_path("data", data)
    if data is not None and not hasattr(data, "keys"):
        raise ValueError(f"expected a CSV file or columns by name, got {type(data).__name__}")
    return data


def _bounds_by_key(given: Any) -> dict[Any, Any]:
    """Return the bounds of free keys of a mapping, or of texts KEY=LOW:HIGH[:START]."""
    if isinstance(given, Mapping):
        return dict(given)
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ValueError(
            f"expected bounds by key, e.g. {{'drive.force': (0.0, 1.0)}}, got {given!r}"
        )
    return dict(map(_bounds, given))


def _bounds(text: Any) -> tuple[str, tuple[float, ...]]:
    key, _, value = (part.strip() for part in str(text).partition("="))
    try:
        numbers = tuple(float(part) for part in value.split(":"))
    except ValueError:
        numbers = ()
    if not key or len(numbers) not in (2, 3):
        raise ValueError(f"expected {BOUNDS}; a free key needs bounds, got {text!r}")
    return ",".join(part.strip() for part in key.split(",")), numbers


def _deviations(given: Any) -> dict[str, float | str]:
    """Return standard deviations, or the names of their columns."""
    values = by_name("NAME=VALUE", number_or_name)(given)
    for name, value in values.items():
        if not isinstance(value, str) and not _finite(name, value) > 0.0:
            raise ValueError(f"{name}: expected a number above 0, got {value:g}")
    return {name: v if isinstance(v, str) else _finite(name, v) for name, v in values.items()}


def _finite(name: str, value: Any, hint: str = "") -> float:
    number = value.item() if hasattr(value, "item") else value
    if not isinstance(number, int | float) or isinstance(number, bool) or not isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {value!r}{hint}")
    return float(number)


STARTS = 3  # local searches


class FitOptions(Options):
    """The data of a fit, what of them is compared with the scenario, and how it is fitted."""

    data: Annotated[Any, BeforeValidator(_file_or_columns)] = None
    channels: Columns = Field({})
    over: Columns = Field({})
    quantities: dict[str, Any] = Field({})  # values; with `over` columns
    sigma: Annotated[dict[str, Any], BeforeValidator(_deviations)] = Field({})
    units: Annotated[dict[str, str], BeforeValidator(by_name("NAME=UNIT", str))] = Field({})
    time: str | int | None = None
    time_unit: str | None = None
    time_offset: float = unit_field("s", "Offset added to the times of the data.", 0.0)
    free: Annotated[dict[str, Any], BeforeValidator(_bounds_by_key)] = Field({})
    starts: int = Field(STARTS, ge=1)
    seed: int = Field(0, ge=0)
    bootstrap: int = Field(0, ge=0)
    progress: Annotated[Any, function_of("a number")] = None

    @field_validator("quantities", mode="before")
    @classmethod
    def _values_or_columns(cls, given: Any, info: ValidationInfo) -> dict[str, Any]:
        if info.data.get("over"):
            return columns_of(given)
        given = given if isinstance(given, Mapping) else as_list(given)
        hint = "; a column needs 'over', whose rows are runs"
        values = by_name("the measured value of each quantity, as NAME=VALUE", number_or_name)(
            given
        )
        return {name: _finite(name, v, hint * isinstance(v, str)) for name, v in values.items()}

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        for argument, fault in self._faults():
            raise inconsistent((argument,), fault)
        return self

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Yield the options that do not go together: the argument and what is wrong."""
        compared = [*self.channels, *self.quantities]
        if not compared:
            yield "channels", "expected a channel or quantity that was measured; none is given"
        if self.over and self.channels:
            yield (
                "over",
                "the rows of the data are runs, or times of channels; leave out one of them",
            )
        if self.data is None and (self.channels or self.over):
            yield "data", "missing; expected a CSV file or columns by name"
        for argument, named in (("sigma", self.sigma), ("units", self.units)):
            for name in named.keys() - set(compared):
                yield argument, unknown("channel or quantity", name, compared)
        for name in (name.strip() for key in self.free for name in str(key).split(",")):
            if name in self.over:
                yield "over", f"'{name}' is free, too; the data give it or the fit does"


class _Table:
    """Columns of the data, whatever they come from."""

    def __init__(self, source: FitOptions, time: Column | None) -> None:
        self._source, self._time = source, time
        columns = [*source.channels.values(), *source.over.values()]
        if source.over:
            columns += source.quantities.values()
        columns += [value for value in source.sigma.values() if isinstance(value, str)]
        wanted = list(dict.fromkeys([*([] if time is None else [time]), *columns]))
        no_gaps = [*([] if time is None else [time]), *source.over.values()]
        if isinstance(source.data, Path):
            try:
                found = read_columns(source.data, wanted, no_gaps)
            except InputError as error:
                raise ArgumentError("data", str(error)) from None
            self.values = {column: np.array(found.values[column]) for column in wanted}
            self.units, self._lines = found.units, found.lines
        else:
            self.values, self.units, self._lines = {}, {}, []
            for column in wanted:
                self.values[column] = self._of_mapping(column)
                unit = getattr(source.data[column], "attrs", {}).get("units")
                unit = unit or heading(str(column)).unit or None
                if isinstance(unit, str):
                    self.units[column] = unit
            self._check_lengths()
        for column in no_gaps:
            self._check_finite(column)
        for column in wanted:
            self._check_magnitude(column)

    def _of_mapping(self, column: Column) -> "Array":
        data = self._source.data
        try:
            values = np.asarray(data[column], dtype=np.float64)
        except KeyError:
            known = [str(name) for name in data]
            raise ArgumentError("data", unknown("column", str(column), known)) from None
        except (TypeError, ValueError):
            raise ArgumentError("data", f"expected numbers in '{column}'") from None
        if values.ndim != 1 or not values.size:
            raise ArgumentError(
                "data",
                f"expected a list of numbers in '{column}', got an array of shape {values.shape}",
            )
        if np.isinf(values).any():
            raise ArgumentError("data", f"expected finite numbers in '{column}', got inf")
        return values

    def _check_lengths(self) -> None:
        sizes = {str(column): values.size for column, values in self.values.items()}
        if len(set(sizes.values())) > 1:
            found = ", ".join(f"{name} {size}" for name, size in sizes.items())
            raise ArgumentError("data", f"expected columns of one length, got {found}")

    def _check_finite(self, column: Column) -> None:
        bad = np.flatnonzero(~np.isfinite(self.values[column]))
        if bad.size:
            raise ArgumentError("data", f"{self.place(int(bad[0]))}: no number in '{column}'")

    def _check_magnitude(self, column: Column) -> None:
        large = np.flatnonzero(np.abs(self.values[column]) > MAX_NUMBER)
        if large.size:
            row = int(large[0])
            value = self.values[column][row]
            raise ArgumentError("data", f"{self.place(row)}: {_too_large(value)}")

    def place(self, row: int) -> str:
        """Return where a row is, for messages."""
        if isinstance(self._source.data, Path):
            return f"line {self._lines[row]} of '{self._source.data}'"
        return f"row {row}"

    def converted(self, column: Column, own: str) -> float:
        """Return the factor from the unit in the heading of a column to that of the model."""
        try:
            return factor(self.units.get(column, own), own)
        except InputError as error:
            raise ArgumentError("data", f"unit of the column '{column}': {error}") from None


def _too_large(value: float) -> str:
    return f"{value:.3g} is too large; the magnitude must not exceed {MAX_NUMBER:g}"


def measured(source: FitOptions, scenario: "Scenario") -> Measured:
    """Return the data to compare a scenario with, in the units of its channels."""
    if source.over:
        return _of_runs(source, scenario)
    targets = [*_series(source, scenario)] if source.channels else []
    for name, value in source.quantities.items():
        targets.append(_single(source, name, value, source.units.get(name, "")))
    return Measured(tuple(targets), ({},))


def _time_column(source: FitOptions) -> Column:
    """Return the column of times: `time`, or else the first of a file."""
    if source.time is not None or not isinstance(source.data, Path):
        return DEFAULT_TIME if source.time is None else source.time
    try:
        read_columns(source.data, [DEFAULT_TIME], [])
    except NoSuchColumn:
        return 1
    except InputError as error:
        raise ArgumentError("data", str(error)) from None
    return DEFAULT_TIME


def _series(source: FitOptions, scenario: "Scenario") -> list[Target]:
    units = {name: _channel_unit(name, scenario) for name in source.channels}
    column = _time_column(source)
    table = _Table(source, column)
    if source.time_unit:
        size = _said("time_unit", "", source.time_unit, "s")
    else:
        size = table.converted(column, "s")
    times = table.values[column] * size
    times = times + source.time_offset
    _check_times(times, scenario.solver.duration, table, source.time_offset)
    times = np.clip(times, 0.0, scenario.solver.duration)
    targets = []
    for name, of_channel in source.channels.items():
        own = units[name]
        unit = source.units.get(name)
        size = _said("units", f"{name}: ", unit, own) if unit else table.converted(of_channel, own)
        target = _of_column(source, table, name, of_channel, size)
        target = target._replace(of="channel", unit=own, times=times[target.runs])
        read_in = unit or table.units.get(of_channel, own)
        targets.append(target._replace(runs=np.zeros_like(target.runs), data_unit=read_in))
    return targets


def _of_column(
    source: FitOptions, table: "_Table", name: str, column: Column, size: float = 1.0
) -> Target:
    """Return the target of a column, times a factor, each row of which is a run."""
    values = table.values[column] * size
    given = np.isfinite(values)
    if not given.any():
        raise ArgumentError("data", f"no numbers in the column '{column}'")
    unit, rows = source.units.get(name) or table.units.get(column, ""), np.flatnonzero(given)
    return Target(
        name=name,
        of="quantity",
        unit=unit,
        values=values[given],
        sigma=_sigma(source, name, table, size, given),
        times=np.empty(0),
        runs=rows,
        group=name,
        scale=np.full(rows.size, _spread(values[given])),
        column=column,
        data_unit=unit,
    )


def _said(argument: str, where: str, unit: str, own: str) -> float:
    """Return the factor from a unit that was given to that of the model."""
    try:
        return factor(unit, own)
    except InputError as error:
        raise ArgumentError(argument, f"{where}{error}") from None


def _check_times(times: "Array", duration: float, table: _Table, offset: float) -> None:
    late = np.flatnonzero(~(np.diff(times) > 0.0))
    if late.size:
        row = int(late[0]) + 1
        raise ArgumentError(
            "data",
            f"{table.place(row)}: times must increase from row to row, but"
            f" {times[row]:.9g} s follows {times[row - 1]:.9g} s",
        )
    if times[0] < -duration * AT_END or times[-1] > duration * (1.0 + AT_END):
        shifted = f" with the offset of {offset:g} s" if offset else ""
        raise ArgumentError(
            "data",
            f"the times{shifted} are from {times[0]:.9g} s to {times[-1]:.9g} s, the run is from 0"
            f" to {duration:g} s; set solver.duration or the time offset",
        )


def _channel_unit(name: str, scenario: "Scenario") -> str:
    """Return the unit of a channel, which may have a member: `pulley_speed.driven`."""
    base, _, member = name.partition(".")
    if base not in scenario.CHANNELS:
        raise ArgumentError("channels", unknown("channel", base, list(scenario.CHANNELS)))
    channel = scenario.CHANNELS[base]
    if channel.integer:
        raise ArgumentError("channels", f"'{base}' counts or names something; it cannot be fitted")
    if bool(channel.axis) != bool(member):
        wanted = (
            f"has a value for each {channel.axis}; give one, e.g. {base}.NAME"
            if channel.axis
            else f"has one value; give it without '.{member}'"
        )
        raise ArgumentError("channels", f"'{base}' {wanted}")
    return channel.unit


def _spread(values: "Array") -> float:
    """Return the size of the noise that values have at most, as their weights begin with it."""
    sizes = float(np.std(values)), float(np.max(np.abs(values)))
    return next((size for size in sizes if size >= MIN_NUMBER), 1.0)


def _sigma(
    source: FitOptions, name: str, table: "_Table | None", size: float, given: Any
) -> "Array | None":
    """Return the standard deviations of a target; None if none are given."""
    found = source.sigma.get(name)
    if found is None:
        return None
    if isinstance(found, str):
        if table is None:
            raise ArgumentError("sigma", f"{name}: expected a number, got '{found}'")
        values = table.values[found][given] * size
    else:
        values = np.full(int(np.sum(given)), float(found) * size)
    if not (np.isfinite(values) & (values >= MIN_NUMBER)).all():
        raise ArgumentError("sigma", f"{name}: expected standard deviations above 0")
    return values


def _single(source: FitOptions, name: str, value: float, unit: str) -> Target:
    """Return the target of one measured quantity."""
    if abs(value) > MAX_NUMBER:
        raise ArgumentError("quantities", f"{name}: {_too_large(value)}")
    values, one = np.array([float(value)]), np.ones(1, dtype=bool)
    sigma = _sigma(source, name, None, 1.0, one)
    scale = np.abs(values) if abs(value) >= MIN_NUMBER else np.ones(1)  # of a zero there is none
    runs, times = np.zeros(1, dtype=np.int64), np.empty(0)
    return Target(name, "quantity", unit, values, sigma, times, runs, SHARED, scale)


def _of_runs(source: FitOptions, scenario: "Scenario") -> Measured:
    """Return the data of a table each row of which is a run."""
    table = _Table(source, None)
    keys, columns = list(source.over), []
    for key, column in source.over.items():
        own = unit_of_key(type(scenario), key)
        size = table.converted(column, own) if own else 1.0
        columns.append((table.values[column] * size).tolist())
    runs = tuple(dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True))
    targets = [
        _of_column(source, table, name, column) for name, column in source.quantities.items()
    ]
    return Measured(tuple(targets), runs, tuple(keys))
