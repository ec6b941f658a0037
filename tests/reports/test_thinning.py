"""Fewer samples of long channels in the charts of a report: peaks, ends and gaps stay."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.html_elements import data_of, report_of
from tests.support.scenarios import shipped

LIMIT = 4000  # samples of a line


def channels_of(count: int, seed: int) -> dict[str, Any]:
    """Return drawn channels: with a few peaks, huge numbers, and gaps single or long or many."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(size=count))
    huge = rng.uniform(-1e90, 1e90, count)
    noise = rng.uniform(-10.0, 10.0, count)
    single, blocks, many = noise.copy(), walk.copy(), noise.copy()
    single[rng.integers(0, count, 20)] = np.nan
    for start in rng.integers(0, count, 30):
        blocks[start : start + int(rng.integers(1, count // 50))] = np.nan
    many[rng.random(count) < 0.3] = np.nan
    flat = np.zeros(count)
    flat[int(rng.integers(count))] = 1.0
    none = np.full(count, np.nan)
    return {"walk": walk, "huge": huge, "noise": noise, "flat": flat} | {
        "single": single,
        "blocks": blocks,
        "many": many,
        "none": none,
    }


def lines_of(channels: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Return the numbers of the samples in each line of a chart, and their values."""
    record = fs.solve(shipped("pulley", solver__duration=0.1, solver__rtol=1e-6)).record
    count = len(next(iter(channels.values())))
    time = np.linspace(0.0, 0.1, count)
    events = {name: values[:0] for name, values in record.events.items()}
    described = {name: dict.fromkeys(channels, "") for name in ("units", "long_names", "axes")}
    changed = record._replace(channels={"time": time} | channels, events=events, **described)
    data = data_of(report_of(fs.Result(changed)))
    return {
        line["channel"]: (np.searchsorted(time, data["times"][line["time"]]), line["values"])
        for chart in data["charts"]
        for line in chart["lines"]
    }


@pytest.mark.parametrize(("count", "seed"), [(20_000, 0), (4_001, 1), (9_973, 2)])
def test_ends_extremes_and_gaps_of_any_channel_are_kept(count: int, seed: int) -> None:
    channels = channels_of(count, seed)
    lines = lines_of(channels)
    assert lines.keys() >= channels.keys() - {"none"}
    for name, (kept, shown) in lines.items():
        values = channels[name]
        np.testing.assert_array_equal(shown, values[kept])
        assert LIMIT / 8 < len(kept) <= LIMIT, name
        assert (np.diff(kept) > 0).all()
        assert (kept[0], kept[-1]) == (0, count - 1)
        if np.isfinite(values).any():
            assert np.nanmin(shown) == np.nanmin(values)
            assert np.nanmax(shown) == np.nanmax(values)
        finite = kept[np.isfinite(shown)]
        gaps = np.concatenate([[0], np.cumsum(np.isnan(values))])
        gaps_kept = np.concatenate([[0], np.cumsum(np.isnan(shown))])
        at = np.searchsorted(kept, finite)
        for (a, b), (i, j) in zip(pairwise(finite), pairwise(at), strict=True):
            assert (gaps[b] > gaps[a]) == (gaps_kept[j] > gaps_kept[i]), (name, a, b)


def test_the_extremes_of_each_part_are_kept() -> None:
    channels = {name: channels_of(20_000, 3)[name] for name in ("walk", "huge", "noise")}
    width = -(-20_000 // ((LIMIT - 2) // 2))
    for name, (kept, shown) in lines_of(channels).items():
        values = channels[name]
        for start in range(0, len(values), width):
            part = values[start : start + width]
            inside = shown[(kept >= start) & (kept < start + width)]
            assert (inside.min(), inside.max()) == (part.min(), part.max())


def test_a_short_channel_is_kept_whole() -> None:
    (kept, _) = lines_of({"walk": channels_of(LIMIT, 4)["walk"]})["walk"]
    assert kept.tolist() == list(range(LIMIT))
