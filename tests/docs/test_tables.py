"""The tables of the pages are those of the code: files, exit codes, failures, audits, views."""

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path

import h5py
import pytest

import frictionsim as fs
from frictionsim import errors
from frictionsim.results import Record
from tests.docs.pages import DOCS, INVENTORY, PAGES, names, table
from tests.inventory import PULLEYS, with_units
from tests.support.scenarios import SCENARIOS

sys.path.insert(0, str(DOCS / "_ext"))
from method_table import pairs

PACKAGE = Path(fs.__file__).parent
FILES, FAILURES = "docs/result-files.md", "docs/failures.md"
QUANTITIES, METHODS = "docs/quantities.md", "docs/methods.md"
STOPS = ["statics.unknown=forces.effort.size", "effects.end_stops.highest_angle_deg=100"]
SHORT = {"pulley": ("pulley_return", []), "shaft": ("shaft", ["solver.duration=0.5", *STOPS])}
# Of belts whose motion repeats, and that wear, of which the inventory has no run.
ELSEWHERE = {"mean_duration [s]", "friction_work_clean [J/m]", "friction_work_patch [J/m]"}


@cache
def short_run(kind: str) -> Record:
    """Return a run of a shipped scenario."""
    name, overrides = SHORT[kind]
    return fs.solve(SCENARIOS / f"{name}.toml", overrides).record


def text_of_node(node: ast.AST) -> str | None:
    """Return a text of the code, with {} where values are put in."""
    if isinstance(node, ast.JoinedStr):
        return "".join(text_of_node(part) or "{}" for part in node.values)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


