"""The channels of the shipped scenarios by every law and method."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import frictionsim as fs
from tests.net.digests import data, digest

BELT = "belt_drive"
LAW_OF = ("shaft_friction", "hinge_friction", "rolling_friction", "belt_friction")
PARAMETERS: dict[str, dict[str, float]] = {
    "regularised": {"transition_speed": 0.1},
    "creep": {"transition_speed": 0.1, "maximum_creep": 1e-6},
}
STEPS, STEPS_OF_OWN = 3000, 8000


def names() -> list[str]:
    """Return the shipped scenarios, those that take long first."""
    kinds = {name: fs.load(path).kind for name, path in fs.scenarios().items()}
    return sorted(kinds, key=lambda name: (kinds[name] != BELT, name))


def of_scenario(name: str, folder: Path) -> Iterator[tuple[str, Any]]:
    """Yield the runs of a scenario as it is, and by every pair of law and method."""
    path = fs.scenarios()[name]
    scenario = fs.load(path)
    own = (scenario.law, scenario.solver.backend)
    yield name, _run(path, {}, STEPS_OF_OWN, folder)
    schema = fs.schema(scenario.kind)
    for law in choices(schema, "law"):
        for method in choices(schema, "backend"):
            if (law, method) != own:
                overrides = _changes(scenario, law, method)
                yield f"{name} {law} {method}", _run(path, overrides, STEPS, folder)


def choices(schema: Any, key: str) -> list[str]:
    """Return the values that a schema lists for a key, wherever it stands."""
    values: list[str] = []
    inner = schema.values() if isinstance(schema, dict) else schema
    if isinstance(schema, dict) and "enum" in (own := schema.get(key, {})):
        values = list(own["enum"])
    for value in inner:
        if isinstance(value, dict | list):
            values += choices(value, key)
    return list(dict.fromkeys(values))


def _changes(scenario: fs.Scenario, law: str, method: str) -> dict[str, Any]:
    """Return the overrides for a law and a method."""
    table = tomllib.loads(scenario.to_toml())
    changes: dict[str, Any] = {"solver.backend": method}
    changes |= {f"solver.{key}": None for key in ("step", "max_step") if key in table["solver"]}
    wanted = {"law": law, **PARAMETERS.get(law, {})}
    for effect, keys in table.get("effects", {}).items():
        if effect in LAW_OF:
            left = {key for key in PARAMETERS["creep"] if key in keys and key not in wanted}
            changes |= {f"effects.{effect}.{key}": None for key in left}
            changes |= {f"effects.{effect}.{key}": value for key, value in wanted.items()}
    return changes


def _run(path: Path, overrides: dict[str, Any], steps: int, folder: Path) -> Any:
    try:
        result = fs.solve(path, overrides, max_steps=steps)
    except fs.FrictionsimError as error:
        return {"refused": data(str(error), folder)}
    except Exception as error:  # a defect is what a commit does, too
        return {"defect": f"{type(error).__name__}: {error}"}
    statistics = result.statistics
    assert statistics is not None
    return data(
        {
            "json": result.to_json() | {"events": None},
            "steps": list(statistics[:4]),
            "events": _variables(result.events),
            "channels": _variables(result.dataset),
        },
        folder,
    )


def _variables(dataset: Any) -> dict[str, Any]:
    return {
        str(name): digest(variable.to_numpy()) | {"unit": variable.attrs.get("units", "")}
        for name, variable in dataset.variables.items()
    }
