"""The kinds of mechanism, by the name that a scenario gives as `kind`."""

from importlib import import_module
from types import ModuleType

KINDS = {
    "pulley": "frictionsim.mechanisms.pulley",
    "marble_machine": "frictionsim.mechanisms.marble_machine",
    "epicyclic": "frictionsim.mechanisms.epicyclic",
    "belt_drive": "frictionsim.mechanisms.belt_drive",
}


def mechanism_module(kind: str) -> ModuleType:
    """Import the module of a kind, without the other kinds."""
    return import_module(KINDS[kind])
