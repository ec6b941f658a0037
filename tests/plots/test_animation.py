"""Animations: frames, times, bytes, and files that stay as they were."""

import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import frictionsim as fs
from frictionsim.errors import InputError, OutputError
from frictionsim.motion.parts import Motion
from frictionsim.plots import animation
from frictionsim.plots.animation import MovingPicture, animate, timing_of
from frictionsim.results import Record
from tests.support.motions import motion, record_of
from tests.support.records import shown
from tests.support.scenarios import shipped

TIMES = np.linspace(0.0, 2.0, 21)


def record(kind: str = "pulley") -> Record:
    return record_of(kind, {"time": TIMES, "angle": TIMES})


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


def frames_of(path: Path) -> list[Any]:
    with Image.open(path) as image:
        frames = []
        for number in range(getattr(image, "n_frames", 1)):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB")))
        assert image.info["loop"] == 0
        return frames


def test_a_gif_shows_what_the_picture_shows_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    progress: list[tuple[int, int]] = []
    (tmp_path / "b.gif").write_bytes(b"GIF89a of before")
    for name in ("a.gif", "b.gif"):
        animate(
            record(), tmp_path / name, 1.0, 1.0, lambda done, count: progress.append((done, count))
        )
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    assert progress == [(1, 3), (2, 3), (3, 3)] * 2
    frames = frames_of(tmp_path / "a.gif")
    picture = MovingPicture(motion(record()), "pulley")
    picture.figure.set_dpi(100)
    wanted = [picture.show(time)[..., :3].copy() for time in (0.0, 1.0, 2.0)]
    for frame, drawn in zip(frames, wanted, strict=True):
        assert np.mean(np.abs(frame.astype(int) - drawn[: len(frame)])) < 1.0
    assert np.all(frames[0][:3, :3] == 255), "white stays white"
    assert np.mean(frames[0] != frames[1]) > 0.001


@pytest.mark.parametrize("kind", ["marble_machine", "epicyclic", "two pulleys"])
def test_each_kind_moves_and_what_is_fixed_stays(kind: str) -> None:
    moved = motion(shown(kind) if kind == "two pulleys" else record(kind))
    picture = MovingPicture(moved, "a title with $ and _")
    first = picture.show(moved.time[0]).copy()
    later = picture.show(moved.time[len(moved.time) // 2]).copy()
    assert np.mean(first != later) > 0.001
    assert np.array_equal(picture.show(moved.time[0]), first), "it does not depend on what was"
    title = slice(0, 30)
    assert np.array_equal(first[title], later[title])
    if kind == "two pulleys":
        pixels = picture.show(1e9)[:150, :, :3].reshape(-1, 3).astype(int)
        for colour in ((0, 34, 78), (254, 232, 56)):  # ends of cividis: least and largest tension
            assert np.abs(pixels - colour).sum(axis=1).min() < 40


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
def test_a_failing_ffmpeg_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'Unknown encoder' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(animation, "FFMPEG", str(program))
    with pytest.raises(OutputError, match="ffmpeg failed: Unknown encoder"):
        animate(record(), tmp_path / "a.mp4", 1.0, 1.0)
    assert not (tmp_path / "a.mp4").exists()


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="there is no ffmpeg")
def test_an_mp4_replaces_an_mp4_alone(tmp_path: Path) -> None:
    for _ in range(2):
        animate(record(), tmp_path / "a.mp4", 1.0, 1.0)
        assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"
    (tmp_path / "a.mp4").write_bytes(b"notes on films")
    with pytest.raises(OutputError, match="the existing file is not an MP4"):
        animate(record(), tmp_path / "a.mp4", 1.0, 1.0)
    assert (tmp_path / "a.mp4").read_bytes() == b"notes on films"


def test_the_command_writes_one(told: Any, here: Path) -> None:
    fs.solve(shipped("pulley", solver__rtol=1e-6), output=here / "a.h5")
    wanted = ("plot", "a.h5", "--animate", "a.gif", "--fps", "1", "--speed", "3")
    assert told(*wanted)[0] == "a.gif\n"
    assert len(frames_of(here / "a.gif")) == 2
