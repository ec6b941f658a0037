"""The measured data of a fit: time series of one run, or a table of runs and their noise."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from math import isfinite, nan
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.arguments import ColumnKey, as_path
from frictionsim.scenario.csv_columns import CsvColumn, NoSuchColumn, read_columns
from frictionsim.scenario.model_fields import description_of
from frictionsim.scenario.options import (
    ColumnsOption,
    Options,
    as_list,
    by_name,
    columns_of,
    function_of,
    number_or_name,
)
from frictionsim.scenario.schema import inconsistent, unit_field
from frictionsim.scenario.units import factor, heading

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Array
    from frictionsim.scenario.settings import Scenario

MIN_NUMBER, MAX_NUMBER = 1e-50, 1e50  # products and quotients of several such do not overflow
STARTS = 3  # local searches
MIN_RESAMPLES = 40  # one of which is beyond each end of a 95 % interval
BOUNDS = "KEY=LOW:HIGH or KEY=LOW:HIGH:START, e.g. effects.shaft_friction.mu_s=0.05:0.4"
AT_END = 1e-9  # of the duration: a time this far outside the run is at its start or end
DEFAULT_TIME = "time"


def _file_or_columns(data: Any) -> Any:
    if isinstance(data, str | PathLike):
        return as_path("data", data)
    if data is not None and not hasattr(data, "keys"):
        raise ValueError(f"expected a CSV file or columns by name, got {type(data).__name__}")
    return data


class FitOptions(Options):
    """The data of a fit, their columns that are fitted, and the settings of the search."""

    data: Annotated[Any, BeforeValidator(_file_or_columns)] = None
    channels: ColumnsOption = Field({})
    over: ColumnsOption = Field({})
    quantities: dict[str, Any] = Field({})  # values; with `over` columns
    sigma: Annotated[dict[str, Any], BeforeValidator(by_name("NAME=VALUE", number_or_name))] = (
        Field({})
    )
    units: Annotated[dict[str, str], BeforeValidator(by_name("NAME=UNIT", str))] = Field({})
    time: str | int | None = None
    time_unit: str | None = None
    time_offset: float = unit_field("s", "Offset added to the times of the data.", 0.0)
    free: Annotated[
        dict[str, Any], BeforeValidator(by_name(BOUNDS, lambda text: text.split(":")))
    ] = Field({})
    starts: int = Field(STARTS, ge=1)
    seed: int = Field(0, ge=0)
    bootstrap: int = Field(0, ge=0)
    progress: Annotated[Any, function_of("a number")] = None

    @field_validator("quantities", mode="before")
    @classmethod
    def _values_or_columns(cls, raw: Any, info: ValidationInfo) -> dict[str, Any]:
        if info.data.get("over"):
            return columns_of(raw)
        raw = raw if isinstance(raw, Mapping) else as_list(raw)
        wanted = "the measured value of each quantity, as NAME=VALUE"
        given: dict[str, Any] = by_name(wanted, number_or_name)(raw)
        return given

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        for argument, fault in self._faults():
            raise inconsistent((argument,), fault)
        return self

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Yield the inconsistent options: the argument and its fault."""
        if 0 < self.bootstrap < MIN_RESAMPLES:
            wanted = f"expected 0, or at least {MIN_RESAMPLES} resamples for intervals of 95 %"
            yield "bootstrap", f"{wanted}, got {self.bootstrap}"
        compared = [*self.channels, *self.quantities]
        if not compared:
            yield "channels", "expected a channel or quantity that was measured; none is given"
        if self.over and self.channels:
            fault = "the rows of the data are runs, or times of channels; leave out one of them"
            yield "over", fault
        if self.data is None and (self.channels or self.over):
            yield "data", "missing; expected a CSV file or columns by name"
        for argument, named in (("sigma", self.sigma), ("units", self.units)):
            for name in (name for name in named if name not in compared):
                yield argument, unknown("channel or quantity", name, compared)
        for name in (name.strip() for key in self.free for name in str(key).split(",")):
            if name in self.over:
                yield "over", f"'{name}' is free, too; the data give it or the fit does"


