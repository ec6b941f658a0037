"""Blocks of runs: their sizes, and what becomes of those whose worker dies."""

import pytest

from frictionsim.parameter_study.dispatch import BlockSizes


def sizes_of(runs: int, seconds: object, together: int, workers: int = 2) -> list[int]:
    """Return the sizes of the blocks of a sweep whose blocks take `seconds(size)`."""
    sizes, left, blocks = BlockSizes(0.3, runs, together), runs, []
    assert callable(seconds)
    while left:
        size = min(sizes.next(workers), left)
        sizes.dispatch(size)
        sizes.learn(size, seconds(size))
        left -= size
        blocks.append(size)
    return blocks


def in_one_go(alone: float) -> object:
    """Return the time of blocks whose passes take as long as ten runs alone, and little more."""
    return lambda size: size * alone if size < 50 else 10 * alone + size * alone / 20


def test_runs_alone_take_blocks_of_time() -> None:
    sizes = sizes_of(10_000, lambda size: 0.01 * size, 1)
    assert sizes[:3] == [1, 30, 30]
    assert max(sizes) == 30
    assert sizes_of(5, lambda size: 60.0 * size, 1) == [1] * 5


@pytest.mark.parametrize("alone", [1e-3, 3e-3, 0.01, 0.03])
def test_runs_go_together_however_slow_the_machine_is(alone: float) -> None:
    sizes = sizes_of(20_000, in_one_go(alone), 50)
    # The last block may have what is too little for one of its own.
    assert min(sizes[1:]) >= 50
    # What a block costs however many runs it has is shared by several times the fewest.
    assert sum(sizes[1:]) / len(sizes[1:]) > 100
    assert max(sizes) <= 2000


def test_long_runs_go_alone() -> None:
    assert set(sizes_of(300, in_one_go(1.0), 50)) == {1}


def test_a_block_that_is_long_is_not_followed_by_longer_ones() -> None:
    sizes = sizes_of(20_000, lambda size: 0.02 * size, 50)
    assert max(sizes[:-1]) == 50


def test_small_blocks_at_the_end_teach_nothing() -> None:
    sizes = BlockSizes(0.3, 100_000, 50)
    sizes.learn(1000, 0.2)
    before = sizes.next(2)
    sizes.learn(50, 0.2)
    assert sizes.next(2) == before
