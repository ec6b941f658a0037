"""Which files of tests can notice a fault: too many, never too few.

Each file of tests is run once without faults in a process of its own, so that nothing is hidden
there by what another file has left in a cache. It can notice a fault if the changed function was
entered there. Where no profiler of Python looks, more are taken: of a function that goes into
kernels, the files that enter any of belts but by imports; of what is outside of functions, the
files that import its module, as do those that fork; of any fault, those that read the changed file
as a text, those that start a process which imports it, and those that start one which does not
tell.
"""

import ast
from pathlib import Path
from typing import Any

from frictionsim.mechanisms.belt_drive.compilation import SOURCES
from tests.faults.table import Fault

Used = dict[str, Any]  # what one file of tests used, as `plugin` writes it
BELTS = "frictionsim/mechanisms/belt_drive/"  # whose functions alone call kernels
COMPILED = {f"frictionsim/{source}" for source in SOURCES}


def can_notice(fault: Fault, used: dict[str, Used], root: Path) -> list[str]:
    """Return the files of tests that can notice a fault."""
    lines = _changed_function(fault, (root / fault.file).read_text(encoding="utf-8"))
    compiled = lines is not None and fault.file in COMPILED
    seen = [use for use in used.values() if "unseen" not in use["started"]]
    of_belts = [ran for use in seen if (ran := _of_belts(use))]
    imported = set[tuple[str, int]].intersection(*of_belts) if of_belts else set()

    def can(use: Used) -> bool:
        ran = use["ran"].get(fault.file, [])
        told = lines and "fork" not in use["started"]
        entered = any(line in lines for line in ran) if told else bool(ran)
        called = compiled and _of_belts(use) > imported
        return entered or called or "unseen" in use["started"] or fault.file in use["read"]

    return [name for name, use in used.items() if can(use)]


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
