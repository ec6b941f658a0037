"""Numbers in CSV files: what they mean to a signal and to a fit, whoever has written them."""

from collections.abc import Callable
from math import exp, pi
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from tests.support.cases import one_in

Told = Callable[..., tuple[str, str]]

SHAFT = 'kind = "shaft"\nmechanism = { inertia = 1.0 }\nsolver = { duration = 2.0 }\n'
LIFT = """kind = "pulley"
mechanism = { cord_radius = 0.05, inertia = 1.0, load = 2200.0 }
drive = { force = 0.0 }
solver = { duration = 1.0 }
effects = { shaft_friction = { shaft_radius = 0.025, mu_s = 0.2, mu_k = 0.1 } }
"""


def signal_of(text: str, folder: Path, key: str = "drive.force", **keys: Any) -> Any:
    """Return the points that a signal has from a file with a text, as the scenario stores them."""
    (folder / "log.csv").write_text(text, encoding="utf-8")
    table = {"csv": str(folder / "log.csv"), **keys}
    if key == "drive.force":
        return fs.loads(LIFT, {key: table}).to_dict()["drive"]["force"]
    couples = [{"name": "motor", "size": table}]
    return fs.loads(SHAFT, {"couples": couples}).to_dict()["couples"][0]["size"]


@pytest.mark.parametrize(
    ("header", "rows", "keys"),
    [
        ("n [rpm],M [N m]", "0,10\n3000,0", {"speed": "n [rpm]", "value": "M [N m]"}),
        ("n [rpm],M [N m]", "0,10\n3000,0", {"speed": "n", "value": "M"}),
        ("n (rpm);M (kN m)", "0;0,01\n3000;0", {"speed": 1, "value": 2}),
        ("M (mNm) n (1/min)", "1e4 0\n0 3000", {"speed": "n", "value": "M"}),
        ('"M, motor"\tn\n"N·m"\t"rpm"', '"10"\t"0"\n"0"\t"3000"', {"speed": 2, "value": 1}),
    ],
)
def test_a_motor_curve_over_rpm_ends_at_its_idle_speed(
    header: str, rows: str, keys: dict[str, Any], tmp_path: Path
) -> None:
    """I w' = M0 (1 - w/w0): w = w0 (1 - exp(-M0 t/(I w0)))."""
    size = signal_of(f"{header}\n{rows}\n", tmp_path, "couples", **keys)
    scenario = fs.loads(SHAFT, {"couples": [{"name": "motor", "size": size}]})
    idle = 100.0 * pi
    for duration in (10.0, 1000.0):
        result = fs.solve(scenario, {"solver.duration": duration})
        # Default tolerance of the solver: 1e-9 and better.
        assert result.quantities["final_angular_velocity"].value == pytest.approx(
            idle * (1.0 - exp(-10.0 * duration / idle)), rel=1e-7
        )


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("t (s);F (kN)\n0;2\n1;3\n", {"time": "t (s)", "value": "F (kN)"}),
        ("t (s);F (kN)\n0;2\n1;3\n", {"value": 2}),
        ("t (s);F (kN)\n0;2\n1;3\n", {}),
        ("t [ms] F [N]\n0 2000\n1000 3000\n", {}),
        ("time\tforce\nmin\tmN\n0\t2e6\n1\t62e6", {"time": "time", "value": "force"}),
        ("s,kN\n0,2\n1,3", {}),
        ("Logger 7 (kg)\nt;note;F\ns;-;kN\n0,0;a;2,0\n1,0;b;3,0\n", {"value": "F"}),
    ],
)
def test_a_load_lifts_off_when_the_force_suffices_in_its_unit(
    text: str, keys: dict[str, Any], tmp_path: Path
) -> None:
    """The same as with 2000 N at 0 s and 3000 N at 1 s, in newtons."""
    force = signal_of(text, tmp_path, **keys)
    result = fs.solve(fs.loads(LIFT, {"drive.force": force}))
    # Digits as they are printed.
    assert result.quantities["breakaway_time"].value == pytest.approx(0.678363, abs=5e-7)
    assert result.quantities["final_angle"].value == pytest.approx(0.872950, abs=5e-7)


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ('"t","M"\n"0","1"\n"1","1"\n', ""),
        ('"t","M"\n"0","1"\n"1","1"\n', ', time = "t", value = "M"'),
        ('0;"1"\n1;"1"\n', ""),
        ('"0,0"; "1,0"\n"1,0";"1,0"', ""),
        ('"a;b"\t"M"\n"0"\t"1,0"\n"1"\t1', ""),
        ("0,0;1,0\n1,0;1,0", ""),
        ("\ufeff0  1\r\n 1\t1  # end\r\n", ""),
        ('"0"|"1"\n1|1,0\n', ', delimiter = "|"'),
        ("0,0 1,0\n1,0 1,0\n", ', decimal = ","'),
    ],
)
def test_cells_in_quotes_are_cells_and_numbers(
    text: str, keys: str, here: Path, told: Told
) -> None:
    """A couple of 1 N m turns 1 kg m^2 at 2 rad/s after 2 s."""
    Path("q.csv").write_text(text, encoding="utf-8", newline="")
    Path("a.toml").write_text(
        SHAFT + f'couples = [{{ name = "motor", size = {{ csv = "q.csv"{keys} }} }}]\n'
    )
    printed, _ = told("solve", "a.toml")
    assert printed.split("final_angular_velocity")[1].split()[0] == "2"


