"""Mechanisms at an instant: what is drawn are the forces and places of the result."""

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from frictionsim.results import Record
from tests.support.records import draw, shown

VIEW = {"pulley_return": "mechanism", "lift": "mechanism", "shaft": "friction_circle"}


def drawn(record: Record, view: str, **options: Any) -> Figure:
    figure = draw(record, view, **options)
    figure.draw_without_rendering()
    return figure


def key_of(figure: Figure) -> list[str]:
    return [text.get_text().replace("\n", " ") for text in figure.legends[0].get_texts()]


def scale_bar(ax: Any) -> dict[str, float]:
    """Return the lengths of the bars of the scale, m, by their words."""
    lengths = [np.ptp(line.get_xdata()) for line in ax.lines if line.get_marker() == "|"]
    words = [text.get_text() for text in ax.texts if text.get_text().endswith((" m", " N"))]
    return dict(zip(words, lengths, strict=True))


def test_the_key_has_each_force_with_its_size_at_the_instant() -> None:
    record = shown("pulley_return")
    k = int(np.searchsorted(record.time, 1.0))
    key = key_of(drawn(record, "mechanism", time=float(record.time[k])))
    force = record.channels["drive_force"][k]
    assert f"drive force, {force:.4g} N" in key
    assert "weight of the load, 2224 N" in key
    assert f"reaction of the shaft, {force + 2224.1:.4g} N" in key


@pytest.mark.parametrize("name", VIEW)
def test_arrows_of_two_stills_of_a_run_are_on_one_scale(name: str) -> None:
    """The bar of the scale is as long, per newton, at the start as where forces are largest."""
    record = shown(name)
    largest = int(np.argmax(record.channels["shaft_reaction"]))
    per_newton, widths = [], []
    for time in (record.time[0], record.time[largest]):
        figure = drawn(record, VIEW[name], time=float(time))
        ((words, length),) = [
            bar for bar in scale_bar(figure.axes[1]).items() if bar[0].endswith(" N")
        ]
        per_newton.append(length / float(words.removesuffix(" N")))
        widths.append(figure.axes[1].get_xlim())
    assert per_newton[0] == pytest.approx(per_newton[1], rel=1e-9)
    assert widths[0] == pytest.approx(widths[1], rel=1e-9)
