"""The inventory: what the program offers, by name, as users meet it.

    python -m tests.inventory        write tests/inventory.json anew; git shows what differs

Commands and exit codes are those of `--help`; keys and channels those of the schemas; views those
that a refusal names; quantities and audits those of the golden results, of short runs where these
have none, and of `static`. Warnings are the rows of docs/warnings.md, which `tests/docs` holds
against the code.
"""

import contextlib
import inspect
import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py

import frictionsim as fs

ROOT = Path(__file__).parents[1]
GOLDEN = ROOT / "tests" / "golden"
STORED = ROOT / "tests" / "inventory.json"
ANEW = "write it anew by `python -m tests.inventory`, and read what differs"
# Short runs that have what no golden result has.
SHORT: list[tuple[str, dict[str, Any]]] = [
    ("pulley", {"solver.duration": 0.01}),
    ("hard/lift_slack_rope", {"solver.duration": 0.05}),
    ("marble_machine", {"solver.duration": 0.02}),
    ("epicyclic", {"solver.duration": 0.05, "effects.rolling_friction.normal_load": "radial"}),
    ("epicyclic_dwell", {"solver.duration": 0.05}),
    ("swing_door", {"solver.duration": 0.05}),
    ("shaft", {"solver.duration": 0.05, "statics.unknown": "forces.effort.size"}),
]
# The statics of these, and of the short runs.
AT_REST = ("pulley_horizontal", "lift", "hoist_drum", "belt_drive")
PULLEYS = ("driver", "driven")  # of that belt
# A run of a belt takes compiled kernels, so that its views are those of a golden result.
OF_BELTS = GOLDEN / "belt_drive.h5"

Inventory = dict[str, Any]


def inventory() -> Inventory:
    """Return what the program offers: lists of names, by section and by what they belong to."""
    schemas = {kind: fs.schema(kind) for kind in fs.kinds()}
    done = [fs.solve(name, overrides) for name, overrides in SHORT]
    return {
        "audits": _audits(done),
        "channels": {kind: _channels(schema) for kind, schema in schemas.items()},
        "commands": _commands(),
        "exit codes": _exit_codes(),
        "keys": {kind: sorted(set(_keys(schema, schema, ""))) for kind, schema in schemas.items()},
        "python": {name: _members(name) for name in dir(fs) if not name.startswith("_")},
        "quantities": _quantities(done),
        "scenarios": sorted(fs.scenarios()),
        "views": {of.kind: _views(of) for of in done} | {"belt_drive": _views(OF_BELTS)},
        "warnings": _warnings(),
    }


