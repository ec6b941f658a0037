"""Proof that tests talk to the public face: nothing else has its name, and what fails then.

    python -m tests.moved_modules

copies the sources, gives every room of the package another name, but for what tests may name
(`frictionsim`, `frictionsim.results`, `frictionsim.errors`, solvers, kernels of belts), lets the
package follow, and collects the tests. What cannot be collected names an inside; so do imports in
functions and patches, which are read from the sources. They are printed by file.
"""

import ast
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
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
TOOLS = ("benchmarks", "faults", "net")
MODULES = "|".join((*ROOMS, *KINDS, *FILES))
NAME = re.compile(rf"(\bfrictionsim\.(?:mechanisms\.)?|[\"'](?:mechanisms\.)?)({MODULES})(?=[.\s])")
FROM = re.compile(
    rf"^(\s*from frictionsim(?:\.mechanisms)? import )(.*\b(?:{'|'.join((*ROOMS, *KINDS))})\b.*)$",
    re.MULTILINE,
)
INSIDE = re.compile(rf"frictionsim\.(?:mechanisms\.)?(?:{MODULES})\b")


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
        sys.exit(f"the tests cannot be collected at all:\n{said.stdout}{said.stderr}")
    parts = re.split(r"^_+ ERROR collecting (\S+) _+$", said.stdout, flags=re.MULTILINE)
    reasons = {
        name: re.findall(r"^E +(.*)", text, re.MULTILINE)[-1:] for name, text in pairs(parts)
    }
    print(f"{len(reasons)} files of tests cannot be collected:")
    for name, reason in sorted(reasons.items()):
        print(f"  {name}: {''.join(reason)}")
    lines = [
        (path.relative_to(ROOT), text)
        for path in sorted((ROOT / "tests").rglob("*.py"))
        if path.parent.name not in TOOLS and path != Path(__file__)
        for text in insides(path)
    ]
    print(f"{len(lines)} lines name an inside:")
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
    """Yield the imports and patches of a file of tests that name an inside."""
    text = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom | ast.Import):
            line = ast.unparse(node)
            if INSIDE.search(line) or (
                line.startswith("from frictionsim import ")
                and set(re.findall(r"\w+", line)[3:]) & {*ROOMS}
            ):
                yield line
        elif (
            isinstance(node, ast.Call)
            and ast.unparse(node.func).endswith("patch.setattr")
            and INSIDE.search(line := ast.unparse(node))
        ):
            yield line


if __name__ == "__main__":
    main()
