"""The structure of the package: few rooms, imports in one direction, files and calls of a size."""

import ast
import inspect
import re
from functools import cache
from pathlib import Path

import pytest

import frictionsim
from tests.support.scenarios import ROOT

pytestmark = pytest.mark.quick

PACKAGE = ROOT / "frictionsim"
FILES = sorted(PACKAGE.rglob("*.py"))
NAMES = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in FILES}
MAX_ROOMS = 13
MAX_ARROWS = 48  # from room to room; one more makes a reader visit one more room
# `display` and `document` are read by all rooms that show a result.
BESIDE_ROOMS = {
    *("__init__.py", "__main__.py", "display.py", "document.py", "errors.py"),
    *("results.py", "version.py", "py.typed"),
}
MAX_LINES = 600
MAX_PARAMETERS = 8
SELF = ("self", "cls")
# Typer makes an option of each parameter of a command.
COMMANDS = {
    PACKAGE / "cli" / f"{name}.py" for name in ("commands", "plot_command", "study_commands")
}
# Their keywords are the options of a command.
LIKE_COMMANDS = [
    "api/fitting.py: fit",
    "api/pictures.py: plot",
    "api/solving.py: solve",
    "api/studies.py: cost",
    "api/sweeping.py: sweep",
]


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def nodes_of(path: Path) -> list[ast.AST]:
    """Return the nodes of the syntax tree of a file."""
    return list(ast.walk(ast.parse(text_of(path))))


@cache
def imported(module: str, with_types: bool = True) -> set[str]:
    """Return the modules of the package that a module imports, or not those for types alone."""
    nodes = nodes_of(NAMES[module])
    for_types = {
        inner
        for node in nodes
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for statement in node.body
        for inner in ast.walk(statement)
    }
    names = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names if alias.name == "frictionsim"}
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("frictionsim"):
            for alias in node.names if with_types or node not in for_types else ():
                inner = f"{node.module}.{alias.name}"
                module_of = inner in NAMES or f"{inner}.__init__" in NAMES
                names.add(inner if module_of else str(node.module))
    return {name if name in NAMES else f"{name}.__init__" for name in names}


def room(module: str) -> str:
    """Return the entry of the package that a module is in."""
    return module.split(".")[1]


def arrows() -> set[tuple[str, str]]:
    """Return which room imports from which other."""
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir()}
    pairs = {(room(a), room(b)) for a in NAMES for b in imported(a)}
    return {(a, b) for a, b in pairs if a != b and rooms >= {a, b}}


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Return nodes that are left when all that lead nowhere are taken away again and again."""
    left = {node: set(following) for node, following in graph.items()}
    while ends := [node for node, following in left.items() if not following & left.keys()]:
        for node in ends:
            del left[node]
    return sorted(left)


def test_the_package_has_few_rooms() -> None:
    entries = {path.name for path in PACKAGE.iterdir()} - {"__pycache__"}
    assert entries >= BESIDE_ROOMS
    assert len(entries - BESIDE_ROOMS) <= MAX_ROOMS


def test_no_module_imports_itself_by_way_of_others() -> None:
    assert circle({module: imported(module, with_types=False) for module in NAMES}) == []


def test_modules_of_a_room_import_in_one_direction_types_counted() -> None:
    assert circle({module: imported(module) for module in NAMES}) == []


def test_only_commands_import_the_names_of_the_package() -> None:
    above = [module for module in NAMES if "frictionsim.__init__" in imported(module)]
    assert {room(module) for module in above} == {"cli"}


def test_rooms_import_in_one_direction() -> None:
    graph: dict[str, set[str]] = {room(module): set() for module in NAMES}
    for a, b in arrows():
        graph[a].add(b)
    assert circle(graph) == []
    assert len(arrows()) <= MAX_ARROWS


def test_texts_of_files_are_parsed_in_one_place() -> None:
    def parses(node: ast.AST) -> bool:
        if isinstance(node, ast.Import):
            return any(alias.name == "tomllib" for alias in node.names)
        if isinstance(node, ast.ImportFrom):
            loaders = {"loads", "load"} & {alias.name for alias in node.names}
            return node.module == "tomllib" or (node.module == "json" and bool(loaders))
        return isinstance(node, ast.Attribute) and ast.unparse(node) in ("json.loads", "json.load")

    paths = [path for path in FILES if any(map(parses, nodes_of(path)))]
    assert paths == [PACKAGE / "scenario" / "toml_data.py"]


def test_import_cycles_are_detected() -> None:
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": set()}) == ["a", "b", "c"]


def test_files_are_short() -> None:
    long = {str(path): count for path in FILES if (count := text_of(path).count("\n")) > MAX_LINES}
    assert long == {}


def types_by_name() -> dict[str, set[str]]:
    """Return classes, and values of aliases of types, by their names without underscores."""
    types: dict[str, set[str]] = {}
    for path in FILES:
        for node in nodes_of(path):
            if isinstance(node, ast.ClassDef):
                types.setdefault(node.name.strip("_"), set()).add(str(path))
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                name, value = node.targets[0].id.strip("_"), ast.unparse(node.value)
                # An `Array` is one of floats everywhere; Any stands for a type of another file.
                is_alias = re.fullmatch(r"[A-Z]\w*[a-z]\w*", name) and value != "Any"
                if is_alias and "NDArray" not in value:
                    types.setdefault(name, set()).add(value)
    return types


def test_a_type_has_its_name_for_itself() -> None:
    types = types_by_name()
    assert len(types) > 400
    assert [name for name, values in types.items() if len(values) > 1] == []


def leaves(annotation: ast.expr | None) -> int:
    """Return how many values an annotation holds: those of a tuple count one by one."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    if isinstance(annotation, ast.BinOp):
        return max(leaves(annotation.left), leaves(annotation.right))
    if not (isinstance(annotation, ast.Subscript) and ast.unparse(annotation.value) == "tuple"):
        return 1
    of_any_length = ast.unparse(annotation.slice).endswith("...)")
    inner = annotation.slice
    parts = inner.elts if isinstance(inner, ast.Tuple) and not of_any_length else [inner]
    return sum(map(leaves, parts))