class Target(NamedTuple):
    """Measured values of a channel or quantity."""

    name: str  # as `angular_velocity`, or `pulley_speed.driven` of a channel with members
    unit: str  # of the channel; of a quantity that of the data, empty if not given
    values: "Array"
    sigma: "Array | None"  # standard deviations
    scale: "Array"  # reference of their errors until the noise is known
    runs: "npt.NDArray[np.int64]"  # the run of each value
    times: "Array"  # in the run, s; empty for a quantity
    column: ColumnKey | None = None  # of the data; None for a value given directly
    data_unit: str = ""  # unit of the data as read; empty for that of the quantity
    unit_is_certain: bool = True  # else `unit` may be a part of the column's name

    @property
    def kind(self) -> Literal["channel", "quantity"]:
        """What was measured."""
        return "channel" if self.times.size else "quantity"


class Measured(NamedTuple):
    """Measured data."""

    targets: tuple[Target, ...]
    runs: tuple[dict[str, float], ...]  # overrides of each run; one empty run for time series
    over: tuple[str, ...] = ()  # the keys of these overrides

    @property
    def times(self) -> "Array":
        """All distinct times of the channels, s, ascending."""
        return np.unique(np.concatenate([t.times for t in self.targets]))

    @property
    def values(self) -> "Array":
        """The values of all targets (n,)."""
        return np.concatenate([target.values for target in self.targets])

    @property
    def scale(self) -> "Array":
        """Reference of the errors of all values (n,)."""
        return np.concatenate([target.scale for target in self.targets])

    @property
    def size(self) -> int:
        """The number of values."""
        return sum(target.values.size for target in self.targets)


def measured(source: FitOptions, scenario: "Scenario", drawn: bool = False) -> Measured:
    """Return the measured data in the units of the channels of a scenario.

    Those that are `drawn` may have times in any order; of them those beyond the run are left out.
    """
    if source.over:
        return _run_data(source, scenario)
    targets = _channel_targets(source, scenario, drawn) if source.channels else []
    targets += [_quantity_target(source, *given) for given in source.quantities.items()]
    return Measured(tuple(targets), ({},))


@contextmanager
def _faults_of(argument: str, before: str = "", after: str = "") -> Iterator[None]:
    """Name the argument that a fault is of."""
    try:
        yield
    except InputError as error:
        raise ArgumentError(argument, f"{before}{error}{after}") from None


class _Columns:
    """Columns of the data, from a file or a mapping; some may have no gaps."""

    def __init__(self, source: FitOptions, no_gaps: Collection[ColumnKey]) -> None:
        self._data, self._lines = source.data, list[int]()
        compared = [*source.channels.values(), *(source.quantities.values() if source.over else ())]
        deviations = [value for value in source.sigma.values() if isinstance(value, str)]
        wanted = list(dict.fromkeys([*no_gaps, *compared, *deviations]))
        if isinstance(self._data, Path):
            with _faults_of("data"):
                self.columns, self._lines = read_columns(self._data, wanted, no_gaps)
        else:
            self.columns = {column: _mapped(self._data, column) for column in wanted}
        self.values = {name: np.array(self.columns[name].values) for name in wanted}
        if len({values.size for values in self.values.values()}) > 1:
            lengths = ", ".join(f"{name} {values.size}" for name, values in self.values.items())
            raise ArgumentError("data", f"expected columns of one length, got {lengths}")
        for name, values in self.values.items():
            if name in no_gaps and (gaps := np.isnan(values)).any():
                raise ArgumentError("data", f"{self.place(gaps.argmax())}: no number in '{name}'")
            if (large := np.abs(values) > MAX_NUMBER).any():
                row = large.argmax()
                raise ArgumentError("data", f"{self.place(row)}: {_too_large(values[row])}")

    def place(self, row: Any) -> str:
        """Return the position of a row, for messages."""
        return f"line {self._lines[row]} of '{self._data}'" if self._lines else f"row {row}"

    def size(
        self, column: ColumnKey, model_unit: str, given: str | None, argument: str, where: str = ""
    ) -> float:
        """Return the size of a given unit, or that of a column, in the unit of the model."""
        if given:
            with _faults_of(argument, where):
                return factor(given, model_unit)
        with _faults_of("data", after="; a unit that is given counts instead"):
            return self.columns[column].factor(model_unit)


