"""Pictures of results: all panels of the mechanism, the same bytes for the same result."""

from collections.abc import Callable
from pathlib import Path

import pytest

from frictionsim import recorder
from frictionsim.errors import InputError, OutputError
from frictionsim.plots import plot

from .conftest import pulley, simulate


@pytest.fixture
def result(tmp_path: Path) -> recorder.Result:
    path = tmp_path / "pulley.h5"
    recorder.write(simulate(pulley()), path)
    return recorder.read(path)


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_the_same_result_gives_the_same_picture(
    result: recorder.Result, suffix: str, tmp_path: Path
) -> None:
    pictures = [tmp_path / f"{name}{suffix}" for name in ("a", "b")]
    for picture in pictures:
        plot(result, picture)
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


def test_panels_name_course_and_unit(result: recorder.Result, tmp_path: Path) -> None:
    picture = tmp_path / "pulley.svg"
    plot(result, picture)
    text = picture.read_text()
    for label in ("drive force", "friction torque", "angular velocity", "angle", "time, s"):
        assert f"<!-- {label}" in text, label


def test_other_formats_and_places_are_refused(result: recorder.Result, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"written as .png, .pdf, .svg"):
        plot(result, tmp_path / "pulley.jpg")
    with pytest.raises(OutputError, match="cannot write the picture"):
        plot(result, tmp_path / "nowhere" / "pulley.png")


def test_plot_command_names_what_it_wrote(cli: Callable, tmp_path: Path) -> None:
    recorder.write(simulate(pulley(effects=None)), tmp_path / "bare.h5")
    done = cli("plot", "bare.h5")
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "bare.png", "")
    assert (tmp_path / "bare.png").read_bytes().startswith(b"\x89PNG")
