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
from frictionsim.results import Record
from tests.support.cases import slow
from tests.support.motions import record_of
from tests.support.records import shown
from tests.support.scenarios import shipped

TIMES = np.linspace(0.0, 2.0, 21)


def record(kind: str = "pulley") -> Record:
    return record_of(kind, {"time": TIMES, "angle": TIMES})


def animate(record: Record, path: Path, fps: Any = None, speed: Any = None, **more: Any) -> Path:
    return fs.animate(fs.Result(record), path, fps=fps, speed=speed, **more)


class Told(Exception):
    """The number of frames."""


def count_of(*options: Any, record: Record, path: Path) -> int:
    """Return the number of frames of an animation, which is stopped when it is known."""

    def tell(done: int, count: int) -> None:
        raise Told(count)

    with pytest.raises(Told) as told:
        animate(record, path, *options, progress=tell)
    return int(told.value.args[0])


def milliseconds(path: Path) -> list[int]:
    """Return how long each frame is shown."""
    with Image.open(path) as image:
        durations = []
        for number in range(getattr(image, "n_frames", 1)):
            image.seek(number)
            durations.append(image.info["duration"])
        return durations


def test_the_run_takes_eight_seconds_by_default(tmp_path: Path) -> None:
    # 161 frames of 50 ms.
    assert count_of(record=record(), path=tmp_path / "a.gif") == 161
    animate(record(), tmp_path / "a.gif", None, 10.0)
    assert set(milliseconds(tmp_path / "a.gif")[:-1]) == {50}


def test_speed_and_frames_per_second_are_kept(tmp_path: Path) -> None:
    # A GIF counts hundredths of a second: 30 frames per second are shown as 33.3, at this speed.
    assert count_of(30.0, 0.5, record=record(), path=tmp_path / "a.gif") == 135
    animate(record(), tmp_path / "a.gif", 30.0, 20.0)
    assert set(milliseconds(tmp_path / "a.gif")[:-1]) == {30}
    if shutil.which("ffmpeg"):
        assert count_of(30.0, 0.5, record=record(), path=tmp_path / "a.mp4") == 121
    alone = record_of("pulley", {"time": np.array([0.3]), "angle": np.array([1.0])})
    assert count_of(record=alone, path=tmp_path / "a.gif") == 1


def frames_of(path: Path) -> list[Any]:
    with Image.open(path) as image:
        frames = []
        for number in range(getattr(image, "n_frames", 1)):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB")))
        assert image.info["loop"] == 0
        return frames


def difference(one: Any, other: Any) -> float:
    return float(np.mean(np.abs(one.astype(int) - other.astype(int))))


def test_a_gif_shows_its_times_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    progress: list[tuple[int, int]] = []
    (tmp_path / "b.gif").write_bytes(b"GIF89a of before")
    for name in ("a.gif", "b.gif"):
        animate(
            record(),
            tmp_path / name,
            1.0,
            1.0,
            progress=lambda done, count: progress.append((done, count)),
        )
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    assert progress == [(1, 3), (2, 3), (3, 3)] * 2
    frames = frames_of(tmp_path / "a.gif")  # at 0, 1 and 2 s
    animate(record(), tmp_path / "c.gif", 1.0, 2.0)
    start, end = frames_of(tmp_path / "c.gif")
    assert difference(start, frames[0]) < 1.0
    assert difference(end, frames[2]) < 1.0, "it does not depend on what was before"
    assert np.mean(frames[0] != frames[1]) > 0.001


def test_frames_are_at_their_times(tmp_path: Path) -> None:
    """Of a pulley that turns between the samples at 0.9 s and 1 s alone, at 0, 1 and 2 s."""
    turned = record_of("pulley", {"time": TIMES, "angle": np.where(TIMES < 0.95, 0.0, 1.0)})
    animate(turned, tmp_path / "a.gif", 1.0, 1.0)
    start, middle, end = frames_of(tmp_path / "a.gif")
    # The number of the time alone differs.
    assert difference(middle, end) < 0.2 * difference(start, middle)


@pytest.mark.parametrize("kind", [slow("marble_machine"), slow("epicyclic"), "two pulleys"])
def test_each_kind_moves_and_what_is_fixed_stays(kind: str, tmp_path: Path) -> None:
    made = shown(kind) if kind == "two pulleys" else record(kind)
    made = made._replace(attributes=made.attributes | {"title": "a title with $ and _"})
    animate(made, tmp_path / "a.gif", 1.0, 1.0)
    first, later, last = frames_of(tmp_path / "a.gif")
    assert np.mean(first != later) > 0.001
    title = slice(0, 20)
    assert difference(first[title], later[title]) < 1.0  # each frame has colours of its own
    if kind == "two pulleys":
        pixels = last.reshape(-1, 3).astype(int)
        for colour in ((0, 34, 78), (254, 232, 56)):  # ends of cividis: least and largest tension
            assert np.abs(pixels - colour).sum(axis=1).min() < 40


def test_an_interruption_leaves_nothing(tmp_path: Path) -> None:
    def stop(done: int, count: int) -> None:
        raise KeyboardInterrupt

    for name in ("a.gif", *(["a.mp4"] if shutil.which("ffmpeg") else [])):
        with pytest.raises(KeyboardInterrupt):
            animate(record(), tmp_path / name, 1.0, 1.0, progress=stop)
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
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
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
