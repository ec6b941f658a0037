"""Blocks of outcomes as bytes, which may come from anyone."""

import json

import numpy as np
import pytest

from frictionsim.parameter_study.block import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    LENGTH_BYTES,
    Block,
    Outcome,
    block_of,
)
from frictionsim.results import Quantity

pytestmark = pytest.mark.quick

OUTCOMES = [
    Outcome(DONE, {"a": Quantity(1.5, "m"), "b": Quantity(None, "s")}),
    Outcome(FAILED, {"c": Quantity(-0.0, "1")}, "diverged", "it left", "one\ntwo"),
    Outcome(AUDIT_FAILED, {"a": Quantity(2.5, "m")}),
]


def test_a_block_comes_back() -> None:
    block = block_of(7, OUTCOMES)
    found = Block.from_bytes(block.to_bytes())
    assert (found.first, found.units, found.texts) == (7, block.units, block.texts)
    assert found.texts["failure"] == {8: "diverged"}
    assert np.array_equal(found.status, block.status)
    assert found.values.tobytes() == block.values.tobytes()


def changed(**head: object) -> bytes:
    """Return the bytes of a block with another head."""
    image = block_of(7, OUTCOMES).to_bytes()
    end = LENGTH_BYTES + int.from_bytes(image[:LENGTH_BYTES], "big")
    new = json.dumps(json.loads(image[LENGTH_BYTES:end]) | head).encode()
    return len(new).to_bytes(LENGTH_BYTES, "big") + new + image[end:]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("first", value) for value in (-1, "7", 7.0, 10**30)),
        *(("count", value) for value in (0, 2, 4, 10**15, True)),
        *(("units", value) for value in (["m", "s", "1"], {"a": 1, "b": 2, "c": 3}, {})),
        *(("texts", [["failure", *more]]) for more in ((6, "x"), (10, "x"), (8, 9), ())),
        *(("texts", value) for value in ([["elsewhere", 8, "x"]], 5)),
    ],
)
def test_a_head_that_does_not_fit_is_refused(key: str, value: object) -> None:
    with pytest.raises(ValueError):  # noqa: PT011  whatever is wrong, it is no block
        Block.from_bytes(changed(**{key: value}))


def test_no_other_bytes_are_a_block() -> None:
    image = block_of(7, OUTCOMES).to_bytes()
    end = LENGTH_BYTES + int.from_bytes(image[:LENGTH_BYTES], "big")
    status = bytearray(image)
    status[end] = 0  # of a run that was not run
    deep = b"[" * 100_000
    for bad in (
        b"",
        image[:3],
        image[:-1],
        image + b"\0",
        bytes(status),
        b"\xff\xff\xff\xff" + image,
        len(deep).to_bytes(4, "big") + deep,
    ):
        with pytest.raises(ValueError):  # noqa: PT011
            Block.from_bytes(bad)
