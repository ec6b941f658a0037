"""Proof that tests talk to the public face: nothing else has its name, and what fails then.

    python -m tests.moved_modules

copies the sources, gives every room of the package another name, but for what tests may name
(`frictionsim`, `frictionsim.results`, `frictionsim.errors`, `frictionsim.mechanisms.extension`,
solvers, kernels of belts), lets the package follow, and collects the tests. What cannot be
collected names an inside. All imports and patches of insides, also those in functions and in rooms
that keep their names, are read from the sources and printed by file.
"""

import ast
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = (
    *("api", "cli", "fits", "io", "motion", "sweeps", "plots", "reports"),
    *("scenario", "simulation", "costs"),
)
KINDS = ("epicyclic", "marble_machine", "pulley", "shaft")
FILES = ("display", "document")
MOVED = "_elsewhere"
# Tools that are no tests.
TOOLS = ("benchmarks", "faults")
MODULES = "|".join((*ROOMS, *KINDS, *FILES))
NAME = re.compile(
    rf"(\bfrictionsim\.(?:mechanisms\.)?|[\"'](?:mechanisms\.)?(?=\w+[.\s]))({MODULES})(?=[.\s\"'])"
)
FROM = re.compile(
    rf"^(\s*from frictionsim(?:\.mechanisms)? import )(.*\b(?:{'|'.join((*ROOMS, *KINDS))})\b.*)$",
    re.MULTILINE,
)
# What tests may name: what is public, solvers, kernels of belts, and what authors of kinds import.
PUBLIC = rf"\*|(?!({'|'.join((*ROOMS, 'mechanisms', *FILES))})\b)\w+"
KERNELS = r"mechanisms\.belt_drive\.(kernels|moreau|rkf45)"
WHOLE = rf"results|errors|solvers|mechanisms\.extension|{KERNELS}"
ALLOWED = re.compile(rf"frictionsim(\.({PUBLIC}|({WHOLE})(\..*)?))?$")


def main() -> None:
    """Move the rooms of a copy, and print which test files name an inside, and where."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "frictionsim"
        for name in ("frictionsim", "tests", "scenarios", "docs", "pyproject.toml", "README.md"):
            source = ROOT / name
            (shutil.copytree if source.is_dir() else shutil.copy)(source, copy / name)
        move(copy / "frictionsim")
        command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
        said = subprocess.run(
            command, cwd=copy, env={"PYTHONPATH": str(copy)}, capture_output=True, text=True
        )
    if said.returncode not in (0, 2):  # 2: some files cannot be collected
        print(f"the tests cannot be collected at all:\n{said.stdout}{said.stderr}")
    parts = re.split(r"^_+ ERROR collecting (\S+) _+$", said.stdout, flags=re.MULTILINE)
    reasons = {
        name: re.findall(r"^E +(.*)", text, re.MULTILINE)[-1:] for name, text in pairs(parts)
    }
    print(f"{len(reasons)} files of tests cannot be collected:")
    for name, reason in sorted(reasons.items()):
        print(f"  {name}: {''.join(reason)}")
    files = {
        path.relative_to(ROOT): list(insides(path))
        for path in sorted((ROOT / "tests").rglob("*.py"))
        if path.parent.name not in TOOLS and path != Path(__file__)
    }
    lines = [(path, text) for path, texts in files.items() for text in texts]
    patches = sum("attr(" in text for _, text in lines)
    print(f"{len(lines) - patches} imports and {patches} patches name an inside:")
    for path, text in lines:
        print(f"  {path}: {text}")


def pairs(parts: list[str]) -> Iterator[tuple[str, str]]:
    """Yield the file of each error and its text, of a text that was split at their headings."""
    yield from zip(parts[1::2], parts[2::2], strict=True)


def move(package: Path) -> None:
    """Give the rooms of a package other names, and let all imports follow."""
    for path in sorted(package.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        text = NAME.sub(rf"\1\2{MOVED}", text)
        path.write_text(FROM.sub(_renamed, text), encoding="utf-8")
    for name in ROOMS:
        (package / name).rename(package / f"{name}{MOVED}")
    for name in KINDS:
        folder = package / "mechanisms"
        (folder / name).rename(folder / f"{name}{MOVED}")
    for name in FILES:
        (package / f"{name}.py").rename(package / f"{name}{MOVED}.py")


def _renamed(match: re.Match[str]) -> str:
    names = re.sub(rf"\b({'|'.join((*ROOMS, *KINDS))})\b(?! as)", rf"\1{MOVED} as \1", match[2])
    return match[1] + re.sub(rf"\b({'|'.join((*ROOMS, *KINDS))}) as", rf"\1{MOVED} as", names)


def insides(path: Path) -> Iterator[str]:
    """Yield the imports and patches of a file of tests that name an inside.

    Imports are statements, also those in programs that are kept as text. Patches are calls of
    `setattr` and `delattr` of what `patch` is called, whose target is named as text or was imported
    from the package.
    """
    yield from insides_of(ast.parse(path.read_text(encoding="utf-8")))


def insides_of(tree: ast.AST) -> Iterator[str]:
    """Yield the imports and patches of a program that name an inside."""
    own = set[str]()
    for node in sorted(ast.walk(tree), key=lambda node: getattr(node, "lineno", 0)):
        if isinstance(node, ast.ImportFrom | ast.Import):
            module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            names = {alias.asname or alias.name: module + alias.name for alias in node.names}
            names = {key: name for key, name in names.items() if name.startswith("frictionsim")}
            own |= names.keys()
            if not all(map(ALLOWED.match, names.values())):
                yield ast.unparse(node)
        elif isinstance(node, ast.Constant) and "import frictionsim" in str(node.value).replace(
            "from", "import"
        ):
            with suppress(SyntaxError):
                yield from insides_of(ast.parse(str(node.value)))
        elif isinstance(node, ast.Call) and re.search(
            r"patch\w*\.(set|del)attr$", ast.unparse(node.func)
        ):
            target = ast.unparse(node.args[0])
            if "frictionsim." in target or target.partition(".")[0] in own:
                yield ast.unparse(node)


if __name__ == "__main__":
    main()
