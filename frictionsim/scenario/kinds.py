"""The kinds of mechanism, by the name that a scenario gives as `kind`: built in or installed.

An installed package adds kinds by entry points of the group `frictionsim.kinds`, which give the
kind and its module: `block_brake = "frictionsim_brake.block_brake"`. They are read only for a kind
that is not built in, since searching the installed packages takes longer than simulating a
pulley. A faulty plug-in is reported where it is needed; it does not disturb the other kinds.
"""

from functools import cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from frictionsim.errors import InputError, unknown

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "frictionsim.kinds"
REQUIRED = ("SCENARIO", "simulation", "statics", "PANELS", "METRICS")

# The built-in kinds and their modules.
KINDS = {
    "pulley": "frictionsim.mechanisms.pulley",
    "marble_machine": "frictionsim.mechanisms.marble_machine",
    "epicyclic": "frictionsim.mechanisms.epicyclic",
    "shaft": "frictionsim.mechanisms.shaft",
    "belt_drive": "frictionsim.mechanisms.belt_drive",
}
# Those of them that have a mesh; the summary of a result imports the module of no other one.
KINDS_WITH_MESH = ("belt_drive",)


def kind_names() -> tuple[str, ...]:
    """Return all kinds: the built-in ones, then those of installed packages, sorted."""
    return (*KINDS, *sorted(_installed().keys() - KINDS.keys()))


def sound_kinds() -> tuple[str, ...]:
    """Return the kinds as `kind_names`, without those whose plug-in is faulty, with a warning."""
    import logging

    kinds = list(kind_names())
    for kind in kinds[len(KINDS) :]:
        try:
            mechanism_module(kind)
        except InputError as error:
            logging.getLogger(__name__).warning("%s", error)
            kinds.remove(kind)
    return tuple(kinds)


def mechanism_module(kind: str) -> ModuleType:
    """Import the module of a kind, without the other kinds; see `frictionsim.mechanisms`."""
    if kind in KINDS:
        return import_module(KINDS[kind])
    point = _installed().get(kind)
    if point is None:
        raise InputError(unknown("kind", kind, list(kind_names())))
    package = point.dist.name if point.dist else "a package without a name"
    plugin = f"the plug-in of the kind '{kind}' (module {point.value} of {package})"
    try:
        module = import_module(point.value)
    except (Exception, SystemExit) as error:
        raise InputError(
            f"{plugin} cannot be imported: {type(error).__name__}: {error}; repair or uninstall"
            f' {package} (python -c "import {point.value}" shows where it fails)'
        ) from error
    missing = [name for name in REQUIRED if not hasattr(module, name)]
    # `build` is what the default ladders and references of a study need.
    if not hasattr(module, "build") and not hasattr(module, "ladders"):
        missing.append("build (or ladders and references)")
    if missing:
        raise InputError(
            f"{plugin} is not complete: its module lacks {', '.join(missing)}; repair or uninstall"
            f" {package}"
        )
    return module


@cache  # a study asks for the module of its kind before each run
def _installed() -> "dict[str, EntryPoint]":
    from importlib.metadata import entry_points

    return {point.name: point for point in entry_points(group=GROUP)}


def unit_of(kind: str, key: str) -> str:
    """Return the unit of a key of the scenarios of a kind; empty if it has none or is unknown."""
    from frictionsim.scenario.model_fields import description_of  # its models are slow to import

    try:
        return description_of(mechanism_module(kind).SCENARIO, key)[0]
    except (InputError, AttributeError, KeyError, TypeError):
        return ""
