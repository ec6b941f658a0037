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
from tests.support.motions import record_of
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


def frames_of(path: Path) -> list[Any]:
    with Image.open(path) as image:
        frames = []
        for number in range(getattr(image, "n_frames", 1)):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB")))
        assert image.info["loop"] == 0
        return frames


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


def test_a_gif_has_its_frames_at_their_times_and_the_same_bytes_again(tmp_path: Path) -> None:
    """A pulley that turns between 0.9 s and 1 s alone, at 0, 1 and 2 s."""
    turned = record_of("pulley", {"time": TIMES, "angle": np.where(TIMES < 0.95, 0.0, 1.0)})
    progress: list[tuple[int, int]] = []
    for name in ("a.gif", "b.gif"):
        animate(turned, tmp_path / name, 1.0, 1.0, progress=lambda *done: progress.append(done))
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    assert progress == [(1, 3), (2, 3), (3, 3)] * 2
    start, middle, end = frames_of(tmp_path / "a.gif")
    moved, stayed = (np.mean(a != b) for a, b in ((start, middle), (middle, end)))
    assert stayed < 0.2 * moved  # the number of the time alone
    # Of 8 s by default; a GIF counts hundredths of a second: 30 a second are 33.3.
    assert count_of(record=record(), path=tmp_path / "c.gif") == 161
    assert count_of(30.0, 0.5, record=record(), path=tmp_path / "c.gif") == 135
    with Image.open(animate(record(), tmp_path / "d.gif", 30.0, 20.0)) as image:
        assert image.info["duration"] == 30
    if shutil.which("ffmpeg"):
        assert count_of(30.0, 0.5, record=record(), path=tmp_path / "c.mp4") == 121


def test_an_interruption_leaves_nothing_and_an_mp4_replaces_an_mp4_alone(tmp_path: Path) -> None:
    def stop(done: int, count: int) -> None:
        raise KeyboardInterrupt

    for name in ("a.gif", *(["a.mp4"] if shutil.which("ffmpeg") else [])):
        with pytest.raises(KeyboardInterrupt):
            animate(record(), tmp_path / name, 1.0, 1.0, progress=stop)
        assert list(tmp_path.iterdir()) == []
        (tmp_path / name).write_bytes(b"notes on films")
        with pytest.raises(OutputError, match="the existing file is not a"):
            animate(record(), tmp_path / name, 1.0, 1.0)
        assert (tmp_path / name).read_bytes() == b"notes on films"
        (tmp_path / name).unlink()


def test_the_command_writes_one(told: Any, here: Path) -> None:
    fs.solve(shipped("pulley", solver__rtol=1e-6), output=here / "a.h5")
    wanted = ("plot", "a.h5", "--animate", "a.gif", "--fps", "1", "--speed", "3")
    assert told(*wanted)[0] == "a.gif\n"
    assert len(frames_of(here / "a.gif")) == 2
