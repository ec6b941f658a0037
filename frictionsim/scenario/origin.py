"""Where a scenario came from."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from frictionsim.scenario.shipped import shipped_name

STDIN = "<stdin>"  # the source of a scenario from the standard input


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
        name = "-" if self.source == STDIN else shipped_name(self.source)
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
