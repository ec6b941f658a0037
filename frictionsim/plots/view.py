"""Views of a kind of mechanism, and the part of a result that they show.

A view shows one instant, a window of time, or some channels.
"""

from collections.abc import Callable, Mapping, Sequence
from math import inf, isfinite
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import BeforeValidator

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.options import Options

if TYPE_CHECKING:
    from frictionsim.results import Record


MAX_DRAWN = 1e100


def _window(given: Any) -> tuple[float | None, float | None]:
    try:
        start, stop = given
    except (TypeError, ValueError):
        raise ValueError(
            f"expected start and end in s, e.g. (0.5, 1.0), got {given!r:.60}"
        ) from None
    start, stop = _second(start), _second(stop)
    if start is not None and stop is not None and start >= stop:
        raise ValueError(f"expected a start before the end, got {start:g} s and {stop:g} s")
    return start, stop


def _second(value: Any) -> float | None:
    if value is None:
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = inf
    if isinstance(value, str | bool) or not isfinite(number):
        raise ValueError(f"expected a time in s, got {value!r:.60}")
    return number


def _channels(given: Any) -> tuple[str, ...]:
    names = given.split(",") if isinstance(given, str) else given
    if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"expected names of channels, e.g. angle,drive_force, got {given!r:.60}")
    wanted = tuple(dict.fromkeys(name.strip() for name in names if name.strip()))
    if not wanted:
        raise ValueError("expected names of channels, e.g. angle,drive_force; got none")
    return wanted


class Extent(Options):
    """The part of a result that is drawn.

    Attributes
    ----------
    time : float or None, s
        The instant to draw; None is the last sample.
    window : pair of float or None, s
        Start and end of the time axis; None is the first or last sample.
    channels : tuple of str
        Channels to draw over time; empty for the default ones of the kind.
    """

    time: Annotated[float | None, BeforeValidator(_second)] = None
    window: Annotated[tuple[float | None, float | None], BeforeValidator(_window)] = (None, None)
    channels: Annotated[tuple[str, ...], BeforeValidator(_channels)] = ()

    @property
    def has_window(self) -> bool:
        """Whether a window of time is given."""
        return self.window != (None, None)

    @property
    def given(self) -> dict[str, bool]:
        """Which of time, window and channels are given."""
        return {
            "time": self.time is not None,
            "window": self.has_window,
            "channels": bool(self.channels),
        }


WHOLE = Extent()


def check_channels(result: "Record", names: Sequence[str]) -> None:
    """Check that a result has channels that are drawn over time."""
    known = [name for name in result.channels if name != "time"]
    for name in names:
        if name == "time":
            raise ArgumentError("channels", "'time' is what the channels are drawn over")
        if name not in known:
            said = unknown("channel", name, known)
            there = "" if "known:" in said else f"; known: {', '.join(known)}"
            raise ArgumentError("channels", f"{said}{there}")


def check_numbers(result: "Record") -> None:
    """Check that no number of a result is so large that a scale of it would overflow."""
    for name, values in [*result.channels.items(), *result.events.items()]:
        if isinstance(values, np.ndarray) and values.dtype.kind == "f":  # not one left in its file
            finite = values[np.isfinite(values)]
            if finite.size and max(finite.max(), -finite.min()) > MAX_DRAWN:
                raise InputError(
                    f"cannot draw this result: '{name}' has numbers above {MAX_DRAWN:g}"
                )


def until(result: "Record", time: float) -> "Record":
    """Return a result up to the last sample that is not after a time.

    Parameters
    ----------
    time : float, s
    """
    samples = np.asarray(result.channels["time"])
    if not samples[0] <= time <= samples[-1]:
        raise ArgumentError(
            "time",
            f"expected a time from {samples[0]:.6g} s to {samples[-1]:.6g} s, which this result"
            f" has samples of, got {time:g} s",
        )
    count = int(np.searchsorted(samples, time, side="right"))
    return result._replace(
        channels=_DrawnPart(result, lambda values, _: values[:count]),
        events=_chosen(result.events, np.asarray(result.events["time"]) <= time),
    )


def within(result: "Record", start: float | None, stop: float | None) -> "Record":
    """Return the part of a result in a window of time.

    At the edges of the window its channels have values between those of the samples around; those
    that are integers, which modes are, have the value of the sample before.

    Parameters
    ----------
    start, stop : float or None, s
        None is the first or last sample.
    """
    samples = np.asarray(result.channels["time"])
    first, last = float(samples[0]), float(samples[-1])
    low, high = first if start is None else start, last if stop is None else stop
    if low >= last or high <= first or low >= high:
        raise InputError(
            f"the window from {low:g} s to {high:g} s shows nothing: this result has samples from"
            f" {first:.6g} s to {last:.6g} s"
        )
    low, high = max(low, first), min(high, last)
    a = int(np.searchsorted(samples, low, side="right")) - 1
    b = int(np.searchsorted(samples, high, side="left"))
    times = samples[a : b + 1].copy()
    edges = _Edges(samples, low, high, a, b)
    times[0], times[-1] = low, high
    at = np.asarray(result.events["time"])
    events = _chosen(result.events, (at >= low) & (at <= high))
    return result._replace(
        channels=_DrawnPart(result, lambda values, name: edges.cut(values, name, result), times),
        events=events,
    )


