"""`import frictionsim`: nothing heavy is imported, every name is there and has its type."""

import ast
from importlib import import_module

import frictionsim as fs
from tests.support.scenarios import ROOT, python

INIT = ROOT / "frictionsim" / "__init__.py"


def test_names_are_imported_when_they_are_used() -> None:
    code = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
before = set(sys.modules)
import frictionsim as fs
dir(fs), fs.__version__
print(sorted(set(sys.modules) - before))
fs.InputError
print([name for name in ("numpy", "pydantic", "h5py", "xarray") if name in sys.modules])
print("InputError" in vars(fs), "solve" in vars(fs))
"""
    done = python("-I", "-S", "-c", code)
    assert done.stdout.splitlines() == [
        "['frictionsim', 'frictionsim.version']",
        "[]",
        "True False",
    ]


def test_every_public_name_resolves() -> None:
    for name, module in fs._MODULES.items():
        public = getattr(fs, name)
        assert public is getattr(import_module(f"frictionsim.{module}"), name)
        assert public.__doc__, name
        assert name in dir(fs)


def test_type_checkers_see_the_same_names() -> None:
    """Each `as` itself, else mypy --strict takes it for private."""
    tree = ast.parse(INIT.read_text(encoding="utf-8"))
    (block,) = (n for n in tree.body if ast.unparse(n).startswith("if TYPE_CHECKING:"))
    assert isinstance(block, ast.If)
    seen = {
        alias.asname: str(node.module).removeprefix("frictionsim.")
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name == alias.asname
    }
    assert seen == fs._MODULES


def test_the_star_leaves_the_builtin_open() -> None:
    names: dict[str, object] = {}
    exec("from frictionsim import *", names)
    assert set(fs._MODULES) - set(names) == {"open"}
