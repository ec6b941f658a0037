"""Options of `frictionsim plot`: files of views, sizes, parts, several results, characters."""

import re
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.cases import one_in
from tests.support.scenarios import SCENARIOS

QUICK = {"output.interval": 0.1, "solver.rtol": 1e-4}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pictures")
    for name, load in (("a", 2224.1), ("b", 2100.0)):
        changed = {"mechanism.load": load, **QUICK}
        fs.solve(SCENARIOS / "pulley.toml", changed, output=path / f"{name}.h5")
    fs.solve(SCENARIOS / "epicyclic.toml", QUICK, output=path / "gear.h5")
    vary = {"mechanism.load": [2000.0, 2100.0]}
    fs.sweep(SCENARIOS / "pulley.toml", vary, QUICK, output=path / "s.h5")
    return path


@pytest.fixture
def told(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[str, str]]:
    monkeypatch.chdir(folder)

    def run(*arguments: str, code: int = 0) -> tuple[str, str]:
        assert fs.run_command_line(["plot", *arguments]) == code, capsys.readouterr().err
        captured = capsys.readouterr()
        return captured.out, captured.err

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
    options: list[str], files: list[str], told: Callable[..., tuple[str, str]], folder: Path
) -> None:
    assert told(*options) == ("".join(f"{name}\n" for name in files), "")
    assert all((folder / name).stat().st_size > 1000 for name in files)


def test_size_style_and_window_are_those_that_are_given(
    told: Callable[..., tuple[str, str]], folder: Path
) -> None:
    size = ["--width", "84mm", "--height", "90mm", "--dpi", "200", "--style", "paper"]
    told("a.h5", *size, "--no-title", "--from", "0.5", "--to", "1", "-o", "size.png")
    width, height = struct.unpack(">II", (folder / "size.png").read_bytes()[16:24])
    assert abs(width - 84 / 25.4 * 200) <= 1.0
    assert abs(height - 90 / 25.4 * 200) <= 1.0
    told("a.h5", "--channels", "angle", "--no-title", "--from", "0.5", "-o", "size.svg")
    text = (folder / "size.svg").read_text(encoding="utf-8")
    assert ">angle, rad</text>" in text
    assert "backend" not in text
    assert ">drive force" not in text


def test_all_views_show_what_applies_to_them(told: Callable[..., tuple[str, str]]) -> None:
    out, err = told("gear.h5", "--view", "all", "--time", "1", "--from", "0.5", "-o", "g.svg")
    views = ("response", "friction", "torque", "path", "mechanism")
    assert (out.split(), err) == ([f"g-{view}.svg" for view in views], "")
    assert "at 1 s" in Path("g-path.svg").read_text(encoding="utf-8")
    assert "does not take it" in told("a.h5", "--view", "traction", "--time", "1", code=2)[1]


def test_a_sweep_has_the_size_and_style(told: Callable[..., tuple[str, str]], folder: Path) -> None:
    told("s.h5", "--width", "84mm", "--style", "paper", "--no-title", "-o", "small.svg")
    text = (folder / "small.svg").read_text(encoding="utf-8")
    assert "sweep over" not in text
    width = re.search(r'<svg [^>]*width="([\d.]+)pt"', text)
    assert width
    assert float(width[1]) == pytest.approx(84 / 25.4 * 72, abs=0.01)


def test_python_has_the_same_options(folder: Path) -> None:
    figure = fs.plot(
        [folder / "a.h5", fs.open(folder / "b.h5")],
        width="84mm",
        style="paper",
        title=False,
        window=(0.5, None),
        channels=["angle", "drive_force"],
    )
    assert figure.get_figwidth() == pytest.approx(84 / 25.4)
    assert len(figure.axes) == 2
    assert figure.axes[0].get_xlim()[0] == pytest.approx(0.5)
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    assert key[:2] == ["1: load = 2224.1 N", "2: load = 2100 N"]
    assert fs.plot(folder / "a.h5", dpi=300).get_dpi() == 300
