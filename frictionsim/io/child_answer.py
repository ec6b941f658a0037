"""Answers of the child process that reads files: an .npz without pickled data.

It holds the arrays by number, and `tree`, the rest in JSON, which refers to them. A malicious file
may control the child: nothing in its answer is executed, and only the classes below are created.
"""

import io
from json import dumps
from typing import Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.cost_table import CostTable
from frictionsim.io.sweep_table import Coordinate, SobolIndices, SweepTable
from frictionsim.results import Check, Column, Quantity, Record, SolverStatistics
from frictionsim.scenario.toml_data import json_value

MAX_TREE = 2**30  # bytes of `tree`, half of the memory of the child


class Checkpoint(NamedTuple):
    """The data to resume a run: the attributes of its file and the state of its solver."""

    attributes: dict[str, str]
    state: dict[str, Any]


class LongChannel(NamedTuple):
    """A channel that is read by rows."""

    shape: tuple[int, ...]
    dtype: str


class JournalPart(NamedTuple):
    """Blocks of runs of a journal, one after the other."""

    units: dict[str, str]  # of the quantities, by name
    words: list[str]  # the texts of runs, each once
    columns: list[list[int]]  # numbers in `units` of the quantities that blocks have
    blocks: Any  # (n, 4): first run, the one after the last, number in `columns`, number of texts
    texts: Any  # (m, 3): number in TEXTS, run, number in `words`
    status: Any  # of each block those of its runs
    values: Any  # of each block (quantities, runs)
    rest: tuple[int, int] | None  # `last` and `free` of the next part; None at the end


class Refusal(NamedTuple):
    """The reason to refuse a file."""

    message: str


CLASSES: dict[str, Any] = {
    cls.__name__: cls
    for cls in (
        *(Record, Check, Quantity, SolverStatistics, Checkpoint, LongChannel, Refusal),
        *(JournalPart, SweepTable, Coordinate, SobolIndices, CostTable, Column),
    )
}


def encoded(answer: Any) -> bytes:
    """Return the bytes of an answer."""
    arrays: dict[str, Any] = {}
    tree = dumps(_tree_of(answer, arrays)).encode()
    file = io.BytesIO()
    np.savez(file, tree=np.frombuffer(tree, np.uint8), **arrays)
    return file.getvalue()


def _tree_of(value: Any, arrays: dict[str, Any]) -> Any:
    """Return a value as plain data; types that JSON lacks become an object with one key."""
    if isinstance(value, np.ndarray):
        name = str(len(arrays))
        arrays[name] = value
        return {"array": name}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {"dict": [[key, _tree_of(inner, arrays)] for key, inner in value.items()]}
    if isinstance(value, list | tuple):
        items = [_tree_of(inner, arrays) for inner in value]
        name = type(value).__name__
        return items if name == "list" else {name: items}
    return value


def decoded(answer: bytes) -> Any:
    """Decode an answer.

    Raises
    ------
    InputError
        If the child refused the file.
    Exception
        Of any type, if the bytes are not an answer.
    """
    with np.load(io.BytesIO(answer), allow_pickle=False) as arrays:
        value = _value_of(json_value(arrays["tree"].tobytes(), MAX_TREE), arrays)
    if isinstance(value, Refusal):
        raise InputError(str(value.message))
    return value


def _value_of(tree: Any, arrays: Any) -> Any:
    if isinstance(tree, list):
        return [_value_of(inner, arrays) for inner in tree]
    if not isinstance(tree, dict):
        return tree
    ((name, inner),) = tree.items()
    if name == "array":
        return arrays[inner]
    if name == "dict":
        return {key: _value_of(value, arrays) for key, value in inner}
    items = [_value_of(value, arrays) for value in inner]
    return tuple(items) if name == "tuple" else CLASSES[name](*items)
