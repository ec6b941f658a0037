"""Animations: frames, times, bytes, and files that stay as they were."""

import os
import shutil
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.motion.parts import Motion
from frictionsim.plots import animation
from frictionsim.plots.animation import animate, timing_of
from frictionsim.plots.moving_picture import MovingPicture
from frictionsim.results import Record
from tests.support.belt_results import TWO, belt_run
from tests.support.motions import motion, record_of, scenario

TIMES = np.linspace(0.0, 2.0, 21)


def record(kind: str = "pulley", turns: float = 1.0) -> Record:
    return record_of(kind, {"time": TIMES, "angle": turns * TIMES})


@pytest.fixture(scope="module")
def moved() -> Motion:
    return motion(record())


def test_the_run_takes_eight_seconds_by_default(moved: Motion) -> None:
    timing = timing_of(moved, ".gif", None, None)
    assert len(timing.times) == 161
    assert timing.shown == pytest.approx(0.05)
    assert (timing.times[0], timing.times[-1]) == (0.0, 2.0)
    assert np.diff(timing.times) == pytest.approx(np.full(160, 0.0125))


def test_speed_and_frames_per_second_are_kept(moved: Motion) -> None:
    # A GIF counts hundredths of a second: 30 frames per second are shown as 33.3, at this speed.
    timing = timing_of(moved, ".gif", 30.0, 0.5)
    assert timing.shown == pytest.approx(0.03)
    assert np.diff(timing.times)[:-1] == pytest.approx(0.5 * 0.03)
    assert timing_of(moved, ".mp4", 30.0, 0.5).shown == pytest.approx(1.0 / 30.0)
    alone = motion(record_of("pulley", {"time": np.array([0.3]), "angle": np.array([1.0])}))
    assert timing_of(alone, ".gif", None, None).times.tolist() == [0.3]


@pytest.mark.parametrize(
    ("fps", "speed", "message"),
    [
        (0.0, None, "fps: expected a number above 0 and up to 50 for .gif, got 0"),
        (60.0, None, "fps: expected a number above 0 and up to 50 for .gif, got 60"),
        (float("nan"), None, "got nan"),
        (None, -1.0, "speed: expected a number above 0, got -1"),
        (None, 1e-6, "would have 4e\\+07 frames, more than 6000; give a larger speed"),
    ],
)
def test_wrong_numbers_are_refused(
    moved: Motion, fps: float | None, speed: float | None, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        timing_of(moved, ".gif", fps, speed)


def frames_of(path: Path) -> list[Any]:
    with Image.open(path) as image:
        found = []
        for number in range(getattr(image, "n_frames", 1)):
            image.seek(number)
            found.append(np.asarray(image.convert("RGB")))
        assert image.info["loop"] == 0
        return found


def test_a_gif_shows_what_the_picture_shows_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    progress: list[tuple[int, int]] = []
    for name in ("a.gif", "b.gif"):
        animate(
            record(), tmp_path / name, 2.0, 1.0, lambda done, count: progress.append((done, count))
        )
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    assert progress[:5] == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]
    frames = frames_of(tmp_path / "a.gif")
    assert len(frames) == 5
    picture = MovingPicture(motion(record()), "pulley")
    picture.figure.set_dpi(100)
    wanted = [picture.show(time)[..., :3].copy() for time in (0.0, 0.5, 1.0, 1.5, 2.0)]
    for frame, drawn in zip(frames, wanted, strict=True):
        assert np.mean(np.abs(frame.astype(int) - drawn[: len(frame)])) < 1.0
    assert np.all(frames[0][:3, :3] == 255), "white stays white"
    assert np.mean(frames[0] != frames[2]) > 0.001


