"""Samples that become segments: the same numbers, and little memory."""

from typing import Any

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.simulation import sample_store
from frictionsim.simulation.sample_store import SampleStore, rows_per_segment

TYPES = {"x": np.float64, "sticking": np.int8}
COLUMNS = 4


class SegmentsInMemory:
    """Segments as the store wants them."""

    place = "memory"

    def __init__(self) -> None:
        self.written: dict[int, dict[str, Any]] = {}
        self.checksum = 0
        self.failure: Exception | None = None

    def check_places(self, count: int) -> None:
        """They are in memory."""

    def write(self, number: int, record: Any) -> None:
        assert number == len(self.written)
        self.written[number] = {name: values.copy() for name, values in record.items()}
        self.checksum += 1

    def rows(self, number: int, name: str, start: int, stop: int) -> Any:
        return self.written[number][name][start:stop]

    def channels(self, names: list[str], count: int) -> list[dict[str, Any]]:
        return [{name: self.written[n][name] for name in names} for n in range(count)]

    def listing(self, rows: int) -> str:
        return ""

    def free_bytes(self) -> int:
        return 10**12

    def restore(self, count: int, checksum: int) -> bool:
        self.written = {n: v for n, v in self.written.items() if n < count}
        self.checksum = count
        return checksum == count


def store_in(segments: SegmentsInMemory | None) -> SampleStore:
    store = SampleStore(TYPES)
    if segments is not None:
        store.put_into(segments, lambda arrays: arrays)  # type: ignore[arg-type,return-value]
    return store


def sample(i: int) -> dict[str, Any]:
    x = np.arange(COLUMNS) + 0.1 * i
    return {"time": 1e-3 * i, "x": x, "sticking": (x > 3.0) * 1.0, "energy": 0.5 * i, "_power": x}


def filled(count: int, segments: SegmentsInMemory | None = None, start: int = 0) -> SampleStore:
    store = store_in(segments)
    for i in range(start, start + count):
        store.append(sample(i))
    return store


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> int:
    """Have segments of few samples; return how many."""
    row_bytes = COLUMNS * (8 + 1)
    monkeypatch.setattr(sample_store, "MIN_ROW_BYTES", 1)
    monkeypatch.setattr(sample_store, "SEGMENT_BYTES", 16 * row_bytes + 5)
    return rows_per_segment(row_bytes)


def assert_same(store: SampleStore, count: int) -> None:
    whole = filled(count)
    assert len(store) == len(whole) == count
    names = whole.names
    arrays, expected = store.arrays(names, count), whole.arrays(names, count)
    for name in names:
        assert np.array_equal(arrays[name], expected[name]), name
        assert np.array_equal(store.channel(name, count)[-1], expected[name][-1])
    assert list(arrays) == names
    assert store.gain("energy") == whole.gain("energy")
    assert np.array_equal(store.first("x"), whole.first("x"))


@pytest.mark.parametrize("count", [1, 15, 16, 17, 32, 33, 100, 700])
def test_samples_in_segments_are_those_in_memory(count: int, small: int) -> None:
    assert small == 16
    segments = SegmentsInMemory()
    store = filled(count, segments)
    # The last segment is written when there is a sample after it.
    assert len(segments.written) == (count - 1) // small
    assert_same(store, count)
    if segments.written:
        assert segments.written[0]["sticking"].dtype == np.int8


def test_memory_does_not_grow_with_the_samples(small: int) -> None:
    held = []
    for count in (100, 10_000):
        store = filled(count, SegmentsInMemory())
        held.append(sum(values.nbytes for values in store._latest.values()))
    assert held[0] == held[1]
    assert len(filled(10_000)._latest["x"]) >= 10_000  # without segments it does


@pytest.mark.parametrize("count", [5, 16, 17, 50])
def test_a_store_is_restored_from_its_state(count: int, small: int) -> None:
    segments = SegmentsInMemory()
    state = filled(count, segments).state()
    again = store_in(segments)
    again.restore(state, sample(0), 1.0)
    for i in range(count, count + 40):
        again.append(sample(i))
    assert_same(again, count + 40)


def test_the_state_does_not_grow_with_the_samples(small: int) -> None:
    sizes = [
        sum(np.asarray(v).nbytes for v in filled(n, SegmentsInMemory()).state().values())
        for n in (small + 1, 100 * small + 1)
    ]
    assert sizes[0] == sizes[1]


def test_samples_of_a_state_without_segments_become_segments(small: int) -> None:
    segments = SegmentsInMemory()
    again = store_in(segments)
    again.restore(filled(100).state(), sample(0), 1.0)
    again.append(sample(100))
    assert len(segments.written) == 100 // small
    assert_same(again, 101)


def test_refuses_a_state_whose_segments_are_not_to_be_had(small: int) -> None:
    state = filled(50, SegmentsInMemory()).state()
    with pytest.raises(
        InputError, match="does not belong to this scenario or was changed: 'stored'"
    ):
        SampleStore(TYPES).restore(state, sample(0), 1.0)


@pytest.mark.parametrize("bad", [0, 3, 16, 17, 40, 49])
def test_the_first_sample_that_is_non_finite_is_found_in_segments_too(bad: int, small: int) -> None:
    for segments in (None, SegmentsInMemory()):
        store = store_in(segments)
        for i in range(50):
            # An integer in the file: it must not be looked for there.
            broken = {"sticking": np.full(COLUMNS, np.nan)} if i == bad else {}
            store.append({**sample(i), **broken})
        assert store.n_finite() == bad
    assert filled(50, SegmentsInMemory()).n_finite() == 50
