"""Which tests can notice a fault: too many, never too few.

Each test is run once without faults in a process of its own. It can notice a fault if the changed
function was entered there. Where no profiler of Python looks, more are taken: of a function that
goes into kernels, the tests that enter any of belts; of what is outside of functions, those that
import its module, as do those that fork; of any fault, those that read the changed file as a text,
those that start a process which imports it, and those that start one which does not tell. Of a file
of tests whose imports can notice the fault, all are taken.
"""

import ast
from pathlib import Path
from typing import Any

from frictionsim.mechanisms.belt_drive.compilation import SOURCES
from tests.faults.table import Fault

Used = dict[str, Any]  # what a test used, as `plugin` writes it, or a file of tests, as `trial`
UNKNOWN: Used = {"ran": {}, "read": [], "started": ["unseen"]}
BELTS = "frictionsim/mechanisms/belt_drive/"  # whose functions alone call kernels
COMPILED = {f"frictionsim/{source}" for source in SOURCES}


def can_notice(fault: Fault, used: dict[str, Used], root: Path) -> list[str]:
    """Return the tests that can notice a fault, and the files of which all tests can."""
    lines = _changed_function(fault, (root / fault.file).read_text(encoding="utf-8"))
    compiled = lines is not None and fault.file in COMPILED
    imports = {name: use["tests"].get("", UNKNOWN) for name, use in used.items()}
    of_belts = [of for one in imports.values() if (of := _of_belts(one))]
    always = set[tuple[str, int]].intersection(*of_belts) if of_belts else set()

    def can(use: Used, imported: bool, known: set[tuple[str, int]]) -> bool:
        ran = use["ran"].get(fault.file, [])
        told = lines and "fork" not in use["started"]
        entered = any(line in lines for line in ran) if told else bool(ran) or imported
        called = compiled and _of_belts(use) > known
        return entered or called or "unseen" in use["started"] or fault.file in use["read"]

    chosen = []
    for name, use in used.items():
        if use["failed"] is None or can(imports[name], False, always):
            chosen.append(name)
            continue
        imported = fault.file in imports[name]["ran"]
        tests = use["tests"].items()
        chosen += [test for test, own in tests if test and can(own, imported, set())]
    return chosen


def _of_belts(use: Used) -> set[tuple[str, int]]:
    """Return the functions of belts that ran, by files and first lines."""
    ran = {(name, line) for name, lines in use["ran"].items() for line in lines}
    return {one for one in ran if one[0].startswith(BELTS)}


def _changed_function(fault: Fault, text: str) -> range | None:
    """Return the lines of the outermost function whose body changes, None if there is none."""
    if not fault.file.endswith(".py"):
        return None
    same = _common(fault.old, fault.new)
    tail = _common(fault.old[same:][::-1], fault.new[same:][::-1])
    start = text.index(fault.old)
    first, last = (
        text.count("\n", 0, place) + 1 for place in (start + same, start + len(fault.old) - tail)
    )
    around = [
        range(min([node.lineno, *(one.lineno for one in node.decorator_list)]), node.end_lineno + 1)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef) and node.end_lineno
        if node.body[0].lineno <= first and last <= node.end_lineno
    ]
    return max(around, key=len, default=None)


def _common(one: str, other: str) -> int:
    """Return how many characters are the same at the beginning."""
    differing = (i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b)
    return next(differing, min(len(one), len(other)))
