"""The scenarios that come with the package: examples of each kind, hard ones, benchmarks."""

from os import PathLike, fsdecode
from os.path import exists
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
# A wheel has them inside the package, a source tree beside it.
PLACES = PACKAGE / "scenarios", PACKAGE.parent / "scenarios"
FOLDERS = "hard", "validation"  # beside the examples: hard for a solver, benchmarks of others


def shipped_scenarios() -> dict[str, Path]:
    """Return the shipped scenarios by name: `pulley`, and with their folder, as `hard/jump`."""
    inside, beside = PLACES
    folder = inside if inside.is_dir() else beside
    paths = {path.stem: path for path in sorted(folder.glob("*.toml"))}
    for name in FOLDERS:
        paths |= {f"{name}/{path.stem}": path for path in sorted((folder / name).glob("*.toml"))}
    return paths


def scenario_file(source: str | PathLike[str], folder: Path = Path()) -> Path:
    """Return the file of a scenario; a shipped one also by its name, if no file has that name.

    `folder` is that of a relative path.
    """
    path, name = folder / fsdecode(source), Path(fsdecode(source)).as_posix()
    return path if exists(path) else shipped_scenarios().get(name, path)


def shipped_name(file: str) -> str:
    """Return the name of a shipped scenario for its file; the file itself if it is another one."""
    for folder in PLACES:
        if folder in Path(file).parents:
            return Path(file).relative_to(folder).with_suffix("").as_posix()
    return file


def near_shipped(path: Path) -> str:
    """Return the shipped scenarios with a name like that of a missing file, for messages."""
    from difflib import get_close_matches

    near = get_close_matches(path.with_suffix("").as_posix(), shipped_scenarios())
    if near:
        return f" (did you mean the shipped scenario {' or '.join(map(repr, near))}?)"
    return "" if path.suffix else "; 'frictionsim new --list' lists the shipped scenarios"
