"""Count the packed and the scalar arithmetic of all loops of belts, for each of their signatures.

Run in a process of its own, it compiles for a processor with vectors of four numbers, whatever it
runs on, and calls nothing: {"press, damping wrap": [packed, scalar], ...} as JSON.
"""

import itertools
import json
import os
import re
import sys
import types
import typing
from inspect import signature
from typing import Any

TARGET = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx,+avx2,+bmi,+bmi2,+fma,+sse4.2"}
ARITHMETIC = r"\bv(?:add|sub|mul|div|fn?m(?:add|sub)\d+|max|min|sqrt|round|cmp\w*)"
PACKED, SCALAR = re.compile(ARITHMETIC + r"pd\b.*%ymm"), re.compile(ARITHMETIC + r"sd\b")


def loops() -> dict[str, Any]:
    """Return the loops of all kernels, by name."""
    from frictionsim.mechanisms.belt_drive.compilation import DISJOINT
    from tests.support.belt_kernels import COMPILED_MODULES

    return {
        name: value
        for module in COMPILED_MODULES
        for name, value in vars(module).items()
        if getattr(getattr(value, "_compiler", None), "pipeline_class", None)
        is DISJOINT["pipeline_class"]
    }


# Arrays of two dimensions, by name.
TABLES = {"pul", "columns", "rims", "matrix", "Dampers.bias"}


def example(kind: Any, name: str) -> Any:
    """Return a value of an annotation: arrays of numbers, and named tuples of them."""
    import numpy as np

    if hasattr(kind, "_fields"):
        hints = typing.get_type_hints(kind)
        own = ((key, f"{kind.__name__}.{key}") for key in kind._fields)
        return kind(*(example(hints[key], key if key in TABLES else of) for key, of in own))
    simple = {int: 8, float: 1.0, bool: True, tuple[float, ...]: (1.0,) * 5}
    return simple[kind] if kind in simple else np.zeros((8, 8) if name in TABLES else 8)


def choices(function: Any) -> dict[str, tuple[Any, ...]]:
    """Return the signatures of a loop: without what may be None, and with it."""
    hints = typing.get_type_hints(function)
    names = list(signature(function).parameters)
    optional = [n for n in names if isinstance(hints[n], types.UnionType)]
    rows = {n for n in optional if hints[n].__args__[0] not in (int, float, bool)}
    found = {}
    for count in range(len(optional) + 1):
        for given in itertools.combinations(optional, count):
            if len(rows.intersection(given)) not in (0, len(rows)):
                continue  # rows that go together
            values = (
                (None if n not in given else example(hints[n].__args__[0], n))
                if n in optional
                else example(hints[n], n)
                for n in names
            )
            found[" ".join(given)] = tuple(values)
    return found


def count() -> dict[str, tuple[int, int]]:
    """Return packed and scalar instructions by loop and what it is given."""
    from numba import typeof

    counts = {}
    for name, loop in loops().items():
        for given, values in choices(loop.py_func).items():
            kinds = tuple(typeof(value) for value in values)
            loop.compile(kinds)
            code = loop.inspect_asm(loop.nopython_signatures[-1].args)
            counts[f"{name}, {given}"] = (len(PACKED.findall(code)), len(SCALAR.findall(code)))
    return counts


if __name__ == "__main__":
    os.environ.update(TARGET)
    json.dump(count(), sys.stdout)
