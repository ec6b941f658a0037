"""Scenarios to start from: the values of an example, with the meaning of all keys as comments."""

import json
import re
from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from frictionsim.errors import InputError
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import LAWS, laws_of, methods_of
from frictionsim.scenario.model_fields import holds, key_names, models_in, table_model
from frictionsim.scenario.parsed_text import toml_tables
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.shipped import shipped_scenarios
from frictionsim.scenario.signal_tables import FORMS_BESIDE_NUMBER, AngleTable, SpeedTable

WIDTH = 100  # characters of a line, where words can be wrapped
MAX_COLUMN = 34  # of the comments beside keys
MIN_COMMENT = 40  # characters; a comment with less room goes below its key
# Described last: how a scenario is solved comes after what it is.
LAST = ("solver", "output")
# The key that stands for a name which the scenario is free to choose.
FREE_NAME = "NAME"


class _WrittenNumber(float):
    """A number with the text that it was written as, such as 2.4e-4."""

    def __new__(cls, text: str) -> "_WrittenNumber":
        number = super().__new__(cls, text)
        number.text = text
        return number

    text: str


class _Examples(NamedTuple):
    """The scenarios of a kind that come with it.

    Attributes
    ----------
    first : dict
        The one whose values are taken.
    all : tuple of dict
        Those that are searched for values of what the first one does not have.
    """

    first: dict[str, Any]
    all: tuple[dict[str, Any], ...]

    def table(self, path: tuple[str, ...]) -> dict[str, Any]:
        """Return a table of the first scenario that has it; empty if none has."""
        for example in self.all:
            found: Any = example
            for key in path:
                found = found.get(key) if isinstance(found, dict) else None
            if isinstance(found, dict):
                return found
        return {}


def new_scenario(kind: str) -> str:
    """Return the text of a scenario of a kind, commented, to start from.

    Its values are those of the shipped scenario of that name, or of the text `EXAMPLE` in the
    module of the kind. Other keys and effects are there as comments, with their defaults.

    Returns
    -------
    str
        A scenario in TOML, which is valid as it is.
    """
    model: type[Scenario] = mechanism_module(kind).SCENARIO
    template = _Template(model, _examples(kind))
    lines = [*_heading(kind, model), *template.table((), model, template.examples.first)]
    return "\n".join(lines).rstrip("\n") + "\n"


def schema_file(kind: str) -> str:
    """Return the name of the schema of a kind beside the scenarios of a user."""
    return f"{kind}.schema.json"


def _examples(kind: str) -> _Examples:
    own = getattr(mechanism_module(kind), "EXAMPLE", None)
    if own is not None:
        values = toml_tables(own, _WrittenNumber)
        return _Examples(values, (values,))
    texts = [path.read_text(encoding="utf-8") for path in shipped_scenarios().values()]
    found = [toml_tables(text, _WrittenNumber) for text in texts]
    names = list(shipped_scenarios())
    if kind not in names:
        raise InputError(
            f"there is no example of kind '{kind}' to start from: its module defines none as"
            " EXAMPLE"
        )
    first = found[names.index(kind)]
    return _Examples(first, (first, *(data for data in found if data["kind"] == kind)))


def _heading(kind: str, model: type[Scenario]) -> Iterator[str]:
    """Yield the lines above the first key: how to use this file, and what there is to choose."""
    file = schema_file(kind)
    yield from _prose(
        f"The line `#:schema ./{file}` at the top of a file has editors complete and check it;"
        f" `frictionsim schema {kind} > {file}` writes that schema."
    )
    yield "#"
    yield from _prose(
        "All values are in SI units, or in the unit that a key ends with. Keys that are commented"
        " out may be left out; a value there is the default, one without a value has none. A table"
        " [effects.NAME] that is left out is an effect that is not simulated; one that is commented"
        " out is an example."
    )
    of_motion = AngleTable in _models_below(model)
    forms = FORMS_BESIDE_NUMBER["<number or of motion>" if of_motion else "<number>"]
    yield from _prose(f"A signal is a number, or {forms}.")
    effects = model.model_fields.get("effects")
    table = effects and table_model(effects.annotation)
    if table:
        yield "#"
        yield from _prose(f"Effects: {', '.join(key_names(table))}.")
    yield "#"
    yield "# Friction laws (effects.NAME.law), and the backends for each (solver.backend):"
    for law in laws_of(model.PAIRS):
        yield f"#   {law}: {LAWS.get(law, '')}".rstrip(": ")
        yield f"#     {', '.join(methods_of(model.PAIRS, law))}"
    yield ""


def _models_below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """Yield the models of all tables in a model."""
    for field in model.model_fields.values():
        for inner in models_in(field.annotation):
            yield inner
            yield from _models_below(inner)


def _prose(text: str) -> list[str]:
    return [f"# {line}" for line in wrap(text, WIDTH - 2, break_on_hyphens=False)]


