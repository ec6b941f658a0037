"""`frictionsim static` of a body on a shaft: roots with directions, and sentences about them."""

from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import SCENARIOS

CRANK = SCENARIOS / "shaft.toml"
UNKNOWN = "statics.unknown=forces.effort.size"


def test_static_says_below_the_table_what_the_roots_mean(told: Run) -> None:
    out, err = told("static", CRANK, "--set", UNKNOWN)
    assert err == ""
    # A key with dots needs no quotes, and may have them.
    assert told("static", CRANK, "--set", 'statics.unknown="forces.effort.size"') == (out, "")
    lines = out.splitlines()
    row = next(line.split() for line in lines if line.startswith("effort_counter_clockwise "))
    assert row == ["effort_counter_clockwise", "208.4430034", "N"]
    assert lines[-2:] == [
        "at 0 deg and 0 s, the body rests",
        "at 0 deg, the body rests with forces.effort.size from 191.689 N to 208.443 N",
    ]


def test_static_as_json_has_the_sentences_as_notes(told: Run) -> None:
    found = strict_json(
        told("static", CRANK, "--set", "statics.unknown=mechanism.mass", "--json")[0]
    )
    assert found.keys() == {"scenario", "overrides", "kind", "quantities", "notes"}
    assert found["quantities"]["mass_clockwise"] == {"value": None, "unit": "kg"}
    assert found["notes"][:2] == [
        "at 0 deg and 0 s, the body rests",
        "at 0 deg, no mechanism.mass makes the body move: the friction exceeds the moment with any",
    ]
