"""Fewer samples of long channels: peaks, ends and gaps stay."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from frictionsim.reports.run_charts import MIN_LIMIT, thinned

NUMBERS = st.one_of(st.floats(-1e300, 1e300), st.just(float("nan")))
CHANNELS = st.one_of(
    arrays(float, st.integers(0, 300), elements=NUMBERS),
    arrays(float, st.integers(0, 300), elements=st.floats(-10.0, 10.0)),
)
LIMITS = st.integers(MIN_LIMIT, 120)


@given(CHANNELS, LIMITS)
def test_ends_extremes_and_gaps_of_any_channel_are_kept(values: np.ndarray, limit: int) -> None:
    kept = thinned(values, limit)
    assert len(kept) <= max(limit, 0)
    assert (np.diff(kept) > 0).all()
    if not len(values):
        return
    assert (kept[0], kept[-1]) == (0, len(values) - 1)
    if np.isfinite(values).any():
        assert np.nanmin(values[kept]) == np.nanmin(values)
        assert np.nanmax(values[kept]) == np.nanmax(values)
    finite = kept[np.isfinite(values[kept])]
    for a, b in pairwise(finite):
        crosses_a_gap = np.isnan(values[a:b]).any()
        assert crosses_a_gap == np.isnan(values[kept[(kept > a) & (kept < b)]]).any()


@given(arrays(float, st.integers(60, 300), elements=st.floats(-1e6, 1e6)), st.integers(10, 50))
def test_the_extremes_of_each_part_are_kept(values: np.ndarray, limit: int) -> None:
    kept = thinned(values, limit)
    width = -(-len(values) // ((limit - 2) // 2))
    for start in range(0, len(values), width):
        part = values[start : start + width]
        inside = values[kept[(kept >= start) & (kept < start + width)]]
        assert (inside.min(), inside.max()) == (part.min(), part.max())


def test_a_short_channel_is_kept_whole() -> None:
    assert thinned(np.arange(50.0), 50).tolist() == list(range(50))


def test_a_limit_without_room_for_a_part_is_refused() -> None:
    with pytest.raises(ValueError, match="a line needs at least 7 samples, not 3"):
        thinned(np.arange(50.0), 3)