def unpacked(function: ast.FunctionDef) -> dict[str, int]:
    """Return into how many values a function takes its parameters apart, by name."""
    lengths = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            targets, value = node.targets[0].elts, node.value
            pairs = [(node.targets[0], value)]
            if isinstance(value, ast.Tuple):
                pairs = list(zip(targets, value.elts, strict=False))
            for target, source in pairs:
                if isinstance(target, ast.Tuple) and isinstance(source, ast.Name):
                    lengths[source.id] = len(target.elts)
    return lengths


def is_kernel(function: ast.FunctionDef) -> bool:
    return any(ast.unparse(d).endswith(("kernel", "compilable")) for d in function.decorator_list)


def parameters(function: ast.FunctionDef) -> int:
    """Return how many parameters a function has; a kernel's anonymous tuple counts its values."""
    own = function.args
    given = [a for a in (*own.posonlyargs, *own.args, *own.kwonlyargs) if a.arg not in SELF]
    if not is_kernel(function):
        return len(given)
    apart = unpacked(function)
    return sum(max(leaves(a.annotation), apart.get(a.arg, 1)) for a in given)


def test_functions_have_few_parameters() -> None:
    many = [
        f"{path.relative_to(PACKAGE)}: {node.name}"
        for path in FILES
        for node in nodes_of(path)
        if isinstance(node, ast.FunctionDef)
        and path not in COMMANDS
        and parameters(node) > MAX_PARAMETERS
    ]
    assert many == LIKE_COMMANDS


@pytest.mark.parametrize(
    "signature",
    [
        'x: tuple[int, "Array", tuple[float, float]]',
        'x: "tuple[int, int, int, int] | None"',
        "x: Accelerations",
    ],
)
def test_values_of_anonymous_tuples_are_counted(signature: str) -> None:
    body = "(a, b, c, d), e = x, y" if signature.endswith("s") else "pass"
    node = ast.parse(f"@loop_kernel\ndef f({signature}, y: int) -> None:\n    {body}").body[0]
    assert isinstance(node, ast.FunctionDef)
    assert parameters(node) == 5


def test_public_functions_name_their_options() -> None:
    public = [getattr(frictionsim, name) for name in frictionsim.__all__]
    functions = [one for one in public if inspect.isfunction(one)]
    assert frictionsim.solve in functions
    for function in functions:
        kinds = {p.kind for p in inspect.signature(function).parameters.values()}
        assert not kinds & {inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL}


def test_the_package_has_a_version() -> None:
    assert frictionsim.__version__