@pytest.mark.parametrize("kind", ["marble_machine", "epicyclic", "belt_drive"])
def test_each_kind_moves_and_what_is_fixed_stays(kind: str, tmp_path: Path) -> None:
    if kind == "belt_drive":
        hdf5_writer.write(belt_run(TWO), tmp_path / "a.h5")
        moved = motion(hdf5_reader.read(tmp_path / "a.h5"))
    else:
        moved = motion(record(kind))
    picture = MovingPicture(moved, "a title with $ and _")
    first = picture.show(moved.time[0]).copy()
    later = picture.show(moved.time[len(moved.time) // 2]).copy()
    assert np.mean(first != later) > 0.001
    assert np.array_equal(picture.show(moved.time[0]), first), "it does not depend on what was"
    title = slice(0, 30)
    assert np.array_equal(first[title], later[title])


def test_a_belt_has_the_colours_of_its_tension(tmp_path: Path) -> None:
    hdf5_writer.write(belt_run(TWO), tmp_path / "a.h5")
    picture = MovingPicture(motion(hdf5_reader.read(tmp_path / "a.h5")), "")
    pixels = picture.show(1e9)[:150, :, :3].reshape(-1, 3).astype(int)
    for colour in ((0, 34, 78), (254, 232, 56)):  # the ends of cividis: least and largest tension
        assert np.abs(pixels - colour).sum(axis=1).min() < 40


def test_only_a_gif_replaces_a_gif(tmp_path: Path) -> None:
    path = tmp_path / "a.gif"
    path.write_bytes(b"notes")
    with pytest.raises(OutputError, match="the existing file is not a GIF and is not overwritten"):
        animate(record(), path, 1.0, 2.0)
    assert path.read_bytes() == b"notes"
    path.write_bytes(b"GIF89a of before")
    animate(record(), path, 1.0, 2.0)
    assert len(frames_of(path)) == 2
    with pytest.raises(OutputError, match="--no-clobber"):
        fs.animate(tmp_path / "a.h5", path, no_clobber=True)
    with pytest.raises(InputError, match=r"which ends in .gif or .mp4"):
        animate(record(), tmp_path / "a.avi")


def test_an_interruption_leaves_nothing(tmp_path: Path) -> None:
    def stop(done: int, count: int) -> None:
        raise KeyboardInterrupt

    for name in ("a.gif", *(["a.mp4"] if shutil.which("ffmpeg") else [])):
        with pytest.raises(KeyboardInterrupt):
            animate(record(), tmp_path / name, 1.0, 1.0, stop)
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_mp4_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"a.mp4: MP4 needs the program ffmpeg, .* or give a name"):
        animate(record(), tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="a script stands for ffmpeg")
def test_a_failing_ffmpeg_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'Unknown encoder' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(animation, "FFMPEG", str(program))
    with pytest.raises(OutputError, match="ffmpeg failed: Unknown encoder"):
        animate(record(), tmp_path / "a.mp4", 1.0, 1.0)
    assert not (tmp_path / "a.mp4").exists()


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="there is no ffmpeg")
def test_an_mp4_is_written(tmp_path: Path) -> None:
    animate(record(), tmp_path / "a.mp4", 5.0, 1.0)
    assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"
    animate(record(), tmp_path / "a.mp4", 5.0, 1.0)
    (tmp_path / "a.mp4").write_bytes(b"notes on films")
    with pytest.raises(OutputError, match="the existing file is not an MP4"):
        animate(record(), tmp_path / "a.mp4", 5.0, 1.0)


def test_the_command_writes_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fs.solve(scenario("pulley", solver__rtol=1e-6), output=tmp_path / "a.h5")
    wanted = ["plot", str(tmp_path / "a.h5"), "--animate", str(tmp_path / "a.gif")]
    assert run_command_line([*wanted, "--fps", "1", "--speed", "3"]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'a.gif'}\n"
    assert Image.open(BytesIO((tmp_path / "a.gif").read_bytes())).n_frames == 2
    assert run_command_line([*wanted, "--view", "response"]) == 2
    assert "--view is for a picture and --animate for an animation" in capsys.readouterr().err
    assert run_command_line(["plot", str(tmp_path / "a.h5"), "--fps", "3"]) == 2
    assert "--fps is for an animation: give --animate FILE.gif" in capsys.readouterr().err


def test_an_error_names_the_file_of_the_result(tmp_path: Path) -> None:
    result = fs.solve(
        scenario("pulley", solver__duration=0.1, output__channels=["energy_input"]),
        output=tmp_path / "a.h5",
    )
    for source in (result, tmp_path / "a.h5"):
        with pytest.raises(InputError) as error:
            fs.animate(source, tmp_path / "a.gif")
        assert str(error.value).startswith(f"{tmp_path / 'a.h5'}: cannot show this result in")
