"""`import frictionsim`: nothing heavy is imported, every name is there and has its type."""

import ast
from importlib import import_module

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
