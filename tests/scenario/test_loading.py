"""Loading of scenarios: error messages with line and key, overrides, round trip to TOML."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs

TEXT = """\
kind = "pulley"
[mechanism]
cord_radius = 0.05
inertia = 1.5
load = 100.0
[drive]
force = {time = [0.0, 0.8], value = [80.0, 120.0]}
[effects.shaft_friction]
shaft_radius = 0.02
mu_s = 0.2
mu_k = 0.1
[solver]
duration = 3.0
"""
POINTS = "{time = [0.0, 0.8], value = [80.0, 120.0]}"


def edited(*changes: str) -> str:
    """Return the text with each `old -> new` done; FORCE stands for the signal."""
    text = TEXT
    for change in changes:
        old, _, new = change.replace("FORCE", POINTS).partition(" -> ")
        assert text.count(old) == 1, f"{old!r} does not name one place"
        text = text.replace(old, new)
    return text


def write_scenario(folder: Path, content: str | bytes) -> Path:
    path = folder / "s.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_a_faulty_scenario_writes_nothing_and_has_the_same_message_in_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_scenario(tmp_path, edited("1.5 -> -1", "3.0 -> 0"))
    before = sorted(tmp_path.iterdir())
    with pytest.raises(fs.ScenarioError) as refused:
        fs.load(path)
    assert fs.run_command_line(["solve", str(path), "-o", str(tmp_path / "a.h5")]) == 2
    told = "\n".join(refused.value.faults)
    assert capsys.readouterr() == ("", f"frictionsim: {told}\n")
    assert sorted(tmp_path.iterdir()) == before


def test_byte_order_mark_and_line_endings_are_accepted(tmp_path: Path) -> None:
    mark, end = b"\xef\xbb\xbf", b"\r\n"
    (tmp_path / "force.csv").write_bytes(mark + b"0; 80 # start" + end + b"0.8; 120" + end)
    text = edited('FORCE -> {csv = "force.csv"}').encode()
    loaded = fs.load(write_scenario(tmp_path, mark + text.replace(b"\n", end)))
    assert loaded == fs.load(write_scenario(tmp_path, TEXT))


# Each key that no scenario has is named at the end of its line.
ALL_WAYS_TO_WRITE_A_KEY = """\
a = 1  #= a
b.c = [  #= b
    1,  # one
    "]",
]
d = { e = { f = 1 }, g.h = 2 }  #= d
text = ''' #= text
[not.a.table]
i = 1
'''
kind = "shaft"

[j]  #= j
k.l = 1
[mechanism]
inertia = 1.0
x = 2  #= mechanism.x
"m.n" = 3  #= mechanism.'m.n'
[[forces]]
name = "load"
y.z = 1  #= forces.0.y
[[forces]]
name = "effort"
point.0 = 1
size = { sine = { u = 1 } }  #= forces.1.size.sine.u
"""


def test_all_forms_of_keys_have_the_line_on_which_they_stand(tmp_path: Path) -> None:
    expected = {
        line.partition("#= ")[2]: number
        for number, line in enumerate(ALL_WAYS_TO_WRITE_A_KEY.splitlines(), start=1)
        if "#=" in line
    }
    with pytest.raises(fs.ScenarioError) as refused:
        fs.load(write_scenario(tmp_path, ALL_WAYS_TO_WRITE_A_KEY))
    unknown = re.findall(r"s\.toml:(\d+): (\S+): unknown key", str(refused.value))
    assert {key: int(line) for line, key in unknown} == expected


def test_a_key_after_a_long_signal_has_its_line(tmp_path: Path) -> None:
    points = 8000
    signal = "{ time = [\n" + "".join(f"{i}.0,\n" for i in range(points)) + "], value = [0] }"
    text = edited(f"FORCE -> {signal}", "mu_s = 0.2 -> mu_s = -0.2")
    with pytest.raises(fs.ScenarioError, match=rf":{points + 11}: effects\.shaft_friction\.mu_s"):
        fs.load(write_scenario(tmp_path, text))


@pytest.mark.parametrize(
    ("override", "key", "value"),
    [
        ("solver.rtol=1e-6", "solver.rtol", 1e-6),
        (" solver . rtol = 1e-6 ", "solver.rtol", 1e-6),
        ("solver.backend=rkf45", "solver.backend", "rkf45"),
        ("drive.force.value.1=7", "drive.force.value", (80.0, 7.0)),
        ("output={interval=0.5}", "output.interval", 0.5),
        ("drive.force=7", "drive.force", 7.0),
        ("effects.viscous_damping={coefficient=2}", "effects.viscous_damping.coefficient", 2.0),
    ],
)
def test_overrides_take_precedence_over_the_file(
    override: str, key: str, value: Any, tmp_path: Path
) -> None:
    part_of_scenario: Any = fs.load(write_scenario(tmp_path, TEXT), [override])
    for part in key.split("."):
        part_of_scenario = getattr(part_of_scenario, part)
    assert part_of_scenario == value


def test_the_last_override_wins_and_the_backend_option_over_all(tmp_path: Path) -> None:
    overrides = ["solver.rtol=1e-3", "solver.rtol=1e-4", "solver.backend=events"]
    solver = fs.load(write_scenario(tmp_path, TEXT), overrides, "rkf45").solver
    assert (solver.rtol, solver.backend) == (1e-4, "rkf45")


@pytest.mark.parametrize(
    "force",
    [
        "7",
        POINTS,
        '{csv = "force.csv"}',
        "{sine = {mean = 1, amplitude = 2, frequency_hz = 0.5, phase_deg = 30}}",
        "{smooth_step = {from = 1, to = 2, start = 0, stop = 1}}",
    ],
)
def test_resolved_text_loads_to_the_same_scenario(force: str, tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text("time, force\n0, 80.1\n0.8, 120\n")
    first = fs.load(write_scenario(tmp_path, edited(f"FORCE -> {force}")), ["solver.rtol=1e-7"])
    text = first.to_toml()
    (tmp_path / "force.csv").unlink()
    again = fs.load(write_scenario(tmp_path, text))
    # The interval of the samples is filled in; all else is as it was.
    assert again.replace({"output.interval": first.interval}) == first.replace(
        {"output.interval": first.interval}
    )
    assert again.to_toml() == text
    points = "{time = [0.0, 0.8], value = [80.1, 120.0]}"
    expected = tomllib.loads(f"force = {points if 'csv' in force else force}")
    assert tomllib.loads(text)["drive"]["force"] == expected["force"]
