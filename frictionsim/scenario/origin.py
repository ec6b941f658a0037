"""Where scenarios come from: those of the package by name, a file, the values set on the way."""

from collections.abc import Mapping
from os import PathLike, fsdecode
from os.path import exists
from pathlib import Path
from typing import Any, NamedTuple

PACKAGE = Path(__file__).parents[1]
# A wheel has them inside the package, a source tree beside it.
PLACES = PACKAGE / "scenarios", PACKAGE.parent / "scenarios"
FOLDERS = "hard", "validation"  # beside the examples: hard for a solver, benchmarks of others
STDIN_NAME = "<stdin>"  # the source of a scenario from the standard input


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


class Origin(NamedTuple):
    """Where a scenario came from: its file and the overrides KEY=VALUE; both may be empty.

    A result has the name of the file without its folder, and the `recorded` command with it.
    """

    source: str = ""
    overrides: tuple[str, ...] = ()
    recorded: str = ""

    @property
    def values(self) -> dict[str, Any]:
        """The overrides by key, as plain data; None for a key that was taken out."""
        from frictionsim.scenario.overrides import values_by_key

        return values_by_key(self.overrides)

    @property
    def command(self) -> str:
        """The command that solves the scenario again; empty if it is of no file."""
        if self.recorded or not self.source:
            return self.recorded
        from shlex import join

        options = (part for override in self.overrides for part in ("--set", override))
        name = "-" if self.source == STDIN_NAME else shipped_name(self.source)
        return join(["frictionsim", "solve", name, *options])


def heading_of(attributes: Mapping[str, str]) -> str:
    """Return the title of a result; without one the name of its scenario's file, or its kind."""
    name = Path(attributes.get("source", "")).stem
    return attributes.get("title") or name or attributes.get("kind", "")


def origin_of(attributes: Mapping[str, str]) -> Origin:
    """Return the origin of a scenario from the attributes of a result file."""
    # Not splitlines: texts may contain the line separators of Unicode.
    overrides = tuple(filter(None, attributes.get("overrides", "").split("\n")))
    name = Path(attributes.get("source", "")).name
    return Origin(name, overrides, attributes.get("command", ""))
