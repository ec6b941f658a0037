"""The kinds of mechanism, by the name that a scenario gives as `kind`.

Each module holds one mechanism whole - parameters, effects, equations, statics, outputs - as

    Scene              the model of its scenario files
    build(scene)       its equations, composed of the effects that the scene names
    statics(scene)     its figures of impending motion
    PANELS             the courses that a plot of it shows
"""

from importlib import import_module
from types import ModuleType

KINDS = {
    "pulley": "frictionsim.mechanisms.pulley",
    "marble_machine": "frictionsim.mechanisms.marble",
    "epicyclic": "frictionsim.mechanisms.epicyclic",
}


def module_of(kind: str) -> ModuleType:
    """Import the module of a kind; the others stay unloaded."""
    return import_module(KINDS[kind])
