"""`show`, `plot`, `report`, `new` and `schema`."""

import csv
import io
import json
import re
import struct
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.cases import one_in
from tests.support.records import shown
from tests.support.scenarios import SCENARIOS

PULLEY, RETURN = str(SCENARIOS / "pulley.toml"), str(SCENARIOS / "pulley_return.toml")
BELT = str(SCENARIOS / "belt_drive.toml")
WALL_TIME = re.compile(r"solved in \S+ s(?: after \S+ s of compilation)?: ")
QUICK = {"output.interval": 0.1, "solver.rtol": 1e-4}

# --- show -----------------------------------------------------------------------------------


@pytest.mark.parametrize("interval", ["0.01", "9"])  # of the latter is warned
def test_summary_and_json_are_those_of_solve_but_for_wall_times(interval: str, told: Run) -> None:
    options = ("-o", "a.h5", "--set", f"output.interval={interval}")
    solved, warned = told("solve", PULLEY, *options)
    assert WALL_TIME.search(solved)
    assert bool(warned) == (interval == "9")
    assert told("show", "a.h5") == (WALL_TIME.sub("", solved), warned)
    document = strict_json(told("solve", PULLEY, "--json", *options)[0])
    document["solver"] |= {"wall_seconds": None, "compile_seconds": None}
    document["scenario"] = "pulley.toml"  # a file holds the name, not the path
    assert strict_json(told("show", "a.h5", "--json")[0]) == document


def channels_of(text: str) -> dict[str, list[float]]:
    heading, *rows = csv.reader(io.StringIO(text))
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(heading)}


