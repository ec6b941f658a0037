"""Parts of the files of the packages that show how to add a mechanism."""

import ast
from collections.abc import Sequence
from pathlib import Path

PROJECTS = Path(__file__).parents[2] / "tests" / "plugin"
LANGUAGES = {".py": "python", ".toml": "toml"}


def excerpt(file: str, *names: str) -> str:
    """Return a file of a package, or only the definitions of some names in it, as a block."""
    path = next(path for path in sorted(PROJECTS.rglob(file)) if "__pycache__" not in path.parts)
    text = path.read_text(encoding="utf-8")
    if names:
        text = _definitions(text, names)
    place = f"`{Path(*path.relative_to(PROJECTS).parts[1:])}`"  # in the folder of its project
    mark = f"<!-- not run: {', '.join(names) or 'all'} of {path.name}, which tests/plugin runs -->"
    return f"In {place}:\n\n{mark}\n```{LANGUAGES[path.suffix]}\n{text.rstrip()}\n```"


def _definitions(text: str, names: Sequence[str]) -> str:
    """Return the lines of classes, functions and constants, spaced as in a module."""
    nodes = {name: node for node in ast.parse(text).body for name in _names(node)}
    lines, parts = text.splitlines(), [""]
    for before, name in zip((None, *names), names, strict=False):
        node = nodes[name]
        constants = all(isinstance(nodes[n], ast.Assign) for n in (before or name, name))
        parts.append("\n" if constants else "\n\n\n")
        parts.append("\n".join(lines[node.lineno - 1 : node.end_lineno]))
    return "".join(parts).lstrip("\n")


def _names(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets if isinstance(target, ast.Name)]
    return [node.name] if isinstance(node, ast.ClassDef | ast.FunctionDef) else []
