"""The varied keys of a sweep as axes of a picture, and its runs in their shape."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.ticker import NullLocator

from frictionsim.display import picture_text, study_text, with_unit
from frictionsim.errors import ArgumentError, unknown
from frictionsim.io.sweep_table import RUN, Coordinate, SweepTable
from frictionsim.plots.style import axis_label, set_log_ticks, short_names
from frictionsim.plots.texts import LITERAL, literal
from frictionsim.scenario.model_fields import names_in

MAX_KEY, MAX_WORD = 44, 24  # characters of a label
MAX_LABELS = 20  # of categories along an axis
MAX_TICKS = 6  # at the values of numbers, one beside the other
TICK_DIGITS, MAX_DIGITS = 5, 17  # usual number of digits of a value at a tick; of any double
MAX_SHOWN = 8  # values of a key in a message
VALUE_TOLERANCE = 1e-9  # relative: of a given number and a value of the sweep
MIN_LOG_RATIO = 3.0  # of largest to least value, below which a logarithmic axis shows nothing more
MAX_UNEVENNESS = 1.6  # largest to least step on a logarithmic axis; of 1, 2, 5, 10 it is 1.3
FALSE_TRUE = ("false", "true")


class KeyAxis(NamedTuple):
    """A varied key along an axis.

    Attributes
    ----------
    key, unit : str
    values : (n,)
        In ascending order; of text, or if values are equal, the numbers from 0.
    order : (n,) of int
        The place of each in the sweep.
    labels : tuple of str
        Of text; empty for numbers.
    log : bool
        The numbers are spaced evenly in their logarithms rather than in themselves.
    """

    key: str
    unit: str
    values: Any
    order: Any
    labels: tuple[str, ...] = ()
    log: bool = False

    def label(self, width: int = MAX_KEY) -> str:
        """Return the label of the axis: the key, and the unit of numbers.

        Parameters
        ----------
        width : int
            Of a line, in characters; a longer key is broken after its dots.
        """
        lines = [""]
        for part in re.findall(r"[^.]*\.?", shortened_key(self.key)):
            if lines[-1] and len(lines[-1]) + len(part) > width:
                lines.append("")
            lines[-1] += part
        return axis_label("\n".join(lines), self.unit)

    def text(self, place: int) -> str:
        """Return a value with its unit; `place` is that along the axis."""
        if self.labels:
            return _cut(self.labels[place], MAX_KEY)
        return with_unit(study_text(self.values[place]), self.unit)

    def plain(self, place: int) -> str:
        """Return a value as the argument `at` takes it."""
        return self.labels[place] if self.labels else repr(float(self.values[place]))

    @property
    def edges(self) -> Any:
        """The edges of the cells around the values, halfway between them."""
        values = np.log(self.values) if self.log else self.values.astype(np.float64)
        if values.size == 1:
            half = 0.5 if self.labels or not values[0] else 0.5 * abs(values[0])
            edges = np.array([values[0] - half, values[0] + half])
        else:
            middle = 0.5 * (values[1:] + values[:-1])
            edges = np.concatenate(
                ([2.0 * values[0] - middle[0]], middle, [2.0 * values[-1] - middle[-1]])
            )
        return np.exp(edges) if self.log else edges

    def prepare(self, ax: Any, side: str) -> None:
        """Give the x or y axis of Axes its scale, and ticks at the values of text."""
        axis, set_scale = getattr(ax, f"{side}axis"), getattr(ax, f"set_{side}scale")
        if self.log:
            set_scale("log")
            set_log_ticks(axis, self.values[-1] / self.values[0])
        if self.labels:
            step = -(-len(self.labels) // MAX_LABELS)
            texts = [literal(_cut(label, MAX_WORD)) for label in self.labels[::step]]
            slanted = side == "x" and sum(map(len, texts)) > MAX_WORD
            turned: dict[str, Any] = (
                {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
            )
            axis.set_ticks(self.values[::step], labels=texts, **LITERAL, **turned)
            axis.set_minor_locator(NullLocator())
            getattr(ax, f"set_{side}lim")(self.values[0] - 0.5, self.values[-1] + 0.5)
        elif not self.log and self._are_few():
            ticks, labels = _number_ticks(self.values)
            axis.set_ticks(ticks, labels=labels)

    def _are_few(self) -> bool:
        """Return whether there is room for a tick at each value."""
        if not 1 < self.values.size <= MAX_TICKS:
            return False
        return bool(np.min(np.diff(self.values)) >= np.ptp(self.values) / MAX_TICKS)


def _number_ticks(values: Any) -> tuple[Any, list[str]]:
    """Return ticks at all values with their labels; longer labels that differ fit at the ends."""
    for digits in range(TICK_DIGITS, MAX_DIGITS + 1):
        texts = [picture_text(value, digits) for value in values]
        if len(set(texts)) == len(texts):
            break
        values = values[[0, -1]]
    return values, texts


class Face(NamedTuple):
    """The layout of a grid, or of values varied together, in a picture.

    Attributes
    ----------
    axes : tuple of KeyAxis
        Of the keys with more than one value.
    runs : array of int
        The numbers of the runs in the shape of the axes.
    fixed : tuple of str
        The other keys with their values.
    joined : bool
        Neighbours along the first axis may be joined by lines.
    """

    axes: tuple[KeyAxis, ...]
    runs: Any
    fixed: tuple[str, ...] = ()
    joined: bool = True


def face_of(table: SweepTable, at: Mapping[str, Any]) -> Face:
    """Return the layout of the picture of a sweep over values.

    Parameters
    ----------
    at : mapping
        By key of a grid, the value of those that are not varied in the picture.
    """
    if RUN in table.dimensions:
        if at:
            raise ArgumentError(
                "at", f"it applies to a grid; this sweep is a {table.attributes['design']}"
            )
        return _together(table)
    for key in at:
        if key not in table.dimensions:
            raise ArgumentError("at", unknown("varied key", key, list(table.dimensions)))
    runs: Any = np.arange(table.runs).reshape(table.shape)
    axes: list[KeyAxis] = []
    fixed: list[str] = []
    for key in table.dimensions:
        axis = key_axis(key, table.coordinates[key])
        position = len(axes)
        if key in at or axis.values.size == 1:
            place = _place(table.coordinates[key], axis, at[key]) if key in at else 0
            runs = runs.take(int(axis.order[place]), axis=position)
            fixed.append(f"{shortened_key(key)} = {axis.text(place)}")
        else:
            runs = runs.take(axis.order, axis=position)
            axes.append(axis)
    if not axes:  # a single run, over its first key
        first = key_axis(next(iter(table.dimensions)), next(iter(table.coordinates.values())))
        place = int(np.unravel_index(int(runs), table.shape)[0])
        at_place = int(np.flatnonzero(first.order == place)[0])
        single = first._replace(
            values=first.values[at_place : at_place + 1],
            order=first.order[at_place : at_place + 1],
            labels=first.labels[at_place : at_place + 1],
            log=False,
        )
        if single.labels:
            single = single._replace(values=np.zeros(1))
        return Face((single,), runs.reshape(1), tuple(fixed[1:]), joined=False)
    return Face(tuple(axes), runs, tuple(fixed), joined=not axes[0].labels)


def _together(table: SweepTable) -> Face:
    """Return values together over the first key of numbers; else over the first key."""
    numeric = [
        (key, coordinate)
        for key, coordinate in table.coordinates.items()
        if not isinstance(coordinate.values, list) and not _is_truth(coordinate)
    ]
    if not numeric:
        axis = key_axis(*next(iter(table.coordinates.items())))
        return Face((axis,), axis.order, _note_on_others(table, axis.key), joined=False)
    key, coordinate = numeric[0]
    numbers = np.asarray(coordinate.values, dtype=np.float64)
    order = np.argsort(numbers, kind="stable")
    values = numbers[order]
    distinct = bool((np.diff(values) > 0.0).all())
    axis = KeyAxis(key, coordinate.unit, values, order, (), _is_log(values))
    return Face((axis,), order, _note_on_others(table, key), joined=distinct and values.size > 1)


def _note_on_others(table: SweepTable, key: str) -> tuple[str, ...]:
    """Return the note on the keys that vary together with one."""
    others = [other for other in table.coordinates if other != key]
    return (f"together with {', '.join(short_keys(others))}",) if others else ()


def key_axis(key: str, coordinate: Coordinate) -> KeyAxis:
    """Return the axis of a varied key."""
    values = coordinate.values
    if isinstance(values, list) or _is_truth(coordinate):
        texts = values if isinstance(values, list) else [FALSE_TRUE[int(v)] for v in values]
        places = np.arange(len(texts))
        return KeyAxis(key, "", places.astype(np.float64), places, tuple(texts))
    numbers = np.asarray(values, dtype=np.float64)
    order = np.argsort(numbers, kind="stable")
    if (np.diff(numbers[order]) <= 0.0).any():
        places = np.arange(numbers.size)
        labels = tuple(map(study_text, numbers[order]))
        return KeyAxis(key, coordinate.unit, places.astype(np.float64), order, labels)
    return KeyAxis(key, coordinate.unit, numbers[order], order, (), _is_log(numbers[order]))


def _is_truth(coordinate: Coordinate) -> bool:
    """Return whether a key is true or false; a file has 0 and 1 of one byte instead."""
    return not isinstance(coordinate.values, list) and coordinate.values.dtype in (
        np.bool_,
        np.int8,
    )


def _is_log(values: Any) -> bool:
    """Return whether numbers are spaced evenly in their logarithms, and more so than otherwise."""
    if values.size < 3 or values[0] <= 0.0 or values[-1] < MIN_LOG_RATIO * values[0]:
        return False
    steps, ratios = np.diff(values), np.diff(np.log(values))
    if steps.min() <= 0.0:
        return False
    unevenness = ratios.max() / ratios.min()
    return bool(unevenness < min(MAX_UNEVENNESS, steps.max() / steps.min()))


def _place(coordinate: Coordinate, axis: KeyAxis, wanted: Any) -> int:
    """Return the place of a value along its axis."""
    text = str(wanted).strip()
    if axis.labels and (isinstance(coordinate.values, list) or _is_truth(coordinate)):
        known = [label.strip('"') for label in axis.labels]
        text = text.lower() if _is_truth(coordinate) else text.strip("\"'")
        if text in known:
            return known.index(text)
        shown = list(axis.labels)
    else:
        numbers = np.asarray(coordinate.values, dtype=np.float64)[axis.order]
        try:
            number = float(wanted)
        except (TypeError, ValueError):
            number = float("nan")
        distances = np.abs(numbers - number)
        scale = np.abs(numbers).max()
        if np.isfinite(number) and distances.min() <= VALUE_TOLERANCE * scale:
            return int(np.argmin(distances))
        shown = list(map(study_text, numbers))
    if len(shown) > MAX_SHOWN:
        shown = [*shown[: MAX_SHOWN - 1], "...", shown[-1]]
    raise ArgumentError(
        "at", f"{axis.key}: the sweep has no value {text}; it has {', '.join(shown)}"
    )


def shortened_key(key: str) -> str:
    """Return a key without its first parts if it is too long for a label."""
    if len(key) <= MAX_KEY:
        return key
    if len(names_in(key)) > 1:
        return _cut(short_keys([key])[0], MAX_KEY)
    parts = key.split(".")
    while len(parts) > 1 and len(".".join(parts)) > MAX_KEY - 2:
        parts = parts[1:]
    return _cut(f"… {'.'.join(parts)}", MAX_KEY)


def short_keys(keys: Sequence[str]) -> list[str]:
    """Return the shortest ends of keys that tell them apart, for labels in little space."""
    names = [name for key in keys for name in names_in(key)]
    short = dict(zip(names, short_names(names), strict=True))
    return [", ".join(short[name] for name in names_in(key)) for key in keys]


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"
