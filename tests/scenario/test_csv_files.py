"""Numbers in CSV files: what they mean to a signal and to a fit, whoever has written them."""

from math import exp, pi
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs

SHAFT = 'kind = "shaft"\nmechanism = { inertia = 1.0 }\nsolver = { duration = 2.0 }\n'
LIFT = """kind = "pulley"
mechanism = { cord_radius = 0.05, inertia = 1.0, load = 2200.0 }
drive = { force = 0.0 }
solver = { duration = 1.0 }
effects = { shaft_friction = { shaft_radius = 0.025, mu_s = 0.2, mu_k = 0.1 } }
"""


def signal_of(text: str, folder: Path, key: str = "drive.force", **keys: Any) -> Any:
    """Return the points that a signal has from a file with a text, as the scenario stores them."""
    (folder / "log.csv").write_text(text, encoding="utf-8", newline="")
    table = {"csv": str(folder / "log.csv"), **keys}
    if key == "drive.force":
        return fs.loads(LIFT, {key: table}).to_dict()["drive"]["force"]
    couples = [{"name": "motor", "size": table}]
    return fs.loads(SHAFT, {"couples": couples}).to_dict()["couples"][0]["size"]


def test_a_motor_curve_over_rpm_ends_at_its_idle_speed(tmp_path: Path) -> None:
    """I w' = M0 (1 - w/w0): w = w0 (1 - exp(-M0 t/(I w0)))."""
    rows = "n (rpm);M (kN m)\n0;0,01\n3000;0\n"
    size = signal_of(rows, tmp_path, "couples", speed=1, value=2)
    scenario = fs.loads(SHAFT, {"couples": [{"name": "motor", "size": size}]})
    idle = 100.0 * pi
    for duration in (10.0, 1000.0):
        result = fs.solve(scenario, {"solver.duration": duration})
        # Default tolerance of the solver: 1e-9 and better.
        assert result.quantities["final_angular_velocity"].value == pytest.approx(
            idle * (1.0 - exp(-10.0 * duration / idle)), rel=1e-7
        )


# Of 2000 N at 0 s and 3000 N at 1 s, however a logger or a spreadsheet writes them.
WRITTEN: list[tuple[str, dict[str, Any]]] = [
    ("t (s);F (kN)\n0;2\n1;3\n", {"time": "t (s)", "value": "F (kN)"}),
    ("t (s);F (kN)\n0;2\n1;3\n", {}),
    ("t [ms] F [N]\n0 2000\n1000 3000\n", {"value": 2}),
    ("s,kN\n0,2\n1,3", {}),
    ("# s N\n\n0 2e3\n1\t3e3  # end\n", {}),
    ("Logger 7 (kg)\nt;note;F\ns;-;kN\n0,0;a;2,0\n1,0;b;3,0\n", {"value": "F"}),
    ("Logger 7\nserial;123\n# t;F_N\nt;n;F_N\ns;1;N\n\n0,0;7;2000,0\n1;8;3000\n", {"value": "F_N"}),
    ("t;n;F_N\n0,0;7;2000,0\n1;8;3000\n", {"time": 1, "value": 3}),
    ("F_N|t\n2000.0|0\n3000|1\n", {"time": "t", "value": " F_N", "delimiter": "|"}),
    ('\ufeff"t","F, N"\r\n"0","2000"\r\n"1","3000"\r\n', {"time": "t", "value": "F"}),
    ('"0,0"; "2000,0"\n"1,0";"3000,0"', {}),
    ('t,"a, b","F_N"\n"0.0","a\n""b""",2000\n1,"c, d",3000\n', {"time": "t", "value": "F_N"}),
    ("0,0 2000,0\n1,0 3000,0\n", {"decimal": ","}),
    ("2000,-0\n3000,1\n", {"time": 2, "value": 1}),
    *(
        (f't in s;"{heading}"\n0;{2000 / size}\n1;{3000 / size}\n', {})
        for heading, size in [
            *((form.format("daN"), 10) for form in ("F in {}", "F/{}", "F, {}", "F_{}", "F {}")),
            *(("F in kp", 9.80665), ("F in MN", 1e6), ("F in KN", 1e3), ("F 24/7/1", 1)),
        ]
    ),
    ("# s;daN\n0;200\n1;300\n", {}),
    ("# t in s; F in daN\n0;200\n1;300\n", {"time": 1, "value": 2}),
    ('t,F,"F, mean"\n0,2000,1\n1,3000,1\n', {"time": "t", "value": "F"}),
]


