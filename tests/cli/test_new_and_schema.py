"""`new` and `schema`: what to start from."""

import json
import shutil
from pathlib import Path

import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.scenario.test_json_schema import lint, with_taplo
from tests.support.cases import one_in
from tests.support.scenarios import SCENARIOS

KINDS = fs.kinds()
SHIPPED = tuple(fs.scenarios())


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_scenario_of_each_kind_is_valid(kind: str, told: Run) -> None:
    assert told("new", kind, "hoist.toml") == (f"hoist.toml\n{kind}.schema.json\n", "")
    out, err = told("check", "hoist.toml")
    assert (out.startswith("hoist.toml: ok; effects "), err) == (True, "")
    assert strict_json(told("check", "hoist.toml", "--json")[0])["scenarios"][0]["kind"] == kind
    first, _, text = Path("hoist.toml").read_text(encoding="utf-8").partition("\n")
    assert first == f"#:schema ./{kind}.schema.json"
    assert told("new", kind)[0] == text


@with_taplo
@pytest.mark.parametrize("name", [*KINDS, "swing_door", "hard/jump_from_csv"])
def test_editors_take_a_new_scenario_and_find_what_is_wrong_in_it(name: str, told: Run) -> None:
    Path("folder").mkdir()
    right, wrong = Path("folder/right.toml").absolute(), Path("folder/wrong.toml").absolute()
    told("new", name, "folder/right.toml")
    text = right.read_text(encoding="utf-8").replace("\nduration = ", "\nduratoin = ")
    wrong.write_text(text, encoding="utf-8")
    assert lint(right).returncode == 0
    assert "'duratoin' was unexpected" in lint(wrong).stderr


def test_a_schema_that_is_there_is_kept(told: Run) -> None:
    told("new", "pulley", "first.toml")
    made = Path("pulley.schema.json").read_text(encoding="utf-8")
    assert made == told("schema", "pulley")[0]
    assert told("new", "pulley_return", "second.toml") == ("second.toml\n", "")
    assert Path("pulley.schema.json").read_text(encoding="utf-8") == made


@pytest.mark.parametrize("name", one_in(3, SHIPPED))
def test_a_shipped_scenario_is_written(name: str, told: Run) -> None:
    shutil.copy(SCENARIOS / "hard" / "jump.csv", "jump.csv")
    told("new", name, "copy.toml")
    assert told("check", "copy.toml")[0].startswith("copy.toml: ok; effects ")
    if name not in KINDS:  # of these there is a commented one
        assert Path("copy.toml").read_text(encoding="utf-8").count("#:schema ./") == 1


def test_the_list_has_all(told: Run) -> None:
    out, err = told("new", "--list")
    assert err == ""
    kinds, _, shipped = out.partition("\n\n")
    assert kinds.splitlines() == ["kind", *KINDS]
    assert [line.split()[0] for line in shipped.splitlines()[1:]] == list(SHIPPED)
    assert "Pulley on a dry shaft" in shipped


@pytest.mark.parametrize("kind", [None, *KINDS])
def test_the_printed_schema_is_that_of_python_indented(kind: str | None, told: Run) -> None:
    assert told("schema", *filter(None, [kind])) == (
        json.dumps(fs.schema(kind), indent=2) + "\n",
        "",
    )