def _mapped(data: Any, name: ColumnKey) -> CsvColumn:
    """Return a column of a mapping; its unit is in the attributes of an array or in the name."""
    try:
        values = np.asarray(data[name], dtype=np.float64)
    except KeyError:
        known = [str(one) for one in data]
        raise ArgumentError("data", unknown("column", str(name), known)) from None
    except (TypeError, ValueError):
        raise ArgumentError("data", f"expected numbers in '{name}'") from None
    if values.ndim != 1 or not values.size:
        found = f"got an array of shape {values.shape}"
        raise ArgumentError("data", f"expected a list of numbers in '{name}', {found}")
    if np.isinf(values).any():
        raise ArgumentError("data", f"expected finite numbers in '{name}', got inf")
    _, unit, is_certain = heading(str(name))
    if attribute := getattr(data[name], "attrs", {}).get("units"):
        unit, is_certain = str(attribute), True
    return CsvColumn(values.tolist(), 0, unit, f"unit of the column '{name}'", is_certain)


def _too_large(value: float) -> str:
    return f"{value:.3g} is too large; the magnitude must not exceed {MAX_NUMBER:g}"


def _channel_targets(source: FitOptions, scenario: "Scenario", drawn: bool) -> list[Target]:
    units = {name: _channel_unit(name, scenario) for name in source.channels}
    time = _time_column(source)
    columns = _Columns(source, [time])
    times = columns.values[time] * columns.size(time, "s", source.time_unit, "time_unit")
    times = times + source.time_offset
    half = 0.5 * scenario.solver.duration
    outside = np.abs(times - half) > half * (1.0 + 2.0 * AT_END)
    if drawn and not outside.all():
        for values in columns.values.values():
            values[outside] = nan  # a gap
    else:
        times = _checked_times(times, scenario, columns, source.time_offset)
    targets = []
    for name, column in source.channels.items():
        if columns.columns[column] == columns.columns[time]:  # of a file also by name and number
            fault = f"{name}: column '{column}' has the times; expected another one of its values"
            raise ArgumentError("channels", fault)
        unit, given = units[name], source.units.get(name)
        size = columns.size(column, unit, given, "units", f"{name}: ")
        target = _column_target(source, columns, name, column, size)
        one_run, read = np.zeros_like(target.runs), given or columns.columns[column].unit_in(unit)
        target = target._replace(unit=unit, runs=one_run, times=times[target.runs])
        targets.append(target._replace(data_unit=read or unit, unit_is_certain=True))
    return targets


def _channel_unit(name: str, scenario: "Scenario") -> str:
    """Return the unit of a channel, which may have a member: `pulley_speed.driven`."""
    base, _, member = name.partition(".")
    fault = ""
    if base not in scenario.CHANNELS:
        raise ArgumentError("channels", unknown("channel", base, list(scenario.CHANNELS)))
    channel = scenario.CHANNELS[base]
    if channel.integer:
        fault = "counts or names something; it is not measured"
    elif channel.axis and not member:
        fault = f"has a value for each {channel.axis}; give one, e.g. {base}.NAME"
    elif member and not channel.axis:
        fault = f"has one value; give it without '.{member}'"
    if fault:
        raise ArgumentError("channels", f"'{base}' {fault}")
    return channel.unit


def _time_column(source: FitOptions) -> ColumnKey:
    """Return the column of times: `time`, or else the first of a file."""
    if source.time is not None:
        return source.time
    if isinstance(source.data, Path):
        with _faults_of("data"), suppress(NoSuchColumn):
            read_columns(source.data, [DEFAULT_TIME], [])
            return DEFAULT_TIME
        return 1
    return DEFAULT_TIME