class _Template:
    """Writes tables with the values of examples."""

    def __init__(self, scenario: type[Scenario], examples: _Examples) -> None:
        self.examples = examples
        self._scenario = scenario

    def table(
        self,
        path: tuple[str, ...],
        model: type[BaseModel],
        values: Mapping[str, Any],
        header: tuple[str, ...] = (),
    ) -> list[str]:
        """Return the lines of a table, and of the tables in it, with an empty line after each.

        Parameters
        ----------
        path : tuple of str
            The keys that lead to it.
        model : type
        values : mapping
        header : tuple of str
            Its first lines; none for the keys above the first table.
        """
        fields = sorted(model.model_fields.items(), key=lambda item: item[0] in LAST)
        named = [(field.alias or name, field) for name, field in fields]
        keys = [(name, field) for name, field in named if table_model(field.annotation) is None]
        # A key that takes nothing is there only to be refused with a reason.
        keys = [(name, field) for name, field in keys if field.annotation is not type(None)]
        rows = [self._row(name, field, values) for name, field in keys]
        rows.sort(key=lambda row: row[0].startswith("# "))  # what may be left out is last
        lines = [*header] if rows or not named else []
        lines += _beside(rows)
        if lines:
            lines.append("")
        for name, field in named:
            inner = table_model(field.annotation)
            if inner is not None:
                lines += self._tables((*path, name), field, inner, values.get(name))
        return lines

    def _tables(
        self, path: tuple[str, ...], field: FieldInfo, model: type[BaseModel], value: Any
    ) -> list[str]:
        """Return the lines of the tables that a key holds: one, one for each name, or a list."""
        about = _about(field, model)
        if holds(field.annotation, dict):
            named = {FREE_NAME: {}} if value is None else value
            parts = [
                self.table(
                    (*path, name), model, inner, _header(f"[{'.'.join(path)}.{name}]", about)
                )
                for name, inner in named.items()
            ]
        elif holds(field.annotation, tuple):
            listed = [{}] if value is None else value
            header = _header(f"[[{'.'.join(path)}]]", about)
            parts = [self.table(path, model, inner, header) for inner in listed]
        else:
            inner = self.examples.table(path) if value is None else value
            parts = [self.table(path, model, inner, _header(f"[{'.'.join(path)}]", about))]
        lines = [line for part in parts for line in part]
        left_out = value is None and path[-1] not in LAST
        return [f"# {line}".rstrip() if line else "" for line in lines] if left_out else lines

    def _row(self, name: str, field: FieldInfo, values: Mapping[str, Any]) -> tuple[str, str]:
        """Return a key with its value, commented out if it may be left out, and its meaning."""
        value = values.get(name, None if field.is_required() else field.default)
        text = f"{name} = {'' if value is None else _toml(value)}".rstrip()
        optional = name not in values and not field.is_required()
        return f"# {text}" if optional else text, self._meaning(name, field)

    def _meaning(self, name: str, field: FieldInfo) -> str:
        """Return unit, meaning and choices of a key."""
        if name == "kind":
            return "Kind of mechanism."
        extra = field.json_schema_extra
        unit = str(extra.get("unit", "1")) if isinstance(extra, dict) else "1"
        models = list(models_in(field.annotation))
        what = ["" if unit == "1" else unit, "signal" if len(models) > 1 else ""]
        if SpeedTable in models and AngleTable not in models:  # the heading has all forms of both
            what[1] += " or {speed = [...], value = [...]}"
        if what[1] and holds(field.annotation, tuple):
            what[1] += ", or a list of them, which add"
        before = ", ".join(filter(None, what))
        parts = (before and f"{before}:", field.description or "", self._choice(name, field))
        return " ".join(filter(None, parts))

    def _choice(self, name: str, field: FieldInfo) -> str:
        """Return the allowed values of a key; empty if it is not an enumeration."""
        choices = list(_choices(field.annotation))
        if name == "backend":
            choices = list(methods_of(self._scenario.PAIRS))
        elif name == "channels":
            choices = list(self._scenario.CHANNELS)
        of = "Any" if holds(field.annotation, tuple) else "One"
        return f"{of} of {', '.join(map(_toml, choices))}." if choices else ""


def _beside(rows: list[tuple[str, str]]) -> list[str]:
    """Return the lines of keys with their meanings beside them, or below long ones."""
    column = min(max((len(key) for key, _ in rows), default=0) + 2, MAX_COLUMN)
    lines = []
    for key, meaning in rows:
        mark = "# " if key.startswith("# ") else ""
        indent = f"{mark}{' ' * (column - len(mark))}"
        start = f"{key}  ".ljust(column)
        if WIDTH - len(start) < MIN_COMMENT:
            lines.append(key)
            start = indent
        first, *rest = wrap(meaning, WIDTH - len(start) - 2, break_on_hyphens=False) or [""]
        lines.append(f"{start}# {first}".rstrip("# "))
        width = WIDTH - column - 2
        lines += [f"{indent}# {line}" for line in wrap(" ".join(rest), width)]
    return lines


def _header(brackets: str, about: str) -> tuple[str, ...]:
    if len(brackets) + len(about) + 6 <= WIDTH:  # two more where it is commented out
        return (f"{brackets}  # {about}" if about else brackets,)
    return (brackets, *_prose(about))


def _about(field: FieldInfo, model: type[BaseModel]) -> str:
    """Return the description of a table: that of its key, or the docstring of its model."""
    text = " ".join((field.description or model.__doc__ or "").split("\n\n")[0].split())
    text = text.partition("`: ")[2] if text.startswith("`[") else text
    return text[:1].upper() + text[1:]


def _choices(annotation: Any) -> Iterator[Any]:
    """Yield the literal values of an annotation."""
    if get_origin(annotation) is Literal:
        yield from get_args(annotation)
        return
    for argument in get_args(annotation):
        yield from _choices(argument)


def _toml(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, _WrittenNumber):
        return value.text
    if isinstance(value, int):
        return f"{value:_}"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(k)} = {_toml(v)}' for k, v in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        digits, exponent, power = repr(value).partition("e")
        return f"{digits}e{int(power)}" if exponent else digits
    return json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name)
