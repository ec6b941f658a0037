"""Animations of results: the mechanism in motion as a GIF, or as MP4 by the program ffmpeg."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from io import BytesIO
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.replaceable import ANIMATIONS, check_target
from frictionsim.motion import motion_of
from frictionsim.plots.moving_picture import MovingPicture
from frictionsim.plots.picture_file import DOTS_PER_INCH, rendering

if TYPE_CHECKING:
    from frictionsim.motion.parts import Motion
    from frictionsim.results import Record

SECONDS = 8.0  # that a run takes by default
FRAMES_PER_SECOND = {".gif": 20.0, ".mp4": 30.0}
MAX_FRAMES_PER_SECOND = {".gif": 50.0, ".mp4": 120.0}  # a GIF counts hundredths of a second
MAX_FRAMES = 6000
GIF_UNIT = 0.01  # s
COLOURS = 255  # of a GIF; one more says that a pixel is as before
PALETTE_FRAMES = 5  # of which the colours of a GIF are taken
PILLOW_STEP = 4
FFMPEG = "ffmpeg"

Progress = Callable[[int, int], None]
"""Is told how many frames are drawn, and of how many."""


class Timing(NamedTuple):
    """The frames of an animation: their times in s, and how long each is shown in s."""

    times: Any
    shown: float


def animate(
    result: "Record",
    path: Path,
    fps: float | None = None,
    speed: float | None = None,
    progress: Progress | None = None,
    name: str = "",
) -> None:
    """Write the mechanism of a result in motion; equal results give identical GIFs.

    Parameters
    ----------
    result : Record
    path : Path
        Ends in .gif or .mp4.
    fps : float, optional
        Frames per second: 20 of a GIF, 30 of MP4.
    speed : float, optional
        Simulated seconds per second; by default the run takes 8 s.
    progress : callable, optional
        Is told the number of frames that are drawn, and of all.
    name : str
        Of the file of the result, for messages.

    Raises
    ------
    InputError
        If the format is unknown, nothing can be drawn, or there is no ffmpeg for MP4.
    OutputError
        If the file cannot be written.
    """
    check_animation(path)
    kind = path.suffix.lower()
    motion = _motion(result, name)
    timing = timing_of(motion, kind, fps, speed)
    title = result.attributes["title"] or result.attributes["kind"]
    with rendering():
        frames = _frames(motion, title, timing, progress)
        image = _gif(frames, timing) if kind == ".gif" else _mp4(frames, timing)
    write_atomically(image, path, ANIMATIONS[kind].word)


def _motion(result: "Record", name: str) -> "Motion":
    where = f"{name}: " if name else ""
    try:
        motion = motion_of(result)
    except InputError as error:
        raise InputError(f"{where}{error}") from None
    if motion is None:
        kind = result.attributes["kind"]
        raise InputError(f"{where}there is no drawing of the kind '{kind}' to animate")
    return motion


def check_animation(path: Path) -> None:
    """Check that an animation can be written, and that no other file is replaced by one.

    Raises
    ------
    InputError
        If its suffix names no known format, or the program for it is missing.
    OutputError
    """
    kind = path.suffix.lower()
    if kind not in ANIMATIONS:
        raise InputError(f"{path}: expected the name of an animation, which ends in .gif or .mp4")
    if kind == ".mp4" and shutil.which(FFMPEG) is None:
        raise InputError(
            f"{path}: MP4 needs the program ffmpeg, which is not installed; install it (on Debian"
            " 'apt install ffmpeg', see https://ffmpeg.org), or give a name that ends in .gif"
        )
    check_target(path, ANIMATIONS[kind])


def timing_of(motion: "Motion", kind: str, fps: float | None, speed: float | None) -> Timing:
    """Return the times of the frames.

    Parameters
    ----------
    motion : Motion
    kind : str
        ".gif" or ".mp4".
    fps, speed
        As of `animate`.

    Raises
    ------
    InputError
        If there would be too many frames, or a number is not positive.
    """
    most = MAX_FRAMES_PER_SECOND[kind]
    fps = FRAMES_PER_SECOND[kind] if fps is None else fps
    if not 0.0 < fps <= most:
        raise InputError(
            f"fps: expected a number above 0 and up to {most:g} for {kind}, got {fps:g}"
        )
    duration = float(motion.time[-1] - motion.time[0])
    speed = (duration / SECONDS if duration else 1.0) if speed is None else speed
    if not 0.0 < speed < np.inf:
        raise InputError(f"speed: expected a number above 0, got {speed:g}")
    shown = max(round(1.0 / fps / GIF_UNIT), 1) * GIF_UNIT if kind == ".gif" else 1.0 / fps
    count = duration / speed / shown
    if count > MAX_FRAMES:
        raise InputError(
            f"speed: at {speed:g} simulated seconds per second the animation would have"
            f" {count:.6g} frames, more than {MAX_FRAMES}; give a larger speed or fewer frames per"
            " second"
        )
    times = motion.time[0] + speed * shown * np.arange(ceil(count - 1e-9) + 1)
    return Timing(np.minimum(times, motion.time[-1]), shown)


def _frames(motion: "Motion", title: str, timing: Timing, progress: Progress | None) -> "_Frames":
    return _Frames(MovingPicture(motion, title), timing.times, progress)


class _Frames:
    """The frames of an animation as images, which are drawn when they are needed."""

    def __init__(self, picture: MovingPicture, times: Any, progress: Progress | None) -> None:
        self._picture, self._times, self._progress = picture, times, progress
        picture.figure.set_dpi(DOTS_PER_INCH)

    def __len__(self) -> int:
        return len(self._times)

    def __iter__(self) -> Iterator[Any]:
        for number, time in enumerate(self._times.tolist()):
            yield self.at(time)
            if self._progress is not None:
                self._progress(number + 1, len(self._times))

    def at(self, time: float) -> Any:
        """Return the pixels (height, width, 3) at a time; even numbers of them, as MP4 wants."""
        pixels = self._picture.show(time)
        height, width = (size - size % 2 for size in pixels.shape[:2])
        return np.array(pixels[:height, :width, :3])

    def some(self, count: int) -> list[Any]:
        """Return evenly spaced frames."""
        chosen = np.linspace(0, len(self) - 1, min(count, len(self))).astype(int)
        return [self.at(float(self._times[i])) for i in chosen]


def _gif(frames: _Frames, timing: Timing) -> bytes:
    """Return a GIF that repeats itself, with one table of colours for all frames."""
    from PIL import Image

    palette = _palette(frames)
    images = (
        Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in frames
    )
    buffer = BytesIO()
    next(images).save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=images,
        duration=round(1000.0 * timing.shown),
        loop=0,
        optimize=True,  # what is as in the frame before is left out
    )
    return buffer.getvalue()


def _palette(frames: _Frames) -> Any:
    """Return an image with the colours of a GIF; white and black are among them."""
    from PIL import Image

    palette = Image.fromarray(np.concatenate(frames.some(PALETTE_FRAMES))).quantize(COLOURS)
    colours = np.array(palette.getpalette()).reshape(-1, 3)
    # Pillow looks for the colours of a GIF in steps of 4: it must find no other one near white.
    for exact in (0, 255):
        colours[np.all(np.abs(colours - exact) < 2 * PILLOW_STEP, axis=1)] = exact
    palette.putpalette(colours.ravel().tolist())
    return palette


def _mp4(frames: _Frames, timing: Timing) -> bytes:
    """Return an MP4 by ffmpeg, which reads the frames from a pipe.

    Raises
    ------
    OutputError
        If ffmpeg cannot write it.
    """
    height, width = frames.some(1)[0].shape[:2]
    with TemporaryDirectory(prefix="frictionsim-") as folder:
        file = Path(folder) / "animation.mp4"
        command = [
            *(FFMPEG, "-loglevel", "error", "-nostdin", "-y"),
            *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"),
            *("-r", f"{1.0 / timing.shown:.9g}", "-i", "-", "-an", "-pix_fmt", "yuv420p"),
            *("-movflags", "+faststart", "-fflags", "+bitexact", "-flags:v", "+bitexact"),
            str(file),
        ]
        log = Path(folder) / "log"
        with log.open("wb") as stderr:
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=stderr
            )
            try:
                _feed(process, frames)
            finally:
                if process.poll() is None:
                    process.kill()
                process.wait()
        if process.returncode:
            told = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            reason = told[-1] if told else f"it ended with code {process.returncode}"
            raise OutputError(f"cannot write the animation: ffmpeg failed: {reason}")
        return file.read_bytes()


def _feed(process: "subprocess.Popen[bytes]", frames: _Frames) -> None:
    """Write the frames to ffmpeg, and wait for it."""
    assert process.stdin is not None
    try:
        for frame in frames:
            process.stdin.write(frame.tobytes())
        process.stdin.close()
    except BrokenPipeError:  # it ended early; its message says why
        pass
    process.wait()