def _checked_times(
    times: "Array", scenario: "Scenario", columns: _Columns, offset: float
) -> "Array":
    """Return times within the run, of which the ends may be off by their rounding."""
    duration = scenario.solver.duration
    if (late := ~(np.diff(times) > 0.0)).any():
        row = int(late.argmax()) + 1
        pair = f"{times[row]:.9g} s follows {times[row - 1]:.9g} s"
        fault = f"{columns.place(row)}: times must increase from row to row, but {pair}"
        raise ArgumentError("data", fault)
    if times[0] < -duration * AT_END or times[-1] > duration * (1.0 + AT_END):
        shifted = f" with the offset of {offset:g} s" if offset else ""
        raise ArgumentError(
            "data",
            f"the times{shifted} are from {times[0]:.9g} s to {times[-1]:.9g} s, the run is from 0"
            f" to {duration:g} s; set solver.duration, the time unit or the time offset",
        )
    return np.clip(times, 0.0, duration)


def _column_target(
    source: FitOptions, columns: _Columns, name: str, column: ColumnKey, size: float = 1.0
) -> Target:
    """Return the target of a column, multiplied by a factor; each row is a run."""
    all_values = columns.values[column] * size
    rows = np.flatnonzero(np.isfinite(all_values))
    if not rows.size:
        raise ArgumentError("data", f"no numbers in the column '{column}'")
    values = all_values[rows]
    sizes = float(np.std(values)), float(np.max(np.abs(values)))
    spread = next((size for size in sizes if size >= MIN_NUMBER), 1.0)
    given, found = source.units.get(name, ""), columns.columns[column]
    unit, is_certain = given or found.unit, bool(given) or found.is_certain
    sigma, deviations = source.sigma.get(name), None
    if isinstance(sigma, str):
        own = columns.columns[sigma]
        if own.is_certain and own.unit and unit and own.unit != unit:
            both = f"is in {own.unit}, the data are in {unit}; give both in one unit"
            raise ArgumentError("sigma", f"{name}: the column '{sigma}' {both}")
        deviations = _deviations(name, columns.values[sigma][rows] * size, f" in '{sigma}'")
    elif sigma is not None:
        deviations = _deviations(name, np.full(rows.size, sigma * size), f", got {sigma!r}")
    read, scale = unit if is_certain else "", np.full(rows.size, spread)
    no_times = np.empty(0)
    return Target(name, unit, values, deviations, scale, rows, no_times, column, read, is_certain)


def _deviations(name: str, values: "Array", found: str) -> "Array":
    """Return standard deviations if they are usable; `found` is for the message."""
    if not (np.isfinite(values) & (values >= MIN_NUMBER)).all():
        raise ArgumentError("sigma", f"{name}: expected standard deviations above 0{found}")
    return values


def _quantity_target(source: FitOptions, name: str, given: Any) -> Target:
    """Return the target of one measured quantity."""
    value = given.item() if hasattr(given, "item") else given
    if not isinstance(value, int | float) or isinstance(value, bool) or not isfinite(value):
        hint = "; a column needs 'over', whose rows are runs" * isinstance(given, str)
        fault = f"{name}: expected a finite number, got {given!r}{hint}"
        raise ArgumentError("quantities", fault)
    if abs(value) > MAX_NUMBER:
        raise ArgumentError("quantities", f"{name}: {_too_large(value)}")
    values, sigma = np.array([float(value)]), source.sigma.get(name)
    scale = np.abs(values) if abs(value) >= MIN_NUMBER else np.ones(1)  # no relative error of 0
    if sigma is not None:
        number = sigma if isinstance(sigma, int | float) else nan
        sigma = _deviations(name, np.array([number]), f", got {sigma!r}")
    run = np.zeros(1, dtype=np.int64)
    return Target(name, source.units.get(name, ""), values, sigma, scale, run, np.empty(0))


def _run_data(source: FitOptions, scenario: "Scenario") -> Measured:
    """Return the data of a table whose rows are runs."""
    columns = _Columns(source, source.over.values())
    values = []
    for key, column in source.over.items():
        model_unit = description_of(type(scenario), key)[0]
        size = columns.size(column, model_unit, None, "over") if model_unit else 1.0
        values.append((columns.values[column] * size).tolist())
    runs = (dict(zip(source.over, row, strict=True)) for row in zip(*values, strict=True))
    targets = (_column_target(source, columns, *named) for named in source.quantities.items())
    return Measured(tuple(targets), tuple(runs), tuple(source.over))
