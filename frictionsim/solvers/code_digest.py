"""A digest of code outside of this package, with all that compiled code takes from what it names.

It is of what is in memory, as that is compiled: a source may have been edited since it was
imported, or there may be none. Of a function it has the instructions and what is behind each name
in them: functions, methods of classes and of those that they inherit from, constants, and these of
modules. What Python, numpy and numba have is known by its name, and their versions by other means.
"""

import sys
from array import array
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from enum import Enum
from functools import partial
from hashlib import sha256
from inspect import getattr_static
from types import CodeType, FunctionType, ModuleType
from typing import Any

PACKAGE = __package__.partition(".")[0]
KNOWN = {*sys.stdlib_module_names, PACKAGE, "numpy", "numba", "llvmlite"}
PLAIN = (int, float, complex, bool, str, bytes, type(None))
# Whether two of these are one object is chance.
CONSTANT = (*PLAIN, tuple, frozenset, CodeType)

Reached = tuple[Any, frozenset[str]]
"""A value, and the names in the function that names it: of a module only these are used."""


def is_known(module: Any) -> bool:
    """Return whether a module is of this package, or one whose version says what it has."""
    return str(module).partition(".")[0] in KNOWN


def code_digest(roots: Iterable[Any], replaced: Mapping[Any, Any]) -> str:
    """Return the digest of functions and classes.

    Parameters
    ----------
    roots : iterable
    replaced : mapping
        What is compiled in the place of some functions.
    """
    digest, seen = sha256(), dict[Any, tuple[int, Any]]()
    left: deque[Reached] = deque((root, frozenset()) for root in roots)
    while left:
        value, names = left.popleft()
        if not isinstance(value, CONSTANT):
            key = (id(value), names if isinstance(value, ModuleType) else None)
            if key in seen:
                digest.update(f"seen {seen[key][0]}".encode())
                continue
            seen[key] = len(seen), value  # which stays alive, as does its id
        text, parts = _described(value, names)
        if isinstance(value, FunctionType) and value in replaced:
            parts.append((replaced[value], frozenset()))
        digest.update(f"{len(parts)} {text!r}".encode())
        left += parts
    return digest.hexdigest()


def _described(value: Any, names: frozenset[str]) -> tuple[Any, list[Reached]]:
    """Return what a value is as text, and its parts."""
    kind = type(value)
    what: Any = f"{kind.__module__}.{kind.__qualname__}"
    parts: list[Any] = []
    if isinstance(value, PLAIN):
        what = what, value
    elif isinstance(value, ModuleType):
        members = {} if is_known(value.__name__) else vars(value)
        used = sorted(names & members.keys())
        return (what, value.__name__, used), [(members[name], names) for name in used]
    elif isinstance(value, FunctionType | type):
        what = what, value.__module__, value.__qualname__
        if not is_known(value.__module__):
            return what, _parts_of_class(value) if isinstance(value, type) else _parts_of(value)
    elif isinstance(value, CodeType):
        what = what, value.co_code, value.co_names, value.co_varnames, value.co_argcount
        parts = [*value.co_consts]
    elif isinstance(value, tuple | list):
        parts = [*value] if kind in (tuple, list) else [kind, *value]
    elif isinstance(value, set | frozenset):
        parts = sorted(value, key=repr)
    elif isinstance(value, Enum):
        what, parts = (what, value.name), [value.value]
    elif isinstance(value, array):
        what = what, value.typecode, value.tobytes()
    elif isinstance(value, partial):
        parts = [value.func, value.args, sorted(value.keywords.items())]
    elif isinstance(value, staticmethod | classmethod):
        parts = [value.__func__]
    elif kind.__module__ == "numpy" and hasattr(value, "dtype"):
        content = b"" if value.dtype.hasobject else value.tobytes()
        what = what, value.dtype.str, value.shape, content
    elif isinstance(getattr_static(value, "py_func", None), FunctionType):
        parts = [value.py_func]  # that numba or a belt's kernel compiles
    elif is_known(kind.__module__):
        what = what, getattr(value, "__name__", "")
    return what, [(part, frozenset()) for part in parts]


def _parts_of_class(value: type) -> list[Reached]:
    return [
        (part, frozenset())
        for base in value.__mro__
        if not is_known(base.__module__)
        for member in sorted(vars(base).items())
        if not member[0].startswith("__")
        for part in member
    ]


def _parts_of(function: FunctionType) -> list[Reached]:
    names = frozenset(_names_in(function.__code__))
    named = sorted(names & function.__globals__.keys())
    parts: list[Any] = [function.__code__, function.__defaults__, tuple(named)]
    parts += map(function.__globals__.get, named)
    for cell in function.__closure__ or ():
        with suppress(ValueError):  # it is empty
            parts.append(cell.cell_contents)
    return [(part, names) for part in parts]


def _names_in(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names_in(constant)
