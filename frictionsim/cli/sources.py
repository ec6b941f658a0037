"""The scenarios that a command line gives: files, folders of them, and the standard input."""

import sys
from collections.abc import Sequence
from os.path import isdir
from pathlib import Path
from typing import TYPE_CHECKING

import frictionsim as fs
from frictionsim.errors import InputError, ScenarioError

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

STDIN = "-"


def load_scenario(
    source: str, overrides: list[str] | None = None, backend: str | None = None
) -> "Scenario":
    """Read and validate a scenario.

    Parameters
    ----------
    source : str
        A path, or "-" for the standard input.
    overrides, backend
        As of `frictionsim.load`.
    """
    if source != STDIN:
        return fs.load(source, overrides, backend)
    from frictionsim.scenario.settings import STDIN as NAME

    return fs.loads(_standard_input(), overrides, backend, name=NAME)


def _standard_input() -> str:
    from frictionsim.scenario.toml_data import MAX_BYTES

    if sys.stdin is None:
        raise InputError("-: the standard input is closed; expected a scenario in TOML")
    content = sys.stdin.buffer.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise ScenarioError(
            [
                f"-: the standard input is larger than {MAX_BYTES >> 20} MiB; expected a"
                " scenario in TOML; use CSV files for signals"
            ]
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(
            [
                "-: expected a scenario in TOML on the standard input, got invalid UTF-8 at byte"
                f" {error.start}"
            ]
        ) from None


def check_read_once(sources: Sequence[str]) -> None:
    """Check that the standard input is given once at most."""
    if sources.count(STDIN) > 1:
        raise InputError("-: given twice; the standard input can be read once only")


def scenarios_in(sources: Sequence[str]) -> list[str]:
    """Return the sources, with the scenarios of each folder instead of the folder."""
    found = []
    for source in sources:
        if source == STDIN or not isdir(source):
            found.append(source)
            continue
        inside = sorted(map(str, Path(source).rglob("*.toml")))
        if not inside:
            raise InputError(f"{source}: there is no scenario (*.toml) in this folder")
        found += inside
    return found
