"""The kinds of mechanism, by the name that a scenario gives as `kind`: built in or installed.

An installed package adds kinds by entry points of the group `frictionsim.kinds`. They are read only
for a kind that is not built in, since searching the installed packages takes longer than simulating
a pulley.
"""

from importlib import import_module
from types import ModuleType

from frictionsim.errors import InputError, unknown

# The built-in kinds and their modules.
KINDS = {
    "pulley": "frictionsim.mechanisms.pulley",
    "marble_machine": "frictionsim.mechanisms.marble_machine",
    "epicyclic": "frictionsim.mechanisms.epicyclic",
    "shaft": "frictionsim.mechanisms.shaft",
    "belt_drive": "frictionsim.mechanisms.belt_drive",
}


def kind_names() -> tuple[str, ...]:
    """Return all kinds: the built-in ones, then those of installed packages, sorted."""
    from frictionsim.scenario import plugins

    return (*KINDS, *plugins.names(tuple(KINDS)))


def sound_kinds() -> tuple[str, ...]:
    """Return the kinds as `kind_names`, without those whose plug-in is faulty."""
    from frictionsim.scenario import plugins

    return (*KINDS, *plugins.sound_names(tuple(KINDS)))


def mechanism_module(kind: str) -> ModuleType:
    """Import the module of a kind, without the other kinds.

    Returns
    -------
    module
        With the names that `frictionsim.mechanisms` lists.
    """
    if kind in KINDS:
        return import_module(KINDS[kind])
    from frictionsim.scenario import plugins

    module = plugins.module_of(kind)
    if module is None:
        raise InputError(unknown("kind", kind, list(kind_names())))
    return module
