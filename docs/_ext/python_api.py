"""The reference of the interface for Python, from signatures and docstrings."""

import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from typing import Any

from markdown import table

import frictionsim

UNDERLINE = re.compile(r"^-{3,}$")


def api(name: str, *members: str) -> str:
    """Return the reference of a public name; of a class with these members, or all public ones."""
    member = getattr(frictionsim, name)
    if not inspect.isclass(member):
        return f"### `fs.{name}{_signature(member)}`\n\n{_markdown(member)}"
    parts = [f"### `fs.{name}`", _markdown(member)]
    own = {
        key: value
        for base in reversed(member.__mro__)
        if base.__module__.startswith(frictionsim.__name__)
        for key, value in vars(base).items()
        if not key.startswith("_")
    }
    chosen = {key: getattr(member, key) for key in members} if members else own
    values = {key: value for key, value in chosen.items() if _is_value(value)}
    if values:
        words = {key: _first_paragraph(value) for key, value in values.items()}
        rows = [(f"`.{key}`", text) for key, text in words.items() if text]
        parts.append(table(("property", "what it is"), rows))
    methods = {key: value for key, value in chosen.items() if inspect.isfunction(value)}
    for key, method in methods.items():
        parts.append(f"#### `{name}.{key}{_signature(method)}`\n\n{_markdown(method)}")
    return "\n\n".join(parts)


def errors(*names: str) -> str:
    """Return a table of exceptions with their exit codes."""
    rows = []
    for name in names:
        kind = getattr(frictionsim, name)
        base = kind.__mro__[1].__name__
        rows.append((f"`fs.{name}`", f"`{base}`", str(kind.exit_code), _first_paragraph(kind)))
    return table(("exception", "is also", "exit code", "what it is"), rows)


def _is_value(member: Any) -> bool:
    return isinstance(member, property | cached_property)


def _signature(function: Any) -> str:
    """Return the parameters with their defaults, without types, which the docstring has."""
    signature = inspect.signature(function)
    bare = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for key, parameter in signature.parameters.items()
        if key != "self"
    ]
    return str(signature.replace(parameters=bare, return_annotation=inspect.Signature.empty))


def _first_paragraph(documented: Any) -> str:
    text = inspect.getdoc(documented) or ""
    return _code(text.split("\n\n")[0].replace("\n", " "))


def _markdown(documented: Any) -> str:
    """Return a docstring of numpydoc as Markdown."""
    lines = (inspect.getdoc(documented) or "").splitlines()
    titles = [i for i in range(len(lines) - 1) if UNDERLINE.match(lines[i + 1])]
    parts = [_code("\n".join(lines[: titles[0] if titles else None]).strip())]
    for begin, end in zip(titles, [*titles, None][1:], strict=True):
        entries = "\n".join(_entries(lines[begin + 2 : end]))
        parts.append(f"**{lines[begin]}**\n\n{entries}")
    return "\n\n".join(parts)


def _entries(lines: list[str]) -> Iterator[str]:
    """Yield a list entry for each entry of a section: `name` (type): description."""
    entry: list[str] = []
    for line in [*(line for line in lines if line.strip()), ""]:
        if entry and not line.startswith(" "):
            name, _, kind = entry[0].partition(" : ")
            head = f"- `{name}`" + (f" ({kind})" if kind else "")
            words = _code(" ".join(part.strip() for part in entry[1:]))
            yield f"{head}: {words}" if words else head
            entry = []
        entry.append(line)


def _code(text: str) -> str:
    return text.replace("``", "`")