# Units, by what they are of, and their sizes in SI.
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "": 1.0}
SPEEDS = {"rad/s": 1.0, "rpm": pi / 30, "deg/s": pi / 180, "rev/s": 2 * pi, "": 1.0}
TORQUES = {"N m": 1.0, "kN m": 1e3, "mNm": 1e-3, "lbf ft": 1.3558179483314004, "": 1.0}
numbers = st.floats(-1e3, 1e3).map(lambda x: round(x, 3))


@given(st.data())
def test_a_table_means_the_same_however_it_is_written(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("csv")
    draw = data.draw
    argument, units = draw(st.sampled_from([("time", TIMES), ("speed", SPEEDS)]))
    x_unit, y_unit = draw(st.sampled_from(sorted(units))), draw(st.sampled_from(sorted(TORQUES)))
    points = sorted(draw(st.sets(numbers, min_size=2, max_size=5)))
    values = [draw(numbers) for _ in points]
    delimiter = draw(st.sampled_from([";", "\t", ",", " ", "   ", "|"]))
    decimal = "." if delimiter == "," else draw(st.sampled_from(".,"))

    def cell(content: Any) -> str:
        text = str(content).replace(".", decimal) if isinstance(content, float) else content
        quoted = draw(st.booleans()) or (" " in text and delimiter.isspace())
        return f'"{text}"' if quoted else text

    def heading(name: str, unit: str) -> str:
        return cell(
            f"{name} {draw(st.sampled_from(['[{}]', '({})'])).format(unit)}" if unit else name
        )

    rows = [[heading("x, y", x_unit).replace(",", ""), heading("M", y_unit)]]
    rows += [[cell(x), cell(y)] for x, y in zip(points, values, strict=True)]
    text = "\n".join(delimiter.join(row) for row in rows) + draw(
        st.sampled_from(["", "\n", "\r\n"])
    )
    keys: dict[str, Any] = draw(st.sampled_from([{argument: 1}, {argument: 1, "value": 2}]))
    # A decimal comma would be taken for the delimiter between blanks.
    given_ones = {"delimiter": delimiter[0]}
    needs_key = delimiter == "|" or (delimiter[0] == " " and decimal == ",")
    keys |= given_ones if needs_key or draw(st.booleans()) else {}
    keys |= {"decimal": decimal} if draw(st.booleans()) else {}
    if "decimal" in keys and keys.get("delimiter") == decimal:
        del keys["decimal"]
    read = signal_of(text, folder, "couples", **keys)
    # Rounding of the factor and of one product.
    assert read[argument] == pytest.approx([x * units[x_unit] for x in points], rel=1e-14)
    assert read["value"] == pytest.approx([y * TORQUES[y_unit] for y in values], rel=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "t [ms],w [rpm]\n0,0\n250,30\n1000,120\n",
        "t (min);w\n;deg/s\n0,0;0\n0,0041666666666666667;180,0\n0,016666666666666666;720\n",
        '"t"\t"w"\n"s"\t"rad/s"\n"0"\t"0"\n"0,25"\t"3,141592653589793"\n1\t"12,566370614359172"',
    ],
)
def test_a_fit_and_a_signal_take_a_file_for_the_same(text: str, tmp_path: Path) -> None:
    """A couple of 4 pi N m turns 1 kg m^2 at the speeds of the file."""
    (tmp_path / "log.csv").write_text(text)
    epicyclic = fs.load("epicyclic", {"drive": {"speed": {"csv": str(tmp_path / "log.csv")}}})
    drive = epicyclic.to_dict()["drive"]["speed"]
    assert drive["time"] == pytest.approx([0.0, 0.25, 1.0])
    assert drive["value"] == pytest.approx([0.0, pi, 4.0 * pi])
    fit = fs.fit(
        fs.loads(SHAFT, {"couples": [{"name": "motor", "size": 1.0}]}),
        data=str(tmp_path / "log.csv"),
        channels={"angular_velocity": "w"},
        free={"couples.motor.size": (1.0, 20.0)},
        starts=1,
    )
    assert fit.values["couples.motor.size"] == pytest.approx(4.0 * pi, rel=1e-6)