@pytest.mark.parametrize(("text", "keys"), WRITTEN)
def test_a_file_means_the_same_however_it_is_written(
    text: str, keys: dict[str, Any], tmp_path: Path
) -> None:
    read = signal_of(text, tmp_path, **keys)
    assert read["time"] == (0.0, 1.0)
    assert read["value"] == pytest.approx((2000.0, 3000.0), rel=1e-15)  # of one product


# Units, by what they are of, and their sizes in SI.
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "": 1.0}
SPEEDS = {"rad/s": 1.0, "rpm": pi / 30, "deg/s": pi / 180, "rev/s": 2 * pi, "Hz": 2 * pi, "": 1.0}
TORQUES = {"N m": 1.0, "kN m": 1e3, "mNm": 1e-3, "lbf ft": 1.3558179483314004, "": 1.0}
TORQUES |= {"kgfm": 9.80665, "daN·m": 10.0, "kgf cm": 9.80665e-2}
numbers = st.floats(-1e3, 1e3).map(lambda x: round(x, 3))


@given(st.data())
def test_a_table_means_the_same_in_any_units_and_delimiters(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder, draw = tmp_path_factory.getbasetemp(), data.draw
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
        form = draw(st.sampled_from(["{} [{}]", "{} ({})"])) if unit else "{}"
        return cell(form.format(name, unit))

    rows = [[heading("x y", x_unit), heading("M", y_unit)]]
    rows += [[cell(x), cell(y)] for x, y in zip(points, values, strict=True)]
    keys: dict[str, Any] = draw(st.sampled_from([{argument: 1}, {argument: 1, "value": 2}]))
    # A decimal comma would be taken for the delimiter between blanks.
    if delimiter == "|" or (delimiter[0] == " " and decimal == ",") or draw(st.booleans()):
        keys |= {"delimiter": delimiter[0]}
    read = signal_of("\n".join(map(delimiter.join, rows)), folder, "couples", **keys)
    # Rounding of the factor and of one product.
    assert read[argument] == pytest.approx([x * units[x_unit] for x in points], rel=1e-14)
    assert read["value"] == pytest.approx([y * TORQUES[y_unit] for y in values], rel=1e-14)


def test_a_fit_and_a_signal_take_a_file_for_the_same(tmp_path: Path) -> None:
    """A couple of 4 pi N m turns 1 kg m^2 at the speeds of the file."""
    text = "t (min);w\n;deg/s\n0,0;0\n0,0041666666666666667;180,0\n0,016666666666666666;720\n"
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


# A file, the keys of a couple, and what is said of it.
UNIT = r"unit of column %d, '.*%s.*convert the numbers.*without it"
REFUSED: list[tuple[str, dict[str, Any], str]] = [
    ("t,M [kN]\n0,1\n1,2\n", {}, UNIT % (2, "expected one of N m, mN m, daN m, kN m")),
    ("t,M (measured)\n0,1\n1,2\n", {"time": "t", "value": 2}, UNIT % (2, "got 'measured'")),
    ("n [rpm],M [N m]\n0,1\n1,2\n", {}, UNIT % (1, "expected one of s, ms")),
    ("t [ms],M\n0,1\n1,2\n", {"speed": "t"}, UNIT % (1, "rad/s, deg/s.*got 'ms'")),
    *(
        (f't,"{heading}"\n0,1\n1,2\n', {}, UNIT % (2, f"N m, mN m.*got '{said}'"))
        for heading, said in [
            *(("M in tonf", "tonf"), ("M/tonf", "tonf"), ("M, tonf", "tonf"), ("M in daN", "daN")),
            *(("M / N/mm2", "N/mm2"), ("M in total", "total"), ("Torque, motor", "motor")),
        ]
    ),
    ("# s;M in tonf\n0;1\n1;2\n", {"value": 2}, UNIT % (2, "got 'tonf'")),
    ("n in 1/s,M\n0,1\n1,2\n", {"speed": 1}, UNIT % (1, "rev/s, Hz.*got 's'")),
    ("t,M\n,kgf\n0,1\n1,2\n", {"time": "t", "value": "M"}, UNIT % (2, "got 'kgf'")),
    ("t,M\ns,kgf\n0,1\n1,2\n", {}, "line 2 of .*" + UNIT % (2, "got 'kgf'")),
    ("t; [s]; F [kN]\n0;1\n1;2\n", {}, UNIT % (2, "got 's'")),
    ("t [ms],M\n[s],\n0,1\n2,1\n", {}, "another unit than in line 1"),
    ("t,M [kN m]\ns,N m\n0,1\n2,1\n", {}, "another unit than in line 1"),
    ("0.5;1.5\n1.0;1,234\n", {}, r"expected a finite number in column 2, got '1,234'"),
    ("0.5;1\n1;1.234,5\n", {}, r"in column 2, got '1.234,5'; the decimal .* '.'; .* thousands"),
    ("0,5;1\n1,0;2.000,0\n", {}, r"in column 2, got '2.000,0'; the decimal .* ','; .* thousands"),
    ('"0,5","1,5"\n"1,0","2,5"\n', {}, r"expected a finite number in column 1, got '0,5'"),
    ("0;1\n1;2_0\n", {}, r"expected a finite number in column 2, got '2_0'"),
    ("t,M\n0,0,1,5\n", {"value": "M"}, "expected 2 cells, got 4: '0,0,1,5'; with decimal commas"),
    ("Log\n\nt M\n0 1\n1  2 3", {"value": "M"}, "line 5 .*expected 2 cells, got 3: '1 2 3'$"),
    ("Run 3;;;\n\nt [ms];M [kN];v\n0;1,5;2\n", {"value": "Ma"}, "unknown column 'Ma' .*'M'"),
]


@pytest.mark.parametrize(("text", "keys", "said"), REFUSED)
def test_what_may_mean_something_else_is_refused(
    text: str, keys: dict[str, Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(fs.ScenarioError, match=said):
        signal_of(text, tmp_path, "couples", **keys)


HEADINGS = [
    *("{} [{}]", "{} ({})", "{} {{{}}}", "{} <{}>", "[{1}] {0}", "{} [{}] filtered"),
    *("{}/{}", "{} / {}", "{} in {}", "{}_{}", "{} {}", "{1}", '"{}, {}"', "# {} [{}]"),
]


@pytest.mark.parametrize("unit", ["rpm", "RPM", "U/min", "deg/s"])
def test_every_way_to_write_a_unit_in_a_heading(unit: str, tmp_path: Path) -> None:
    size = pi / 180.0 if unit == "deg/s" else pi / 30.0
    for heading in HEADINGS:
        text = f"{heading.format('n', unit)},M\n0,10\n30,0\n"
        read = signal_of(text, tmp_path, "couples", speed=1, value=2)
        assert read["speed"] == pytest.approx([0.0, 30.0 * size]), heading


@pytest.mark.parametrize(
    ("heading", "name"),
    [
        *((end, end) for end in ("F_s", "F m", "h", "F_left")),  # no units of a couple
        *(('"Torque, N-m"', name) for name in ("Torque", "Torque, N-m", 2)),
        ('"Torque, Nm"', "Torque"),
    ],
)
def test_a_column_is_named_with_or_without_its_unit(
    heading: str, name: str | int, tmp_path: Path
) -> None:
    text = f'"t, ms",{heading}\n0,1\n2000,3\n'
    read = signal_of(text, tmp_path, "couples", time="t", value=name)
    assert read == {"time": (0.0, 2.0), "value": (1.0, 3.0)}
