"""The measured data of a fit: time series of one run, or a table of runs and their noise."""

from collections.abc import Iterator, Mapping
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.csv_columns import (
    ColumnKey,
    CsvColumn,
    NoSuchColumn,
    read_columns,
)
from frictionsim.scenario.model_fields import description_of
from frictionsim.scenario.options import (
    ColumnsOption,
    Options,
    as_list,
    as_path,
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

# Products and quotients of several such numbers do not overflow.
MAX_NUMBER = 1e50
MIN_NUMBER = 1e-50
STARTS = 3  # local searches
MIN_RESAMPLES = 40  # one of which is beyond each end of a 95 % interval
BOUNDS = "KEY=LOW:HIGH or KEY=LOW:HIGH:START, e.g. effects.shaft_friction.mu_s=0.05:0.4"
AT_END = 1e-9  # of the duration: a time this far outside the run is at its start or end
DEFAULT_TIME = "time"
SHARED = "quantities"  # group of single quantities without sigma, whose errors are relative


# --- what is asked for ---------------------------------------------------------------------------


def _file_or_columns(data: Any) -> Any:
    if isinstance(data, str | PathLike):
        return as_path("data", data)
    if data is not None and not hasattr(data, "keys"):
        raise ValueError(f"expected a CSV file or columns by name, got {type(data).__name__}")
    return data


def _parts(text: str) -> list[str]:
    """Return the texts of the bounds and the start of a key."""
    return text.split(":")


def _finite(name: str, value: Any, hint: str = "") -> float:
    number = value.item() if hasattr(value, "item") else value
    if not isinstance(number, int | float) or isinstance(number, bool) or not isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {value!r}{hint}")
    return float(number)


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
    free: Annotated[dict[str, Any], BeforeValidator(by_name(BOUNDS, _parts))] = Field({})
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
        hint = "; a column needs 'over', whose rows are runs"
        values = by_name("the measured value of each quantity, as NAME=VALUE", number_or_name)(raw)
        return {name: _finite(name, v, hint * isinstance(v, str)) for name, v in values.items()}

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        for argument, fault in self._faults():
            raise inconsistent((argument,), fault)
        return self

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Yield the inconsistent options: the argument and its fault."""
        if 0 < self.bootstrap < MIN_RESAMPLES:
            yield (
                "bootstrap",
                f"expected 0, or at least {MIN_RESAMPLES} resamples for intervals of 95 %, got"
                f" {self.bootstrap}",
            )
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


# --- measured values -----------------------------------------------------------------------------


class Target(NamedTuple):
    """Measured values of a channel or quantity."""

    name: str  # as `angular_velocity`, or `pulley_speed.driven` of a channel with members
    kind: Literal["channel", "quantity"]
    unit: str  # of the channel; of a quantity that of the data, empty if not given
    values: "Array"
    sigma: "Array | None"  # standard deviations
    times: "Array"  # in the run, s; empty for a quantity
    runs: "npt.NDArray[np.int64]"  # the run of each value
    group: str  # values of one group without sigma have one noise level
    scale: "Array"  # reference of their errors until the noise is known
    column: ColumnKey | None = None  # of the data; None for a value given directly
    data_unit: str = ""  # unit of the data as read; empty for that of the quantity
    unit_is_certain: bool = True  # else `unit` may be a part of the column's name


class Measured(NamedTuple):
    """Measured data."""

    targets: tuple[Target, ...]
    runs: tuple[dict[str, float], ...]  # overrides of each run; one empty run for time series
    over: tuple[str, ...] = ()  # the keys of these overrides

    @property
    def times(self) -> "Array":
        """All distinct times of the channels, s, ascending."""
        return np.unique(np.concatenate([t.times for t in self.targets] or [np.empty(0)]))

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


def measured(source: FitOptions, scenario: "Scenario") -> Measured:
    """Return the measured data in the units of the channels of a scenario."""
    if source.over:
        return _run_data(source, scenario)
    targets = _channel_targets(source, scenario) if source.channels else []
    targets += [_quantity_target(source, *given) for given in source.quantities.items()]
    return Measured(tuple(targets), ({},))


class _Columns:
    """Columns of the data, from a file or a mapping."""

    def __init__(self, source: FitOptions, time: ColumnKey | None) -> None:
        self._data = source.data
        no_gaps = [*([] if time is None else [time]), *source.over.values()]
        compared = [*source.channels.values(), *(source.quantities.values() if source.over else ())]
        deviations = [value for value in source.sigma.values() if isinstance(value, str)]
        wanted = list(dict.fromkeys([*no_gaps, *compared, *deviations]))
        self._lines: list[int] = []
        if isinstance(self._data, Path):
            try:
                self._columns, self._lines = read_columns(self._data, wanted, no_gaps)
            except InputError as error:
                raise ArgumentError("data", str(error)) from None
        else:
            self._columns = {column: _mapped(self._data, column) for column in wanted}
        self.values = {name: np.array(self._columns[name].values) for name in wanted}
        sizes = {str(name): values.size for name, values in self.values.items()}
        if len(set(sizes.values())) > 1:
            lengths = ", ".join(f"{name} {size}" for name, size in sizes.items())
            raise ArgumentError("data", f"expected columns of one length, got {lengths}")
        for name, values in self.values.items():
            gaps = np.flatnonzero(np.isnan(values))
            if name in no_gaps and gaps.size:
                raise ArgumentError("data", f"{self.place(gaps[0])}: no number in '{name}'")
            large = np.flatnonzero(np.abs(values) > MAX_NUMBER)
            if large.size:
                fault = _too_large(values[large[0]])
                raise ArgumentError("data", f"{self.place(large[0])}: {fault}")

    def place(self, row: int) -> str:
        """Return the position of a row, for messages."""
        return f"line {self._lines[row]} of '{self._data}'" if self._lines else f"row {row}"

    def column(self, name: ColumnKey) -> CsvColumn:
        """Return a column with its unit."""
        return self._columns[name]

    def unit_factor(self, name: ColumnKey, model_unit: str) -> float:
        """Return the factor from the unit in the heading of a column to that of the model."""
        try:
            return self._columns[name].factor(model_unit)
        except InputError as error:
            raise ArgumentError("data", f"{error}; a unit that is given counts instead") from None


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
        raise ArgumentError(
            "data", f"expected a list of numbers in '{name}', got an array of shape {values.shape}"
        )
    if np.isinf(values).any():
        raise ArgumentError("data", f"expected finite numbers in '{name}', got inf")
    _, unit, is_certain = heading(str(name))
    attribute = getattr(data[name], "attrs", {}).get("units")
    if isinstance(attribute, str) and attribute:
        unit, is_certain = attribute, True
    return CsvColumn(values.tolist(), 0, unit, f"unit of the column '{name}'", is_certain)


def _too_large(value: float) -> str:
    return f"{value:.3g} is too large; the magnitude must not exceed {MAX_NUMBER:g}"


def _channel_targets(source: FitOptions, scenario: "Scenario") -> list[Target]:
    units = {name: _channel_unit(name, scenario) for name in source.channels}
    time_column = _time_column(source)
    columns = _Columns(source, time_column)
    if source.time_unit:
        size = _given_factor("time_unit", "", source.time_unit, "s")
    else:
        size = columns.unit_factor(time_column, "s")
    duration = scenario.solver.duration
    times = columns.values[time_column] * size + source.time_offset
    _check_times(times, duration, columns, source.time_offset)
    times = np.clip(times, 0.0, duration)
    targets = []
    for name, column in source.channels.items():
        unit, model_unit = source.units.get(name), units[name]
        if unit:
            size = _given_factor("units", f"{name}: ", unit, model_unit)
        else:
            size = columns.unit_factor(column, model_unit)
        target = _column_target(source, columns, name, column, size)
        targets.append(
            target._replace(
                kind="channel",
                unit=model_unit,
                times=times[target.runs],
                runs=np.zeros_like(target.runs),
                data_unit=unit or columns.column(column).unit_in(model_unit) or model_unit,
            )
        )
    return targets


def _channel_unit(name: str, scenario: "Scenario") -> str:
    """Return the unit of a channel, which may have a member: `pulley_speed.driven`."""
    base, _, member = name.partition(".")
    if base not in scenario.CHANNELS:
        raise ArgumentError("channels", unknown("channel", base, list(scenario.CHANNELS)))
    channel = scenario.CHANNELS[base]
    if channel.integer:
        raise ArgumentError("channels", f"'{base}' counts or names something; it cannot be fitted")
    if channel.axis and not member:
        wanted = f"has a value for each {channel.axis}; give one, e.g. {base}.NAME"
        raise ArgumentError("channels", f"'{base}' {wanted}")
    if member and not channel.axis:
        raise ArgumentError("channels", f"'{base}' has one value; give it without '.{member}'")
    return channel.unit


def _time_column(source: FitOptions) -> ColumnKey:
    """Return the column of times: `time`, or else the first of a file."""
    if source.time is not None:
        return source.time
    if isinstance(source.data, Path):
        try:
            read_columns(source.data, [DEFAULT_TIME], [])
        except NoSuchColumn:
            return 1
        except InputError as error:
            raise ArgumentError("data", str(error)) from None
    return DEFAULT_TIME


def _given_factor(argument: str, where: str, unit: str, model_unit: str) -> float:
    """Return the factor from a given unit to that of the model."""
    try:
        return factor(unit, model_unit)
    except InputError as error:
        raise ArgumentError(argument, f"{where}{error}") from None


def _check_times(times: "Array", duration: float, columns: _Columns, offset: float) -> None:
    late = np.flatnonzero(~(np.diff(times) > 0.0))
    if late.size:
        row = int(late[0]) + 1
        raise ArgumentError(
            "data",
            f"{columns.place(row)}: times must increase from row to row, but"
            f" {times[row]:.9g} s follows {times[row - 1]:.9g} s",
        )
    if times[0] < -duration * AT_END or times[-1] > duration * (1.0 + AT_END):
        shifted = f" with the offset of {offset:g} s" if offset else ""
        raise ArgumentError(
            "data",
            f"the times{shifted} are from {times[0]:.9g} s to {times[-1]:.9g} s, the run is from 0"
            f" to {duration:g} s; set solver.duration, the time unit or the time offset",
        )


def _column_target(
    source: FitOptions, columns: _Columns, name: str, column: ColumnKey, size: float = 1.0
) -> Target:
    """Return the target of a column, multiplied by a factor; each row is a run."""
    values = columns.values[column] * size
    rows = np.flatnonzero(np.isfinite(values))
    if not rows.size:
        raise ArgumentError("data", f"no numbers in the column '{column}'")
    sizes = float(np.std(values[rows])), float(np.max(np.abs(values[rows])))
    spread = next((size for size in sizes if size >= MIN_NUMBER), 1.0)
    found = columns.column(column)
    given = source.units.get(name, "")
    is_certain = bool(given) or found.is_certain
    return Target(
        name=name,
        kind="quantity",
        unit=given or found.unit,
        values=values[rows],
        sigma=_sigma(source, name, size, columns, rows, given or found.unit),
        times=np.empty(0),
        runs=rows,
        group=name,
        scale=np.full(rows.size, spread),
        column=column,
        data_unit=(given or found.unit) if is_certain else "",
        unit_is_certain=is_certain,
    )


def _sigma(
    source: FitOptions,
    name: str,
    size: float,
    columns: _Columns | None,
    rows: Any,
    data_unit: str = "",
) -> "Array | None":
    """Return the standard deviations of a target, in the unit of its data; None without any."""
    sigma = source.sigma.get(name)
    if sigma is None:
        return None
    if isinstance(sigma, str) and columns is not None:
        own = columns.column(sigma)
        if own.is_certain and own.unit and data_unit and own.unit != data_unit:
            raise ArgumentError(
                "sigma",
                f"{name}: the column '{sigma}' is in {own.unit}, the data are in {data_unit}; give"
                " both in one unit",
            )
        values = columns.values[sigma][rows] * size
    else:
        values = np.full(len(rows), sigma * size if isinstance(sigma, int | float) else np.nan)
    if not (np.isfinite(values) & (values >= MIN_NUMBER)).all():
        column = f" in the column '{sigma}'" if isinstance(sigma, str) and columns else ""
        found = column or f", got {sigma!r}"
        raise ArgumentError("sigma", f"{name}: expected standard deviations above 0{found}")
    return values


def _quantity_target(source: FitOptions, name: str, value: float) -> Target:
    """Return the target of one measured quantity."""
    if abs(value) > MAX_NUMBER:
        raise ArgumentError("quantities", f"{name}: {_too_large(value)}")
    values, runs = np.array([value]), np.zeros(1, dtype=np.int64)
    scale = np.abs(values) if abs(value) >= MIN_NUMBER else np.ones(1)  # no relative error of 0
    unit, sigma = source.units.get(name, ""), _sigma(source, name, 1.0, None, runs)
    return Target(name, "quantity", unit, values, sigma, np.empty(0), runs, SHARED, scale)


def _run_data(source: FitOptions, scenario: "Scenario") -> Measured:
    """Return the data of a table whose rows are runs."""
    columns = _Columns(source, None)
    values = []
    for key, column in source.over.items():
        model_unit = description_of(type(scenario), key)[0]
        size = columns.unit_factor(column, model_unit) if model_unit else 1.0
        values.append((columns.values[column] * size).tolist())
    runs = (dict(zip(source.over, row, strict=True)) for row in zip(*values, strict=True))
    targets = (_column_target(source, columns, *named) for named in source.quantities.items())
    return Measured(tuple(targets), tuple(runs), tuple(source.over))
