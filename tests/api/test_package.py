"""`import frictionsim`: nothing heavy is imported, every name is there and has its type."""

import ast
from importlib import import_module
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.scenarios import ROOT, python

INIT = ROOT / "frictionsim" / "__init__.py"


def run_code(code: str) -> str:
    done = python("-I", "-S", "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{code}")
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_bare_package_imports_nothing_but_its_version() -> None:
    code = """
before = set(sys.modules)
import frictionsim
print(sorted(set(sys.modules) - before))
dir(frictionsim), frictionsim.__version__
print(sorted(set(sys.modules) - before))
"""
    assert run_code(code) == "['frictionsim', 'frictionsim.version']\n" * 2


def test_names_are_imported_when_they_are_used() -> None:
    code = """
import frictionsim as fs
fs.InputError
print([name for name in ("numpy", "pydantic", "h5py", "xarray") if name in sys.modules])
print(fs.InputError is fs.InputError, "InputError" in vars(fs), "solve" in vars(fs))
"""
    assert run_code(code) == "[]\nTrue True False\n"


def test_every_public_name_resolves() -> None:
    for name, module in fs._MODULES.items():
        public = getattr(fs, name)
        assert public is getattr(import_module(f"frictionsim.{module}"), name)
        assert public.__doc__, name
        assert name in dir(fs)
    assert "__version__" in dir(fs)


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse(INIT.read_text(encoding="utf-8"))
    block = next(
        node
        for node in tree.body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    seen = {}
    for node in block.body:
        assert isinstance(node, ast.ImportFrom)
        assert node.module is not None
        if node.module == "typing":
            continue
        (alias,) = node.names
        assert alias.asname == alias.name, "else mypy --strict takes it for private"
        seen[alias.name] = node.module.removeprefix("frictionsim.")
    assert seen == fs._MODULES


def test_the_star_leaves_the_builtin_open() -> None:
    names: dict[str, object] = {}
    exec("from frictionsim import *", names)
    assert set(fs.__all__) <= set(names)
    assert "open" not in names
    assert set(fs._MODULES) - set(fs.__all__) == {"open"}


# --- the command line is a thin layer -------------------------------------------------------

CLI = sorted((ROOT / "frictionsim" / "cli").glob("*.py"))
# What is no part of the interface for Python, and why the command line needs it.
LEAVES = {
    # check before a run, say where its result went, and leave no part of one
    "frictionsim.io.run_files": {"RunFiles"},
    "frictionsim.io.names": {"partial_name", "whole_name"},
    "frictionsim.io.output_file": {
        *("COSTS", "PICTURE", "SCENARIO"),
        *("check_apart", "check_free", "check_output", "discard_parts"),
    },
    "frictionsim.sweeps.sweep_csv": {"files_of_sweep_in_csv"},
    # text of others on streams that may fail
    "frictionsim.io.terminal": {
        *("ReaderGone", "Stdout", "is_terminal", "print_on_stderr", "visible", "write_on_stderr")
    },
    # the picture of a study, in the format of its name
    "frictionsim.plots.style": {"STYLES", "check_picture"},
    # the summary of what has no class of results
    "frictionsim.document": {"as_json", "as_text"},
    # JSON of `static`, the name of the standard input
    "frictionsim.results": {"quantities_json"},
    "frictionsim.scenario.settings": {"STDIN", "Scenario"},
    "frictionsim.scenario.toml_data": {"ExceedsLimit", "read_text"},
    # what shells offer, and whose defect it is
    "frictionsim.plots": {"ALL", "VIEWS"},
    "frictionsim.scenario.methods": {"METHODS"},
    # the column of times, by name or number
    "frictionsim.scenario.options": {"column_of"},
    # what watches a run: the command line handles more signals
    "frictionsim.simulation.monitor": {
        *("Monitor", "Monitors", "Progress", "RunMonitor", "StopSignals", "SweepProgress"),
        "compilation_text",
    },
    "frictionsim.scenario.kinds": {"GROUP", "KINDS", "kind_names"},
    "frictionsim.scenario.shipped": {"shipped_scenarios"},
}


@pytest.mark.parametrize("path", CLI, ids=lambda path: path.name)
def test_the_command_line_uses_the_interface_for_python(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            inside = [a.name for a in node.names if a.name.startswith("frictionsim")]
            assert inside in ([], ["frictionsim"]), inside
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
            "frictionsim"
        ):
            continue
        module, names = str(node.module), {alias.name for alias in node.names}
        allowed = (
            module == "frictionsim"
            or module in ("frictionsim.errors", "frictionsim.version")
            or module.startswith(("frictionsim.api", "frictionsim.cli"))
            or names <= LEAVES.get(module, set())
        )
        assert allowed, f"{path.name}:{node.lineno}: {module} {names}"


def test_the_exceptions_of_thinness_are_needed() -> None:
    text = "\n".join(path.read_text(encoding="utf-8") for path in CLI)
    for module, names in LEAVES.items():
        assert f"from {module} import" in text, module
        assert [name for name in names if name not in text] == [], module