class _Edges(NamedTuple):
    """A window from `low` to `high`, s, and the samples `a` before and `b` after it."""

    samples: Any
    low: float
    high: float
    a: int
    b: int

    def cut(self, values: Any, name: str, result: "Record") -> Any:
        """Return the values of a channel in the window; of one in a file only these are read."""
        part = np.array(values[self.a : self.b + 1])
        if part.dtype.kind != "f":
            if self.samples[self.b] > self.high:
                part[-1] = part[-2]
            return part
        first = self._between(part[0], part[1], self.a, self.low, name, result)
        last = self._between(part[-2], part[-1], self.b - 1, self.high, name, result)
        part[0], part[-1] = first, last
        return part

    def _between(
        self, before: Any, after: Any, k: int, at: float, name: str, result: "Record"
    ) -> Any:
        """Return the value at a time between samples k and k + 1; they may be events with jumps."""
        start, stop = float(self.samples[k]), float(self.samples[k + 1])
        if at == start:
            return before
        if at == stop:
            return after
        before = _side(result, name, "after", start, before)
        after = _side(result, name, "before", stop, after)
        return before + (at - start) / (stop - start) * (after - before)


def _side(result: "Record", name: str, side: str, time: float, value: Any) -> Any:
    """Return a value of a channel beside an event at a time, or the given one if there is none."""
    values = result.events.get(f"{name}_{side}")
    if values is None:
        return value
    at = np.flatnonzero(np.asarray(result.events["time"]) == time)
    return values[at[-1] if side == "after" else at[0]] if at.size else value


def _chosen(events: Mapping[str, Any], which: Any) -> dict[str, Any]:
    return {name: np.asarray(values)[which] for name, values in events.items()}


class _DrawnPart(dict[str, Any]):
    """The channels of a part of a result, each of which is read when it is needed.

    Parameters
    ----------
    cut : callable
        Of values and name of a channel: the values of the part.
    times : array, optional
        The times of the part.
    """

    def __init__(self, result: "Record", cut: Any, times: Any = None) -> None:
        super().__init__(dict.fromkeys(result.channels))
        self._whole, self._cut = result.channels, cut
        if times is not None:
            super().__setitem__("time", times)

    def __getitem__(self, name: str) -> Any:
        values = super().__getitem__(name)
        if values is None:
            values = self._cut(self._whole[name], name)
            super().__setitem__(name, values)
        return values

    def get(self, name: str, default: Any = None) -> Any:
        try:
            return self[name]
        except KeyError:
            return default

    def items(self) -> Any:
        return ((name, self[name]) for name in self)

    def values(self) -> Any:
        return (value for _, value in self.items())


BODY = "body"  # the view of a body of a belt, and its option


class View(NamedTuple):
    """A picture of a kind.

    Attributes
    ----------
    draw : callable
        `draw(result, figure, **options)` draws a result into an empty figure or subfigure.
    instant, window, channels : bool
        Whether it shows a single instant, a window of time, or other channels than its own.
    overlaid : tuple of str or None
        The channels in which several results are drawn over each other, () for those of a view
        over time; None for a view in which they are not.
    effect : str
        The effect that a result needs for this view; empty if it needs none.
    body : bool
        Whether it shows one body of a belt, which may be chosen.
    whole : bool
        Whether it shows an instant beside the whole result, and takes the result up to that instant
        as `instant`.
    """

    draw: Callable[..., None]
    instant: bool = False
    window: bool = False
    channels: bool = False
    overlaid: tuple[str, ...] | None = None
    effect: str = ""
    body: bool = False
    whole: bool = False

    def shows(self, part: str) -> bool:
        """Return whether it shows the selection by `time`, `window` or `channels` of an extent."""
        return {"time": self.instant, "window": self.window, "channels": self.channels}[part]

    def applicable(self, shown: Extent) -> Extent:
        """Return the part of an extent that it can show."""
        return Extent.of(
            **{
                part: getattr(shown, part)
                for part in shown.given
                if shown.given[part] and self.shows(part)
            }
        )


def over_time(draw: Callable[..., None], overlaid: tuple[str, ...] = ()) -> View:
    """Return a view over time of channels that may be chosen."""
    return View(draw, window=True, channels=True, overlaid=overlaid)