@pytest.mark.parametrize(
    ("header", "keys", "found", "wanted"),
    [
        ("t,M [kN]", {}, "unit of column 2, 'M [kN]'", "N m, mN m, kN m"),
        ("t,M [motor]", {}, "got 'motor'", "N m"),
        ("t,M (measured)", {"time": "t", "value": "M (measured)"}, "got 'measured'", "N m"),
        ("n [rpm],M [N m]", {}, "unit of column 1, 'n [rpm]'", "one of s, ms"),
        ("t [ms],M", {"speed": "t"}, "got 'ms'", "rad/s, deg/s"),
        ("t,M\ns,kgf", {"time": "t", "value": "M"}, "line 2 of", "N m"),
        ("t,M\n,kgf", {"time": "t", "value": "M"}, "got 'kgf'", "N m"),
        ("t,M\ns,kgf", {}, "line 2 of", "N m"),
        ("t [s],F [m N]", {}, "got 'm N'", "N m"),
    ],
)
def test_a_unit_that_is_not_known_or_does_not_fit_is_refused(
    header: str, keys: dict[str, Any], found: str, wanted: str, tmp_path: Path
) -> None:
    with pytest.raises(fs.ScenarioError) as refused:
        signal_of(f"{header}\n0,1\n1,2\n", tmp_path, "couples", **keys)
    said = str(refused.value)
    for part in ("log.csv', unit of column", found, wanted, "convert the numbers", "without it"):
        assert part in said


@pytest.mark.parametrize("header", ["t; [s]; F [kN]", "Log of F [kN]"])
def test_a_unit_in_the_cell_of_another_column_is_refused(header: str, tmp_path: Path) -> None:
    with pytest.raises(fs.ScenarioError, match=r"unit of column [12], '.*expected one of"):
        signal_of(f"{header}\n0;1\n1;2\n", tmp_path)


