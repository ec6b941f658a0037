"""The folders of the package, from the first lines of their docstrings."""

import ast
from pathlib import Path

from markdown import table

import frictionsim

PACKAGE = Path(frictionsim.__file__).parent
PRIVATE = "__init__.py", "__main__.py"


def layout() -> str:
    """Return a table of the folders of the package, with the number of their modules."""
    rows = []
    for init in sorted(PACKAGE.rglob("__init__.py")):
        folder = init.parent.relative_to(PACKAGE.parent).as_posix()
        modules = [path for path in init.parent.glob("*.py") if path.name not in PRIVATE]
        rows.append((f"`{folder}`", purpose(init), str(len(modules))))
    return table(("folder", "what it has", "modules"), rows)


def purpose(path: Path) -> str:
    """Return the first sentence of a module's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.split("\n\n")[0].replace("\n", " ").rstrip(".")