def _told(*arguments: str) -> str:
    """Return what the command line prints."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        fs.run_command_line(list(arguments))
    return out.getvalue()


def _rows(text: str, section: str) -> list[str]:
    """Return the first columns of a section of a help text."""
    within = text.partition(f"\n{section}:\n")[2].partition("\n\n")[0]
    return re.findall(r"^  (\S.*?)(?: {2,}.*)?$", within, re.MULTILINE)


def _commands() -> dict[str, list[str]]:
    program = _told("--help")
    commands = {"frictionsim": _rows(program, "Options")}
    for command in sorted(_rows(program, "Commands")):
        text = _told(command, "--help")
        # Types of arguments are in the words of typer, which change with its version.
        arguments = [row.partition(" <")[0].rstrip(".").upper() for row in _rows(text, "Arguments")]
        commands[command] = [*arguments, *sorted(_rows(text, "Options"))]
    return commands


def _exit_codes() -> list[str]:
    sentence = " ".join(_told("--help").partition("Exit codes: ")[2].split())
    return re.split(r", (?=\d)", sentence.rstrip("."))


def _members(name: str) -> list[str]:
    """Return the parameters of a function, or the public members of a class."""
    item = getattr(fs, name)
    if not inspect.isclass(item):
        return _call(item)[1:-1].split(", ") if callable(item) else []
    own = [one for one in item.__mro__ if one.__module__.startswith("frictionsim")]
    members = {member for one in own for member in (*vars(one), *inspect.get_annotations(one))}
    shown = []
    for member in sorted(members):
        value = getattr(item, member, None)
        if not member.startswith(("_", "model_")):  # the latter are of pydantic
            is_method = inspect.isfunction(value) or inspect.ismethod(value)
            ending = f" = {value}" if isinstance(value, int) else ""
            shown.append(member + (_call(value) if is_method else ending))
    return shown


def _call(function: Any) -> str:
    parameters = inspect.signature(function).parameters.values()
    bare = [one.replace(annotation=one.empty) for one in parameters if one.name != "self"]
    return str(inspect.Signature(bare))


def _keys(node: Any, schema: Any, path: str) -> Iterator[str]:
    """Yield the keys below a node of a schema, with unit, choices and default."""
    if "$ref" in node:
        node = schema["$defs"][node["$ref"].rpartition("/")[2]] | node
    for name, inner in node.get("properties", {}).items():
        within = f"{path}.{name}" if path else name
        if path != "output" or name != "channels":  # which have a section of their own
            unit = f" [{inner['unit']}]" if "unit" in inner else ""
            default = f" = {json.dumps(inner['default'])}" if "default" in inner else ""
            yield f"{within}{unit}: {_type(inner)}{default}" if _type(inner) else within
            yield from _keys(inner, schema, within)
    for inner in (*node.get("oneOf", ()), *node.get("anyOf", ())):
        yield from _keys(inner, schema, path)
    for of, ending in (("items", "[]"), ("additionalProperties", ".<name>")):
        if isinstance(node.get(of), dict):
            yield from _keys(node[of], schema, path + ending)


def _type(node: Any) -> str:
    """Return the type of a key, or its choices; of several forms all simple ones."""
    forms = [node, *node.get("oneOf", ()), *node.get("anyOf", ())]
    choices = [" | ".join(map(str, form["enum"])) for form in forms if "enum" in form]
    types = [form["type"] for form in forms if "type" in form and form["type"] != "object"]
    return " or ".join(choices or dict.fromkeys(types))


def _channels(schema: Any) -> list[str]:
    return sorted(schema["$defs"]["Output"]["properties"]["channels"]["items"]["enum"])


def _golden() -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield kind, quantities and audits of the golden results, pulleys of belts by no name."""
    for path in sorted(GOLDEN.glob("*.h5")):
        with h5py.File(path) as file:
            pulleys = re.findall(r'^name = "(\w+)"', file.attrs["scenario"], re.MULTILINE)
            units = {name: item.attrs["units"] for name, item in file["quantities"].items()}
            checks = file["audit/check"].asstr()[:].tolist()
            yield file.attrs["kind"], with_units(units, pulleys), checks


def with_units(units: Mapping[str, str], pulleys: Sequence[str] = ()) -> list[str]:
    """Return quantities as `name [unit]`, pulleys in their names as `<pulley>`."""
    of_a_pulley = rf"_({'|'.join(pulleys)})(?![a-z])" if pulleys else "(?!)"  # nothing
    return [f"{re.sub(of_a_pulley, '_<pulley>', name)} [{unit}]" for name, unit in units.items()]


def _quantities(done: list[fs.Result]) -> dict[str, list[str]]:
    at_rest = [fs.load(name) for name in AT_REST] + [fs.load(*short) for short in SHORT]
    given = [(one.kind, one.quantities) for one in done]
    given += [(scenario.kind, fs.static(scenario)) for scenario in at_rest]
    named = [(kind, names) for kind, names, _ in _golden()]
    for kind, quantities in given:
        units = {name: quantity.unit for name, quantity in quantities.items()}
        named.append((kind, with_units(units, PULLEYS if kind == "belt_drive" else ())))
    return _by_kind(named)


def _audits(done: list[fs.Result]) -> dict[str, list[str]]:
    named = [(one.kind, list(one.audit)) for one in done]
    return _by_kind(named + [(kind, audits) for kind, _, audits in _golden()])


def _by_kind(named: list[tuple[str, list[str]]]) -> dict[str, list[str]]:
    return {
        kind: sorted({n for of, names in named if of == kind for n in names}) for kind in fs.kinds()
    }


def _views(result: Any) -> list[str]:
    try:
        fs.plot(result, "?")
    except fs.InputError as refused:
        return sorted(str(refused).rpartition("known: ")[2].split(", "))
    return ["?"]


def _warnings() -> dict[str, list[str]]:
    """Return the first column of each table of the page, by its heading."""
    page = (ROOT / "docs" / "warnings.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## ([^\n]+)$(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    return {
        title: re.findall(r"^\| (?!warning \|)([^|]+?) \|", text, re.MULTILINE)
        for title, text in sections
    }


def as_text(offered: Inventory) -> str:
    """Return an inventory as its file has it."""
    return json.dumps(offered, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    STORED.write_text(as_text(inventory()), encoding="utf-8")
