"""The JSON schema of scenarios: it takes what loads, and refuses what editors can point at."""

import sys
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, reject

import frictionsim as fs
from tests.docs.pages import DOCS
from tests.support.belt_scenarios import PAIR
from tests.support.drawn_scenarios import scenarios
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley

sys.path.insert(0, str(DOCS / "_ext"))
from generated import schemas

KINDS = fs.kinds()
SHIPPED = sorted(SCENARIOS.rglob("*.toml"))
VALIDATORS = {kind: jsonschema.Draft202012Validator(fs.schema(kind)) for kind in (None, *KINDS)}


def faults(data: Scenario, kind: str | None = None) -> list[str]:
    """Return the messages of the schema of a kind, and those of all kinds if they differ in any."""
    kind = kind or str(data["kind"])
    messages = [error.message for error in VALIDATORS[kind].iter_errors(data)]
    assert bool(messages) == bool(list(VALIDATORS[None].iter_errors(data)))
    return messages


@pytest.mark.parametrize("kind", [None, *KINDS])
def test_a_schema_is_a_schema(kind: str | None) -> None:
    made = fs.schema(kind)
    assert made["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert made["title"].startswith("Scenario of ")
    jsonschema.Draft202012Validator.check_schema(made)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_scenarios_fit_and_name_their_schema(path: Path) -> None:
    text = path.read_text()
    data = tomllib.loads(text)
    assert faults(data) == []
    directive, file = text.splitlines()[0].split()
    assert directive == "#:schema"
    assert (path.parent / file).resolve() == SCENARIOS / "schemas" / f"{data['kind']}.json"


def test_the_schemas_beside_the_scenarios_are_fresh() -> None:
    files = schemas()
    assert sorted(files) == sorted((SCENARIOS / "schemas").iterdir())
    for path, text in files.items():
        assert path.read_text() == text, "run docs/_ext/generated.py"


@given(scenarios())
def test_random_scenarios_that_load_fit(data: Scenario) -> None:
    try:
        resolved = fs.load(data, folder=SCENARIOS).to_dict()
    except fs.ScenarioError:
        reject()
    assert faults(data) == []
    lists = {k: list(v) if isinstance(v, tuple) else v for k, v in resolved["output"].items()}
    assert faults(data | {"solver": resolved["solver"], "output": lists}) == []


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"mechanism__lod": 3.0}, "Additional properties are not allowed ('lod' was unexpected)"),
    # A retired key, which loading refuses with advice.
    ({"effects__air_drag": {"coefficient": 1.0}}, "Additional properties are not allowed"),
    ({"mechanism__load": None}, "'load' is a required property"),
    ({"mechanism__load": -1.0}, "-1.0 is less than the minimum of 0"),
    ({"solver__max_steps": 1.5}, "1.5 is not of type 'integer'"),
    ({"solver__backend": "moreau"}, "'moreau' is not one of ['events', 'rkf45', "),
    ({"output__channels": ["angel"]}, "'angel' is not one of ['angle', "),
    ({"drive__force": "x"}, "'x' is not valid under any of the given schemas"),
    ({"drive__force": {"speed": [1], "value": [1]}}, "{'speed': [1], 'value': [1]} is not valid"),
]


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_a_wrong_scenario_is_refused(changes: dict[str, Any], message: str) -> None:
    (text,) = faults(pulley(**changes))
    assert text.startswith(message)


def test_each_variant_has_its_own_keys() -> None:
    csv = {"csv": "a.csv", "time": "t", "value": 3, "delimiter": "\t", "decimal": ","}
    assert faults(pulley(drive__force=csv)) == []
    lift = tomllib.loads((SCENARIOS / "lift.toml").read_text())
    assert faults(changed(lift, mechanism__load=0.0)) == []
    assert faults(changed(lift, mechanism__load=5.0)) == ["0 was expected"]
    belt = changed(tomllib.loads(PAIR), solver__atol=1e-3)
    assert faults(belt) == ["Additional properties are not allowed ('atol' was unexpected)"]


@pytest.mark.parametrize(
    ("schema_of", "kind", "message"),
    [
        (None, "pully", "'pully' is not one of"),
        (None, "epicyclic", "'sun_radius' is a required property"),
        ("epicyclic", "pulley", "'epicyclic' was expected"),
    ],
)
def test_the_key_kind_decides(schema_of: str | None, kind: str, message: str) -> None:
    messages = [error.message for error in VALIDATORS[schema_of].iter_errors(pulley(kind=kind))]
    assert any(text.startswith(message) for text in messages), messages