@cache
def trees() -> dict[Path, ast.Module]:
    """Return the code of the package."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py")}


@cache
def texts() -> list[str]:
    """Return all texts in the code of the package."""
    nodes = (node for tree in trees().values() for node in ast.walk(tree))
    return [text for text in map(text_of_node, nodes) if text is not None]


def first_names(page: str, name: str, column: int = 0) -> list[str]:
    return [word for row in table(page, name) for word in names(row[column])]


@pytest.mark.parametrize("kind", ["pulley", "shaft"])
def test_attributes_units_and_events_of_a_file_are_those_of_the_page(
    kind: str, tmp_path: Path
) -> None:
    fs.Result(short_run(kind)).save(tmp_path / "result.h5")
    described, events = short_run(kind).units, first_names(FILES, "events")
    with h5py.File(tmp_path / "result.h5") as file:
        assert set(file.attrs) == set(first_names(FILES, "attributes"))
        channels = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset)}
        for name, item in channels.items():
            assert item.attrs["units"] == ("s" if name == "time" else described[name])
        recorded = {
            f"{name}_{side}"
            for name in channels.keys() - {"time", "angle", "mode"}
            if "energy" not in name
            for side in ("before", "after")
        }
        assert set(file["events"]) == {name for name in events if "<" not in name} | recorded
        shown = {name for name in first_names(FILES, "summary") if "<" not in name}
        members = {f"{group}/{name}" for group in ("audit", "solver") for name in file[group]}
        assert members - {"audit/end_stops", "audit/impact_law"} == shown
        assert set(file["quantities"]) == short_run(kind).quantities.keys()


def quantity_units(*tables: str) -> dict[str, str]:
    """Return the quantities of tables of their page with their units."""
    rows = [row for name in tables for row in table(QUANTITIES, f"quantities of {name}")]
    return {name: row[1] for row in rows for name in names(row[0])}


@pytest.mark.parametrize("kind", fs.kinds())
def test_the_quantities_of_a_kind_are_those_of_the_page(kind: str) -> None:
    """With their units; `tests/inventory.py` has them from runs and from statics of each kind."""
    is_belt = kind == "belt_drive"
    more = {"pulley": ["masses on a cord"], "belt_drive": ["a belt at rest"]}
    shared = ["all runs"] if is_belt else ["all runs", "one coordinate"]
    pulleys = PULLEYS if is_belt else ()
    own = set(with_units(quantity_units(kind, *more.get(kind, [])), pulleys))
    offered = set(INVENTORY["quantities"][kind])
    assert offered <= own | set(with_units(quantity_units(*shared)))
    assert own - offered == (ELSEWHERE if is_belt else set())


def test_the_keys_of_json_are_those_of_the_page() -> None:
    printed = fs.Result(short_run("pulley")).to_json()
    shown = {names(row[0])[0]: row for row in table("docs/cli.md", "json")}
    keys = [key for row in shown.values() for key in names(row[0])]
    assert sorted(keys) == sorted(printed)
    assert names(shown["solver"][1]) == list(printed["solver"])
    assert names(shown["events"][1]) == list(printed["events"][0])
    assert all(names(shown["audit"][1]) == list(check) for check in printed["audit"].values())


def test_the_exit_codes_are_those_of_the_page() -> None:
    codes = {getattr(errors, name) for name in dir(errors) if name.startswith("EXIT_")}
    codes.remove(errors.EXIT_SIGNAL)
    shown = [int(code) for row in table(FAILURES, "exit codes") for code in row[0].split(", ")]
    assert shown[-3:] == [errors.EXIT_SIGNAL + number for number in (2, 15, 1)]
    assert set(shown[:-3]) == codes


def test_the_failures_are_those_of_the_page() -> None:
    kinds = {c.failure for c in errors.SolverError.__subclasses__() if c.failure}
    assert set(first_names(FAILURES, "failures")) == kinds


def test_the_audits_are_those_of_the_page() -> None:
    of_stops = fs.solve("swing_door", {"solver.duration": 0.1}).record
    assert set(first_names("docs/accuracy.md", "audits")) == set(of_stops.checks)


def test_the_views_are_those_of_the_page() -> None:
    shown: dict[str, list[str]] = {}
    for kind, view, _ in table("docs/pictures.md", "views"):
        shown.setdefault(names(kind)[0] if names(kind) else list(shown)[-1], []).extend(names(view))
    assert {kind: sorted(views) for kind, views in shown.items()} == INVENTORY["views"]


def test_the_laws_and_methods_are_those_of_the_page() -> None:
    accepted = [pairs(kind) for kind in fs.kinds()]
    assert set(first_names(METHODS, "laws")) == {law for laws in accepted for law in laws}
    able = {name for laws in accepted for cell in laws.values() for name in names(cell)}
    assert set(first_names(METHODS, "methods")) == able


def quoted_warnings() -> list[list[str]]:
    """Return the parts of each warning that the page quotes, without values."""
    lines = PAGES["docs/warnings.md"].read_text(encoding="utf-8").splitlines()
    first = [line.split("|")[1] for line in lines if line.startswith(("| `", "| ... of `"))]
    quoted = [text for cell in first for text in names(cell) if " " in text]
    parts = [re.split(r"\.\.\.|(?<![\w^])-?\d[\d.e-]*", text) for text in quoted]
    return [[part.strip() for part in of_one if len(part.strip()) > 3] for of_one in parts]


def given_warnings() -> Iterator[str]:
    """Yield the warnings in the code, as `texts`: what functions of them yield, append or list.

    Those of fits are in the page of fits.
    """
    nodes = ((path, node) for path, tree in trees().items() for node in ast.walk(tree))
    functions = [
        node
        for path, node in nodes
        if isinstance(node, ast.FunctionDef) and path.parent.name != "fits"
        if "warning" in node.name or path.stem in ("run_warnings", "plausibility")
    ]
    for function in functions:
        for node in ast.walk(function):
            given: list[ast.expr] = []
            if isinstance(node, ast.Yield) and node.value:
                given = [node.value]
            elif isinstance(node, ast.Call) and ast.unparse(node.func) == "warnings.append":
                given = node.args
            elif isinstance(node, ast.Return) and isinstance(node.value, ast.List):
                given = node.value.elts
            for value in given:
                first = next(filter(None, map(text_of_node, ast.walk(value))), "")
                if " " in first:
                    yield first


def test_the_quoted_warnings_are_those_of_the_code() -> None:
    assert quoted_warnings()
    for part in chain.from_iterable(quoted_warnings()):
        assert any(part in text for text in texts()), part


def test_the_warnings_of_the_code_are_quoted() -> None:
    given, quoted = set(given_warnings()), [max(parts, key=len) for parts in quoted_warnings()]
    assert len(given) > 25
    for warning in given:
        assert any(part in warning for part in quoted), warning
