"""Which friction laws and integration methods go together, by validating each pair."""

import tomllib
from pathlib import Path
from typing import Any, get_args

from markdown import table
from scenario_keys import model_of, tables

from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.methods import BACKENDS

SCENARIOS = Path(__file__).parents[2] / "scenarios"
# A shipped scenario of each kind, and the effect that has its friction law.
EXAMPLES = {
    "pulley": "shaft_friction",
    "marble_machine": "shaft_friction",
    "epicyclic": "hinge_friction",
    "belt_drive": "belt_friction",
}
# What a law needs beside its name.
PARAMETERS = {
    "regularised": {"transition_speed": 1e-3},
    "creep": {"transition_speed": 1e-3, "maximum_creep": 1e-4},
}


def methods() -> str:
    """Return a table of the methods that go with each law; kinds with the same rows share them."""
    kinds: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for kind in EXAMPLES:
        kinds.setdefault(tuple(pairs(kind).items()), []).append(f"`{kind}`")
    rows = [
        (", ".join(names) if number == 0 else "", f"`{law}`", able)
        for laws, names in kinds.items()
        for number, (law, able) in enumerate(laws)
    ]
    return table(("kind", "`law`", "`solver.backend`"), rows)


def pairs(kind: str) -> dict[str, str]:
    """Return the methods that a scenario of a kind is accepted with, by law."""
    return {
        law: " ".join(f"`{name}`" for name in BACKENDS if accepted(kind, law, name))
        for law in laws(kind)
    }


def laws(kind: str) -> tuple[str, ...]:
    """Return the friction laws of a kind."""
    header = f"[effects.{EXAMPLES[kind]}]"
    model = next(t.model for t in tables(model_of(kind)) if t.header == header)
    law = model.model_fields.get("law")
    return get_args(law.annotation) if law else ()


def accepted(kind: str, law: str, backend: str) -> bool:
    """Tell whether a scenario of a kind may have a law and a method."""
    data: dict[str, Any] = tomllib.loads((SCENARIOS / f"{kind}.toml").read_text())
    friction = data["effects"][EXAMPLES[kind]]
    friction.pop("transition_speed", None)
    friction.update({"law": law, **PARAMETERS.get(law, {})})
    data["effects"].pop("rolling_friction", None)  # the same contact, with a law of its own
    data["solver"]["backend"] = backend
    try:
        validate(data, SCENARIOS)
    except ValidationFailure:
        return False
    return True
