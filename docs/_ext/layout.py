"""What stands where, from the first lines of the modules' docstrings."""

import ast
from pathlib import Path

from markdown import table

import frictionsim

PACKAGE = Path(frictionsim.__file__).parent
PRIVATE = "__init__.py", "__main__.py"


def layout(folder: str = "") -> str:
    """Return a table of the modules of a folder of the package, those within it apart."""
    files = sorted((PACKAGE / folder.replace(".", "/")).glob("*.py"))
    return table(
        ("module", "what it is"),
        [(f"`{path.name}`", purpose(path)) for path in files if path.name not in PRIVATE],
    )


def purpose(path: Path) -> str:
    """Return the first sentence of a module's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.split("\n\n")[0].replace("\n", " ").rstrip(".")