def test_csv_has_the_channels_to_the_last_digit(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q")
    record = fs.open("a.h5").record
    columns = channels_of(told("show", "a.h5", "--csv")[0])
    assert list(columns) == [f"{name} [{record.units[name]}]" for name in record.channels]
    assert next(iter(columns)) == "time [s]"
    for values, (name, channel) in zip(columns.values(), record.channels.items(), strict=True):
        np.testing.assert_array_equal(values, channel, err_msg=name)
    short = ["--set", "solver.duration=1e-3", "--set", 'output.channels=["tension","pulley_speed"]']
    told("solve", BELT, "-o", "b.h5", "-q", *short)
    record = fs.open("b.h5").record
    columns = channels_of(told("show", "b.h5", "--csv")[0])
    assert len(columns) == 1 + 2 + record.channels["tension"].shape[1]
    speeds = record.channels["pulley_speed"]
    np.testing.assert_array_equal(columns["tension.3 [N]"], record.channels["tension"][:, 3])
    np.testing.assert_array_equal(columns["pulley_speed.driven [rad/s]"], speeds[:, 1])


def test_channels_and_times_of_the_csv_are_chosen_and_written(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q")
    options = ["--csv", "--channels", "angle,angular_velocity", "--from", "1", "--to", "2"]
    printed = told("show", "a.h5", *options)[0]
    columns = channels_of(printed)
    assert list(columns) == ["time [s]", "angle [rad]", "angular_velocity [rad/s]"]
    dataset = fs.open("a.h5").dataset.sel(time=slice(1.0, 2.0))
    for name, values in columns.items():
        np.testing.assert_array_equal(values, dataset[name.partition(" ")[0]].values)
    assert told("show", "a.h5", *options, "-o", "a.csv")[0] == "a.csv\n"
    assert Path("a.csv").read_text(encoding="utf-8") == printed


def test_the_scenario_gives_the_same_result_again(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q", "--set", "mechanism.load=2000")
    text, _ = told("show", "a.h5", "--scenario")
    assert tomllib.loads(text)["mechanism"]["load"] == 2000
    Path("again.toml").write_text(text, encoding="utf-8")
    told("solve", "again.toml", "-o", "b.h5", "-q")
    told("compare", "b.h5", "a.h5", "--rtol", "0", "--atol", "0", "--time-atol", "0")


def test_a_failed_run_says_why_and_how_to_resume_it(told: Run) -> None:
    _, solved = told("solve", PULLEY, "-o", "a.h5", "-q", "--max-steps", "50", code=5)
    out, err = told("show", "a.partial.h5")
    assert out.startswith("Pulley on a dry shaft: failed\n")
    reason, *_, resume = solved.splitlines()
    assert err.splitlines() == [reason, resume]
    assert reason.startswith("frictionsim: run failed: limit of 50 steps reached")
    assert resume == "frictionsim: 'frictionsim resume a.partial.h5' continues the run"
    law = ("--backend", "dop853", "--set", "effects.shaft_friction.law=regularised")
    _, solved = told("solve", PULLEY, "-o", "b.h5", "-q", "--max-steps", "50", *law, code=5)
    cannot = "the run cannot be resumed: the backend dop853 is SciPy's and saves no state"
    assert solved.splitlines()[-1] == f"frictionsim: {cannot}"
    assert told("show", "b.partial.h5")[1].splitlines()[-1] == f"frictionsim: {cannot}"


def test_a_failed_audit_is_reported(told: Run) -> None:
    """Fixed steps through the chattering of eq 30 lose energy."""
    force = "drive.force={time=[0,0.8,4,4.8],value=[1832.6,3113.75,3113.75,2224.1]}"
    law = ["--set", "effects.shaft_friction.law=published", "--backend", "rkf45"]
    told("solve", RETURN, "-q", "-o", "a.h5", *law, "--set", "solver.step=1e-3", "--set", force,
         code=3)  # fmt: skip
    out, err = told("show", "a.h5")
    assert "FAILED" in out
    assert "frictionsim: self-audit failed: energy_balance" in err
    assert err.endswith("; do not trust a.h5\n")
    assert fs.open("a.h5").reason.startswith("self-audit failed: energy")


@pytest.mark.skipif(sys.getfilesystemencoding() != "utf-8", reason="names of files in UTF-8")
def test_names_may_have_blanks_and_letters_of_any_script(told: Run) -> None:
    Path("a b/ü").mkdir(parents=True)
    Path("a b/ü/Überlast θ.toml").write_bytes(Path(PULLEY).read_bytes())
    told("solve", "a b/ü/Überlast θ.toml", "-q")
    assert told("show", "results/Überlast θ.h5")[0].endswith("result: results/Überlast θ.h5\n")
    meant = "(did you mean 'results/Überlast θ.h5'?)"
    assert meant in told("show", "results/Uberlast.h5", code=2)[1]


def test_several_results_are_shown_side_by_side(told: Run) -> None:
    for mu in (0.2, 0.3):
        told("solve", PULLEY, "--set", f"effects.shaft_friction.mu_s={mu}", "-o", f"{mu}.h5", "-q")
    out, _ = told("show", "0.2.h5", "0.3.h5")
    assert re.search(r"effects.shaft_friction.mu_s +0.2 +0.3", out)
    times = [fs.open(f"{mu}.h5").quantities["breakaway_time"].value for mu in (0.2, 0.3)]
    shown = re.search(r"breakaway_time +(\S+) +(\S+) +(\S+)", out)
    assert shown is not None
    expected = [*times, times[1] - times[0]]
    assert [float(text) for text in shown.groups()] == pytest.approx(expected, rel=1e-2)
    told("sweep", PULLEY, "--vary", "solver.duration=[0.1]", "-o", "sweep.h5", "-q", "-j", "1")
    files = ["0.2.h5", "0.3.h5", "sweep.h5"]  # one after the other, as of the file alone
    alone = [strict_json(told("show", file, "--json")[0]) for file in files]
    assert strict_json(told("show", *files, "--json")[0]) == alone
    told("solve", "shaft", "-o", "c.h5", "-q", "--set", "solver.duration=0.1")
    assert " less " not in told("show", "0.2.h5", "c.h5")[0]  # numbers of unlike things


# --- plot -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pictures")
    for name, load in (("a", 2224.1), ("b", 2100.0)):
        fs.solve("pulley", {"mechanism.load": load, **QUICK}, output=path / f"{name}.h5")
    fs.solve("epicyclic", QUICK, output=path / "gear.h5")
    vary = {"mechanism.load": [2000.0, 2100.0]}
    fs.sweep("pulley", vary, QUICK, output=path / "s.h5", workers=1)
    return path


@pytest.fixture
def plot(
    pictures: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    monkeypatch.chdir(pictures)

    def run(*arguments: str) -> str:
        assert fs.run_command_line(["plot", *arguments]) == 0
        out, err = capsys.readouterr()
        assert err == ""
        return out

    return run


@pytest.mark.parametrize(
    ("options", "files"),
    one_in(
        3,
        [
            (["gear.h5"], ["gear.png"]),
            (["gear.h5", "--view", "torque,path", "-o", "t.svg"], ["t-torque.svg", "t-path.svg"]),
            (
                ["gear.h5", "--view", "torque", "--view", "path"],
                ["gear-torque.png", "gear-path.png"],
            ),
            (["a.h5", "b.h5"], ["a-b.png"]),
            (["a.h5", "b.h5", "a.h5"], ["a-and-2-more.png"]),
            (["s.h5"], ["s.png"]),
            (
                ["s.h5", "--view", "final_angle,force_to_lift", "--view", "force_to_hold"],
                ["s-final_angle+force_to_lift.png", "s-force_to_hold.png"],
            ),
        ],
    ),
)
def test_each_picture_has_a_file_of_its_own(
    options: list[str], files: list[str], plot: Callable[..., str], pictures: Path
) -> None:
    assert plot(*options) == "".join(f"{name}\n" for name in files)
    assert all((pictures / name).stat().st_size > 1000 for name in files)


def test_size_style_and_window_are_those_that_are_given(
    plot: Callable[..., str], pictures: Path
) -> None:
    size = ["--width", "84mm", "--height", "90mm", "--dpi", "200", "--style", "paper"]
    plot("a.h5", *size, "--no-title", "--from", "0.5", "--to", "1", "-o", "size.png")
    sizes = struct.unpack(">II", (pictures / "size.png").read_bytes()[16:24])
    assert sizes == pytest.approx((84 / 25.4 * 200, 90 / 25.4 * 200), abs=1.0)
    plot("a.h5", "--channels", "angle", "--no-title", "--from", "0.5", "-o", "size.svg")
    text = (pictures / "size.svg").read_text(encoding="utf-8")
    assert [">angle, rad</text>" in text, "backend" in text, ">drive force" in text] == [
        *(True, False, False)
    ]
    plot("s.h5", "--width", "84mm", "--style", "paper", "--no-title", "-o", "small.svg")
    text = (pictures / "small.svg").read_text(encoding="utf-8")
    assert "sweep over" not in text
    width = re.search(r'<svg [^>]*width="([\d.]+)pt"', text)
    assert width
    assert float(width[1]) == pytest.approx(84 / 25.4 * 72, abs=0.01)
    figure = fs.plot(
        [pictures / "a.h5", fs.open(pictures / "b.h5")],
        width="84mm", style="paper", title=False, window=(0.5, None),
        channels=["angle", "drive_force"],
    )  # fmt: skip
    assert figure.get_figwidth() == pytest.approx(84 / 25.4)
    assert len(figure.axes) == 2
    assert figure.axes[0].get_xlim()[0] == pytest.approx(0.5)
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    assert key[:2] == ["1: load = 2224.1 N", "2: load = 2100 N"]


def test_all_views_show_what_applies_to_them(plot: Callable[..., str]) -> None:
    out = plot("gear.h5", "--view", "all", "--time", "1", "--from", "0.5", "-o", "g.svg")
    views = ("response", "friction", "torque", "path", "mechanism")
    assert out.split() == [f"g-{view}.svg" for view in views]
    assert "at 1 s" in Path("g-path.svg").read_text(encoding="utf-8")


def test_views_that_lack_channels_are_skipped_and_pictures_kept(told: Run) -> None:
    fs.Result(shown("belt_string", output__channels=("pulley_speed", "pulley_torque"))).save("a.h5")
    out, err = told("plot", "a.h5", "--view", "all", "--json", "--no-clobber")
    document = strict_json(out)
    assert (document["pictures"], len(document["skipped"]), err) == (["a-speeds.png"], 4, "")
    Path("a-speeds.png").unlink()
    for options, name in ((["--json"], "a.png"), (["--view", "all"], "a-drive.png")):
        Path(name).write_bytes(b"\x89PNG precious")
        _, err = told("plot", "a.h5", "--no-clobber", *options, code=4)
        assert err.startswith(f"frictionsim: {name}: cannot write the picture: the file exists")
        assert Path(name).read_bytes() == b"\x89PNG precious"


# --- report ---------------------------------------------------------------------------------


def test_a_report_is_written_beside_the_first_result(told: Run, here: Path) -> None:
    for name in ("a.h5", "b.h5"):
        fs.solve("pulley", {"solver.rtol": 1e-6, "solver.duration": 0.1}, output=name)
    assert told("report", here / "a.h5", "b.h5")[0] == f"{here / 'a.html'}\n"
    assert "<h1>Comparison: Pulley on a dry shaft</h1>" in Path("a.html").read_text(
        encoding="utf-8"
    )
    assert told("report", "b.h5", "-o", "a.html", "-q") == ("", "")  # it is replaced
    assert "<h1>Pulley on a dry shaft</h1>" in Path("a.html").read_text(encoding="utf-8")
    assert fs.report(["a.h5", fs.open("b.h5")], "c.html") == Path("c.html")
    for command in ("plot", "report"):  # before any is read
        _, err = told(command, *(f"none{number}.h5" for number in range(9)), code=2)
        assert re.search(r"\b9\b.* give fewer, or run them as a sweep", err)


# --- new and schema -------------------------------------------------------------------------

KINDS, SHIPPED = fs.kinds(), tuple(fs.scenarios())


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_scenario_of_each_kind_is_valid(kind: str, told: Run) -> None:
    assert told("new", kind, "hoist.toml") == (f"hoist.toml\n{kind}.schema.json\n", "")
    (checked,) = strict_json(told("check", "hoist.toml", "--json")[0])["scenarios"]
    assert (checked["ok"], checked["kind"], checked["warnings"]) == (True, kind, [])
    first, _, text = Path("hoist.toml").read_text(encoding="utf-8").partition("\n")
    assert first == f"#:schema ./{kind}.schema.json"
    assert told("new", kind)[0] == text
    schema = json.dumps(fs.schema(kind), indent=2) + "\n"
    assert (
        told("schema", kind)[0] == schema == Path(f"{kind}.schema.json").read_text(encoding="utf-8")
    )
    assert told("new", kind, "second.toml") == ("second.toml\n", "")  # the schema is kept


TAPLO = Path(sysconfig.get_path("scripts")) / "taplo"  # the linter that editors use


def faults_of_the_linter(*paths: Path) -> str:
    command = [TAPLO, "lint", "--no-auto-config", *paths]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=120, check=False)
    return done.stderr if done.returncode else ""


@pytest.mark.dev
@pytest.mark.skipif(not TAPLO.exists(), reason="taplo is not installed beside this Python")
@pytest.mark.parametrize("name", [*KINDS, "swing_door", "hard/jump_from_csv"])
def test_editors_take_a_new_scenario_and_find_what_is_wrong_in_it(name: str, told: Run) -> None:
    Path("folder").mkdir()
    right, wrong = Path("folder/right.toml").absolute(), Path("folder/wrong.toml").absolute()
    told("new", name, "folder/right.toml")
    text = right.read_text(encoding="utf-8").replace("\nduration = ", "\nduratoin = ")
    wrong.write_text(text, encoding="utf-8")
    assert faults_of_the_linter(right) == ""
    assert "'duratoin' was unexpected" in faults_of_the_linter(wrong)


@pytest.mark.parametrize("name", one_in(6, [n for n in SHIPPED if n not in KINDS]))
def test_a_shipped_scenario_is_written(name: str, told: Run) -> None:
    told("new", name, "copy.toml")
    assert told("check", "copy.toml")[0].startswith("copy.toml: ok; effects ")
    assert Path("copy.toml").read_text(encoding="utf-8").count("#:schema ./") == 1


def test_the_list_has_all(told: Run) -> None:
    kinds, _, shipped = told("new", "--list")[0].partition("\n\n")
    assert kinds.splitlines() == ["kind", *KINDS]
    assert [line.split()[0] for line in shipped.splitlines()[1:]] == list(SHIPPED)
    assert "Pulley on a dry shaft" in shipped
    strict_json(told("schema")[0])
