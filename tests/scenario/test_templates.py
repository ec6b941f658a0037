"""Starting scenarios: they load, also with their commented keys."""

import re
import tomllib
from pathlib import Path

import jsonschema
import pytest

import frictionsim as fs
from tests.scenario.test_methods import BELTS, ONE_COORDINATE
from tests.support.plugins import BELT_BLOCK, BRAKE, install, searched
from tests.support.scenarios import SCENARIOS

KINDS = fs.kinds()
TEXTS = {kind: fs.new(kind) for kind in KINDS}
WIDTH = 100
OF_SIGNALS = {
    *("PiecewiseLinearTable", "SineTable", "SineParameters", "SmoothStepTable"),
    *("SmoothStepParameters", "SpeedTable", "AngleTable", "CsvTable", "CsvSpeedTable"),
    *(of + form for of in ("Coefficient", "Couple", "Arm")
      for form in ("Points", "Stribeck", "StribeckParameters")),
}  # fmt: skip


def loaded(text: str) -> fs.Scenario:
    return fs.load(tomllib.loads(text), folder=Path("nowhere"))


def with_effects(text: str, names: list[str]) -> str:
    """Return a scenario with the tables of effects in use that are commented out."""
    blocks = text.split("\n\n")
    for i, block in enumerate(blocks):
        match = re.match(r"# \[effects\.(\w+)\]", block)
        if match and match[1] in names:
            blocks[i] = "\n".join(line.removeprefix("# ") for line in block.splitlines())
    match = "\n\n".join(blocks)
    # Its comment says that a load is left out with hanging masses.
    return (
        re.sub(r"^load = ", "# load = ", match, flags=re.M) if "hanging_masses" in names else match
    )


def effects_left_out(kind: str) -> list[str]:
    return re.findall(r"^# \[effects\.(\w+)\]", TEXTS[kind], re.MULTILINE)


@pytest.mark.parametrize("kind", KINDS)
def test_it_fits_its_schema_and_has_the_values_of_the_shipped_scenario(
    kind: str, tmp_path: Path
) -> None:
    path = tmp_path / "new.toml"
    path.write_text(TEXTS[kind])
    assert fs.load(path) == fs.load(SCENARIOS / f"{kind}.toml")
    jsonschema.Draft202012Validator(fs.schema(kind)).validate(tomllib.loads(TEXTS[kind]))


def effects_of(kind: str) -> set[str]:
    """Return the effects of a kind, of the table of them in its schema."""
    made = fs.schema(kind)
    effects = made["properties"]["effects"]
    return set(made["$defs"][effects["$ref"].rpartition("/")[2]]["properties"])


@pytest.mark.parametrize("kind", KINDS)
def test_each_effect_is_there_in_use_or_as_a_comment(kind: str) -> None:
    used = set(loaded(TEXTS[kind]).effect_names)
    left_out = effects_left_out(kind)
    effects = effects_of(kind)
    assert sorted([*used, *left_out]) == sorted(effects)
    assert set(loaded(with_effects(TEXTS[kind], left_out)).effect_names) == effects


@pytest.mark.parametrize("kind", KINDS)
def test_values_in_comments_are_the_defaults(kind: str) -> None:
    blocks = TEXTS[kind].split("\n\n")
    count = 0
    for i, block in enumerate(blocks):
        if not block.startswith("# ["):
            lines = block.splitlines()
            optional = [n for n, line in enumerate(lines) if re.match(r"# \w+ = +[^ #]", line)]
            for n in optional:
                lines[n] = lines[n].removeprefix("# ")
            blocks[i] = "\n".join(lines)
            count += len(optional)
    assert count >= 3
    assert loaded("\n\n".join(blocks)) == loaded(TEXTS[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_each_key_and_its_meaning_are_there(kind: str) -> None:
    flat = re.sub(r"\n[# ]*  # ", " ", TEXTS[kind])
    made = fs.schema(kind)
    for name, table in {"": made, **made["$defs"]}.items():
        if name in OF_SIGNALS:  # which a file has on one line
            continue
        for key, described in table["properties"].items():
            meaning = described.get("description", "")
            value = "$ref" not in described and "additionalProperties" not in described
            (form, *_) = described.get("oneOf", [described.get("items", {})])
            value = value and "$ref" not in form
            assert not value or re.search(rf"^(# )*{key} =", flat, re.MULTILINE), key
            assert meaning.removesuffix(f" Unit: {described.get('unit')}.") in flat, key
    # Two more, where a table is commented out.
    assert max(map(len, TEXTS[kind].splitlines())) <= WIDTH + 2


def test_a_key_has_its_unit_meaning_and_choices() -> None:
    meaning = "Moment of inertia of the pulley; 0 with taut masses or a\n"
    assert f"inertia = 1.355                   # kg m^2: {meaning}" in TEXTS["pulley"]
    assert "3113.75] }  # N, signal, or a list of them, which add:\n" in TEXTS["pulley"]
    belt = TEXTS["belt_drive"]
    assert "\nc1 = 3.0256e9 " in belt  # as it is written in the example
    assert "# # g = 9.81  # m/s^2: Acceleration of gravity.\n" in belt
    assert "# [effects.belt_friction.pulleys.NAME]\n" in belt
    assert "angle_deg = [" not in belt
    assert "atol" not in belt.replace("rtol", "")  # which belts refuse
    assert "# [[couples]]  # A torque on the body. It does not load the shaft" in TEXTS["shaft"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_heading_names_effects_laws_and_backends(kind: str) -> None:
    heading = TEXTS[kind].split("\n\n")[0]
    # Of the text alone no file is known that a schema could stand beside.
    assert heading.startswith(f"# The line `#:schema ./{kind}.schema.json` at the top of a file")
    assert f"`frictionsim schema {kind} > {kind}.schema.json`" in " ".join(heading.split("\n# "))
    for law, methods in (BELTS if kind == "belt_drive" else ONE_COORDINATE).items():
        assert re.search(rf"#   {law}: .*\n#     {', '.join(methods)}", heading)
    for name in (*loaded(TEXTS[kind]).effect_names, *effects_left_out(kind)):
        assert name in heading


def test_a_kind_from_outside_brings_its_example(here: Path) -> None:
    with searched(install(BELT_BLOCK, here / "a")):
        message = "there is no example of kind 'belt_block' to start from: its module"
        with pytest.raises(fs.InputError, match=message):
            fs.new("belt_block")
    site, damping = install(BRAKE, here / "b"), r"\[effects\.viscous_damping\]\n.*\n\n"
    example = site / "frictionsim_brake" / "block_brake.toml"
    without, count = re.subn(damping, "", example.read_text(encoding="utf-8"))
    assert count == 1
    example.write_text(without, encoding="utf-8")
    with searched(site):
        text = fs.new("block_brake")
        assert loaded(text) == loaded(without)
        assert "\ninertia = 2.0 " in text
        assert "  # N, signal: Force of the block on the rim, not negative.\n" in text
        # No example has its value: it has no place to come from.
        assert "\n# [effects.viscous_damping]  # Viscous damping: a torque -b w.\n" in text
        assert "\n# coefficient =  # N m s:" in text
        assert "\n[solver]" in text