@pytest.mark.parametrize(
    "text",
    ["0.5;1.5\n1.0;1,234\n", "0.5;1\n1;1.234,5\n", '"0,5","1,5"\n"1,0","2,5"\n', "0;1\n1;2_0\n"],
)
def test_a_number_that_may_be_another_one_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(fs.ScenarioError, match=r"expected a finite number in column [12], got"):
        signal_of(text, tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "t,F\n0,0,1,5\n1,0,2,5\n",
            "line 2 .*expected 2 cells, got 4: '0,0,1,5'; with decimal comm",
        ),
        ("t;F\n0;1\n1;2;; x\n", "line 3 .*expected 2 cells, got 4: '1;2;;x'$"),
        ("Log\n\nt F\n0 1\n1  2 3", "line 5 .*expected 2 cells, got 3: '1 2 3'$"),
    ],
)
def test_a_line_of_more_cells_than_the_header_is_refused(
    text: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(fs.ScenarioError, match=said):
        signal_of(text, tmp_path, time="t", value="F")


@pytest.mark.parametrize("title", ["Run 3;;\n", "Run 3;;;\n\n", "Log;of;\n"])
def test_a_title_with_empty_cells_is_not_taken_for_the_header(title: str, tmp_path: Path) -> None:
    text = title + "t [ms];F [kN];v\n0;1,5;2\n10;1,6;2\n"
    with pytest.raises(fs.ScenarioError, match=r"unknown column 'Fo' .*'F'"):
        signal_of(text, tmp_path, time="t", value="Fo")


@pytest.mark.parametrize(
    ("key", "suggested"),
    [
        ("angle", "(did you mean 'angle_deg'?)"),
        ("angles_deg", "(did you mean 'angle_deg'?)"),
        ("sped", "(did you mean 'speed'?)"),
        ("tiem", "(did you mean 'time'?)"),
    ],
)
def test_keys_of_all_forms_of_points_are_suggested(
    key: str, suggested: str, here: Path, told: Told
) -> None:
    size = f"{{ {key} = [0, 1], value = [1, 0] }}"
    Path("a.toml").write_text(SHAFT + f'couples = [{{ name = "m", size = {size} }}]\n')
    _, said = told("check", "a.toml", code=2)
    assert said.splitlines() == [
        f"frictionsim: a.toml:4: couples.0.size.{key}: unknown key '{key}' {suggested}"
    ]


HEADINGS = [
    *("{} [{}]", "{} ({})", "{} {{{}}}", "{} <{}>", "[{1}] {0}", "{} [{}] filtered"),
    *("{}/{}", "{} / {}", "{} in {}", "{}_{}", "{} {}", "{1}", '"{}, {}"', "# {} [{}]"),
]
UNITS = [("rpm", pi / 30.0), ("RPM", pi / 30.0), ("U/min", pi / 30.0), ("deg/s", pi / 180.0)]


@pytest.mark.parametrize(
    ("heading", "unit", "size"),  # by default every heading, and each unit in some
    one_in(3, [(heading, *unit) for heading in HEADINGS for unit in UNITS]),
)
def test_every_way_to_write_a_unit_in_a_heading(
    heading: str, unit: str, size: float, tmp_path: Path
) -> None:
    end = 100.0 / size  # of the motor's line, in this unit
    text = f"{heading.format('n', unit)},{'M'}\n0,10\n{end!r},0\n"
    (tmp_path / "m.csv").write_text(text, encoding="utf-8")
    size_of_motor = {"csv": "m.csv", "speed": 1, "value": 2}
    tables = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "couples": [{"name": "motor", "size": size_of_motor}],
        "solver": {"duration": 20.0},
    }
    result = fs.solve(fs.load(tables, folder=tmp_path))
    # I w' = 10 (1 - w/100)
    exact = 100.0 * (1.0 - exp(-2.0))
    assert float(result.dataset["angular_velocity"][-1]) == pytest.approx(exact, rel=1e-7)


@pytest.mark.parametrize(
    ("first", "below"), [("t [ms],M", "[s],"), ("t/ms,M", "s,N m"), ("t,M [kN m]", "s,N m")]
)
def test_two_units_of_one_column_are_refused(first: str, below: str, tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text(f"{first}\n{below}\n0,1\n2,1\n")
    with pytest.raises(fs.ScenarioError, match="another unit than in line 1"):
        fs.load(
            {
                "kind": "shaft",
                "mechanism": {"inertia": 1.0},
                "couples": [{"name": "motor", "size": {"csv": "m.csv"}}],
                "solver": {"duration": 2.0},
            },
            folder=tmp_path,
        )


@pytest.mark.parametrize("name", ["F_s", "F m", "h", "F_left"])
def test_an_end_of_a_name_that_is_no_fitting_unit_is_a_part_of_it(
    name: str, tmp_path: Path
) -> None:
    (tmp_path / "m.csv").write_text(f"t,{name}\n0,1\n2,1\n")
    tables = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "couples": [{"name": "motor", "size": {"csv": "m.csv", "time": "t", "value": name}}],
        "solver": {"duration": 2.0},
    }
    result = fs.solve(fs.load(tables, folder=tmp_path))
    assert float(result.dataset["angular_velocity"][-1]) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("name", ["Torque", "Torque, N-m", 2])
@pytest.mark.parametrize("unit", ["N-m", "Nm", "N.m", "N m"])
def test_a_heading_with_a_comma_is_named_with_or_without_its_unit(
    name: str | int, unit: str, tmp_path: Path
) -> None:
    (tmp_path / "m.csv").write_text(f'"t, ms","Torque, {unit}"\n0,1\n2000,1\n')
    column = name.replace("N-m", unit) if isinstance(name, str) else name
    tables = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "couples": [{"name": "motor", "size": {"csv": "m.csv", "time": "t", "value": column}}],
        "solver": {"duration": 2.0},
    }
    result = fs.solve(fs.load(tables, folder=tmp_path))
    assert float(result.dataset["angular_velocity"][-1]) == pytest.approx(2.0, rel=1e-9)


def test_a_column_beyond_the_last_is_told(tmp_path: Path) -> None:
    with pytest.raises(fs.ScenarioError, match="has 2 columns, and no number 3"):
        signal_of("t,F\n0,1\n1,2\n", tmp_path, time=1, value=3)
