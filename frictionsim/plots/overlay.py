"""Several results of one kind in the same panels over time, with a key.

Each panel has one channel, of one member where the channel has several, as the speed of each
pulley: so each line is a result, which differs from the others in colour and in dashes. Sticking
phases and events of unlike results would hide one another if they were shaded: above the panels
each result has a row with its number, a bar for each sticking phase and a tick for each event.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from frictionsim.display import GREY, study_text, with_unit
from frictionsim.errors import ArgumentError, InputError
from frictionsim.plots.style import (
    MAX_LINES,
    POINTS,
    Style,
    add_legend,
    label,
    line_style,
    set_title,
    short_overrides,
    text_scale,
)
from frictionsim.plots.sweep_axes import short_keys
from frictionsim.plots.time_history import (
    MAX_MARKS,
    MAX_PANELS,
    channels_of,
    label_flags,
    panel_heights,
    panels_over_time,
)
from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.model_fields import description_of
from frictionsim.scenario.toml_data import keys_and_values, scenario_of
from frictionsim.simulation.record import sticking_phases, with_jumps

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

MAX_KEYS = 2  # in a label; results that differ in more have their names
UNLABELLED = ("title", "$schema")
ROW, NUMBER = 8.0, 6.5  # points, of the rows above the panels and of their numbers


class Overlaid(NamedTuple):
    """One of several results: the name of its file, and its record."""

    name: str
    record: "Record"


class _ChannelPanel(NamedTuple):
    """A channel, and the number of the member that is drawn; None if it has no members."""

    channel: str
    member: int | None = None


def check_overlay(results: Sequence[Overlaid]) -> None:
    """Check that results can be drawn into the same panels."""
    if len(results) > MAX_LINES:
        raise InputError(
            f"cannot draw {len(results)} results over each other: {MAX_LINES} are the most that"
            " can be told apart; give fewer"
        )
    first = results[0]
    for other in results[1:]:
        kinds = [one.record.attributes["kind"] for one in (first, other)]
        if kinds[0] != kinds[1]:
            raise InputError(
                f"cannot draw results of unlike kinds over each other: {first.name} is of kind"
                f" '{kinds[0]}', {other.name} of kind '{kinds[1]}'"
            )


def overlay(
    results: Sequence[Overlaid],
    figure: "Figure | SubFigure",
    view_channels: Sequence[str] = (),
    channels: Sequence[str] = (),
) -> None:
    """Draw channels of several results over time.

    Parameters
    ----------
    view_channels : sequence of str
        The channels that are drawn; by default those of the kind that all results have.
    channels : sequence of str
        Those that are drawn instead.
    """
    panels = _panels([one.record for one in results], view_channels, channels)
    first = results[0].record
    titles = {one.record.attributes["title"] or one.record.attributes["kind"] for one in results}
    title = titles.pop() if len(titles) == 1 else first.attributes["kind"]
    each = [short_overrides(one.record.attributes) for one in results]
    common = [text for text in each[0] if all(text in texts for texts in each)]
    words = f"{title} ({'; '.join([*common, f'{len(results)} results'])})"
    set_title(figure, words, panel_heights(len(panels)))
    axes = panels_over_time(figure, [_label(first, panel) for panel in panels])
    for ax, panel in zip(axes, panels, strict=True):
        for number, one in enumerate(results):
            _draw(ax, one.record, panel, number)
        if panel.member is None and panel.channel in first.flags:
            label_flags(ax, first, panel.channel)
    names = labels_of(results)
    marks = _mark(axes[0], results)
    handles = [
        Line2D([], [], **line_style(number), label=f"{number + 1}: {name}" if marks else name)
        for number, name in enumerate(names)
    ]
    add_legend(figure, [*handles, *marks], columns=3)


def _panels(
    results: Sequence["Record"], view_channels: Sequence[str], channels: Sequence[str]
) -> list[_ChannelPanel]:
    for result in results[1:]:
        for name in channels:
            if name not in result.channels:
                raise ArgumentError("channels", f"not all of these results have '{name}'")
    first = results[0]
    names = channels_of(first, channels) if channels or not view_channels else list(view_channels)
    common = [name for name in names if all(name in result.channels for result in results)]
    if not common:
        raise InputError(
            f"these results have none of the channels {', '.join(names)} in common (see"
            " output.channels)"
        )
    panels = []
    for name in common:
        axis = first.axes[name]
        members = {result.members[axis] if axis else () for result in results}
        if len(members) > 1:
            raise InputError(
                f"cannot draw '{name}' of these results over each other: their members differ"
                f" ({'; '.join(', '.join(names) for names in sorted(members))})"
            )
        numbers: list[int | None] = [*range(len(first.members[axis]))] if axis else [None]
        panels += [_ChannelPanel(name, number) for number in numbers]
    if len(panels) > MAX_PANELS:
        raise ArgumentError(
            "channels",
            f"expected at most {MAX_PANELS} panels, got {len(panels)}, one for each channel and"
            " member; choose fewer channels",
        )
    return panels


def _label(result: "Record", panel: _ChannelPanel) -> str:
    if panel.member is None:
        return label(result, panel.channel)
    member = str(result.members[result.axes[panel.channel]][panel.member])
    return label(result, panel.channel, f"{panel.channel.replace('_', ' ')},\n{member}")


def _draw(ax: Any, result: "Record", panel: _ChannelPanel, number: int) -> None:
    time, values = with_jumps(result, panel.channel)
    if panel.member is not None:
        values = values[:, panel.member]
    ax.plot(time, values, **line_style(number))


def _mark(ax: Any, results: Sequence[Overlaid]) -> list[Any]:
    """Draw a row for each result above the first panel; return legend handles.

    The rows have the order of the legend, and its numbers at their ends: in grey print neither
    colours nor the dashes of short bars tell them apart.
    """
    phases, events, row = False, False, 0
    for number, one in reversed(list(enumerate(results))):  # from the panel upwards
        colour = line_style(number)["color"]
        sticks = list(sticking_phases(one.record))
        times = one.record.events["time"]
        times = times if len(times) <= MAX_MARKS else times[:0]
        if not sticks and not len(times):
            continue
        row += 1
        up = ScaledTranslation(0.0, ROW * row * text_scale() / POINTS, ax.figure.dpi_scale_trans)
        place: Style = {
            "transform": ax.get_xaxis_transform() + up,
            "clip_on": False,
            "color": colour,
        }
        for phase in sticks:
            ax.plot(phase, [1.0, 1.0], **place, linewidth=2.0, solid_capstyle="butt")
        if len(times):  # a line without points would have its box at the corner of the figure
            ax.plot(times, [1.0] * len(times), **place, marker="|", markersize=5.0, linestyle="")
        ax.annotate(
            str(number + 1),
            (1.0, 1.0),
            (4.0, ROW * row * text_scale()),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center_baseline",
            fontsize=NUMBER * text_scale(),
        )
        phases, events = phases or bool(sticks), events or bool(len(times))
    handles = []
    if phases:
        handles.append(Line2D([], [], color=GREY, linewidth=2.0, label="bars: sticking"))
    if events:
        mark: Style = {"color": GREY, "linestyle": "", "marker": "|", "markersize": 5.0}
        handles.append(Line2D([], [], **mark, label="ticks: events"))
    return handles


def labels_of(results: Sequence[Overlaid]) -> list[str]:
    """Return labels that tell results apart: values of the keys in which they differ, or names."""
    by_key = _labels_by_key([one.record for one in results])
    if by_key and len(set(by_key)) == len(results):
        return by_key
    stems = [Path(one.name).stem for one in results]
    names = stems if len(set(stems)) == len(results) else [one.name for one in results]
    if len(set(names)) == len(results):
        return names
    return [f"{name} ({number})" for number, name in enumerate(names, 1)]


def _labels_by_key(results: Sequence["Record"]) -> list[str]:
    """Return the values of the keys that differ; an empty list if these are none or too many."""
    try:
        scenarios = [_labelled_values(result) for result in results]
    except InputError:
        return []
    keys = list(dict.fromkeys(key for values in scenarios for key in values))
    differing = [key for key in keys if len({repr(values.get(key)) for values in scenarios}) > 1]
    if not 0 < len(differing) <= MAX_KEYS:
        return []
    units = _units(results[0], differing)
    words = short_keys(differing)
    return [
        ", ".join(
            f"{word} = {_value(values.get(key), units[key])}"
            for key, word in zip(differing, words, strict=True)
        )
        for values in scenarios
    ]


def _labelled_values(result: "Record") -> dict[str, Any]:
    """Return the values of the scenario of a result by their keys with dots."""
    scenario = scenario_of(result)
    tables = {name: value for name, value in scenario.items() if name not in UNLABELLED}
    leaves = keys_and_values(tables, lists="all")
    return {key: value for key, value in leaves if value not in ({}, [])}


def _units(result: "Record", keys: Sequence[str]) -> dict[str, str]:
    try:
        scenario = validate(scenario_of(result), Path())
    except ValidationFailure:
        return dict.fromkeys(keys, "")
    units = {}
    for key in keys:
        try:
            units[key] = description_of(type(scenario), key)[0]
        except (InputError, KeyError, AttributeError, TypeError):
            units[key] = ""
    return units


def _value(value: Any, unit: str) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).lower() if isinstance(value, bool) else str(value)
    return with_unit(study_text(value), unit)
