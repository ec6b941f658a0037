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
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from frictionsim.display import (
    BELT_CONTACT,
    EDGE,
    ROLES,
    TENSION_COLOURS,
    unit_text,
    with_minus,
)
from frictionsim.errors import ArgumentError, InputError, OutputError
from frictionsim.io.output_file import ANIMATIONS, check_output, write_file
from frictionsim.motion import motion_of
from frictionsim.motion.parts import Arrow, Body, Disc, Line, Motion
from frictionsim.plots.moving_parts import BELT, BELT_EDGE, moving
from frictionsim.plots.old_style import WIDTH, Style, short_overrides
from frictionsim.plots.picture_file import DOTS_PER_INCH, rendering
from frictionsim.plots.texts import literal, make_literal

if TYPE_CHECKING:
    from frictionsim.motion.parts import Bounds
    from frictionsim.results import Record

POINTS = 72.0  # per inch
WIDE = 1.6  # width relative to the height: numbers and key of a wider drawing stand below it
# Inches.
TITLE, MARGIN, ROW = 0.42, 0.12, 0.21
PANEL = 2.9  # width of numbers and key beside a drawing
MIN_HEIGHT, MAX_HEIGHT = 1.0, 4.6  # of the drawing
DETAIL, CAPTION = 2.1, 0.3
BAR = 0.75  # height of the scale of colours, with its label
COLUMNS = 3  # of numbers and key below a wide drawing
THICK = 1.5  # factor of line widths in details
SMALL = "small"


class MovingPicture:
    """A figure of a motion that shows any time."""

    def __init__(self, motion: Motion, title: str) -> None:
        self._motion = motion
        left, right, bottom, top = motion.bounds
        self._wide = right - left > WIDE * (top - bottom)
        width = WIDTH - 2.0 * MARGIN - (0.0 if self._wide else PANEL)
        wanted = width * (top - bottom) / (right - left)
        height = float(np.clip(wanted, MIN_HEIGHT, MAX_HEIGHT))
        entries, rows = self._key(), len(motion.readouts) + 1
        scaled = any(isinstance(part, Line) and part.value is not None for part in motion.parts)
        if self._wide:
            below = ROW * (-(-rows // COLUMNS) + -(-len(entries) // COLUMNS)) + 0.1 + BAR * scaled
        else:
            below = 0.0
            height = max(height, ROW * (rows + len(entries) + 1) + 0.3 + BAR * scaled)
        details = DETAIL + CAPTION if motion.details else 0.0
        self._height = TITLE + height + details + below + MARGIN
        self.figure = Figure(figsize=(WIDTH, self._height))
        self.canvas: Any = FigureCanvasAgg(self.figure)  # whose methods have no types
        text = self.figure.text(
            0.5, 1.0 - 0.5 * TITLE / self._height, title, ha="center", va="center"
        )
        text.set_fontsize("medium")
        self._drawn: list[Any] = []
        self._moved: list[Any] = []  # artists, from back to front
        self._background: Any = None
        y = self._height - TITLE - height
        self._draw(motion.bounds, (MARGIN, y, width, height), labels=True)
        self._draw_details(y - DETAIL - CAPTION)
        self._numbers: list[tuple[Any, Any]] = []
        if self._wide:
            self._panel_below(entries, y - details, scaled)
        else:
            self._panel_beside(entries, scaled)
        make_literal(self.figure)

    def show(self, time: float) -> Any:
        """Return the pixels at a time, (height, width, 4) of bytes; the next call replaces them."""
        last = len(self._motion.time) - 1
        frame = min(max(int(np.searchsorted(self._motion.time, time, side="right")) - 1, 0), last)
        for part in self._drawn:
            part.move(frame)
        for text, write in self._numbers:
            text.set_text(literal(write(frame, time)))
        self._draw_moved()
        return np.asarray(self.canvas.buffer_rgba())

    def _draw_moved(self) -> None:
        """Draw the moving parts over the still ones, which are drawn once."""
        if self._background is None:
            self.canvas.draw()
            self._background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self._background)
        for artist in self._moved:
            artist.axes.draw_artist(artist)
        for text, _ in self._numbers:
            self.figure.draw_artist(text)

    def _axes(self, x: float, y: float, width: float, height: float) -> Any:
        """Return axes at a place in inches from the lower left corner."""
        place = (x / WIDTH, y / self._height, width / WIDTH, height / self._height)
        return self.figure.add_axes(place)

    def _draw(
        self, bounds: "Bounds", place: tuple[float, float, float, float], labels: bool
    ) -> None:
        ax = self._axes(*place)
        ax.set_axis_off()
        left, right, bottom, top = bounds
        scale = min(place[2] / (right - left), place[3] / (top - bottom))  # inches per metre
        x, y = 0.5 * (left + right), 0.5 * (bottom + top)
        ax.set_xlim(x - 0.5 * place[2] / scale, x + 0.5 * place[2] / scale)
        ax.set_ylim(y - 0.5 * place[3] / scale, y + 0.5 * place[3] / scale)
        fixed = set(ax.get_children())
        for part in self._motion.parts:
            thick, point = 1.0 if labels else THICK, 1.0 / POINTS / scale
            self._drawn.append(moving(ax, part, thick, point, self._motion.scale))
        for part in self._motion.parts:
            if labels and isinstance(part, Body) and part.label:
                halo = [withStroke(linewidth=2.5, foreground="white")]
                where = (float(part.x[0]), float(part.y[0]))
                style: Style = {
                    "ha": "center",
                    "va": "center",
                    "fontsize": SMALL,
                    "path_effects": halo,
                }
                ax.text(*where, part.name, **style)
        for artist in (child for child in ax.get_children() if child not in fixed):
            artist.set_animated(True)
            self._moved.append(artist)

    def _draw_details(self, y: float) -> None:
        count = len(self._motion.details)
        side = min(DETAIL, (WIDTH - 2.0 * MARGIN) / max(count, 1))
        gap = (WIDTH - count * side) / (count + 1)
        for i, (name, bounds) in enumerate(self._motion.details):
            x = gap + i * (side + gap)
            self._draw(bounds, (x, y, side, side), labels=False)
            where = ((x + 0.5 * side) / WIDTH, (y + side + 0.3 * CAPTION) / self._height)
            self.figure.text(*where, name, ha="center", fontsize=SMALL)

    def _rows(self) -> list[tuple[str, Any]]:
        """Return the readouts beside the drawing: a name, and a function of the time."""
        motion = self._motion
        places = max(0, 3 - int(np.floor(np.log10(max(float(np.ptp(motion.time)), 1e-12)))))
        rows: list[tuple[str, Any]] = [("time", lambda frame, time: f"{time:.{places}f} s")]
        for readout in motion.readouts:
            decimals = 0 if readout.unit == "1" else decimals_of(readout.value)
            unit = f" {unit_text(readout.unit)}".rstrip()

            def write(
                frame: int,
                time: float,
                readout: Any = readout,
                decimals: int = decimals,
                unit: str = unit,
            ) -> str:
                if readout.words:
                    return str(readout.words.get(int(readout.value[frame]), ""))
                return with_minus(f"{readout.value[frame]:.{decimals}f}") + unit

            rows.append((readout.name, write))
        return rows

    def _number(self, x: float, y: float, width: float, row: tuple[str, Any]) -> None:
        """Write a name and a number, from a place in inches."""
        name, write = row
        style: Style = {"fontsize": SMALL, "va": "center"}
        self.figure.text(x / WIDTH, y / self._height, name, **style)
        number = self.figure.text((x + width) / WIDTH, y / self._height, "", ha="right", **style)
        number.set_animated(True)
        self._numbers.append((number, write))

    def _panel_beside(self, entries: list[Any], scaled: bool) -> None:
        x, y = WIDTH - PANEL, self._height - TITLE - 0.1
        for row in self._rows():
            self._number(x, y, PANEL - 0.3, row)
            y -= ROW
        if scaled:
            self._scale(x, y - 0.38, PANEL - 0.3)
            y -= BAR
        where = (x / WIDTH - 0.01, y / self._height)
        self._legend(entries, "upper left", where, columns=1)

    def _panel_below(self, entries: list[Any], y: float, scaled: bool) -> None:
        width = (WIDTH - 2.0 * MARGIN) / COLUMNS
        rows = self._rows()
        lines = -(-len(rows) // COLUMNS)
        for i, row in enumerate(rows):
            column, line = divmod(i, lines)
            place = (MARGIN + column * width, y - ROW * (line + 0.5))
            self._number(*place, width - 0.35, row)
        y -= ROW * lines
        if scaled:
            self._scale(0.25 * WIDTH, y - 0.38, 0.5 * WIDTH)
            y -= BAR
        self._legend(entries, "upper center", (0.5, y / self._height), columns=COLUMNS)

    def _scale(self, x: float, y: float, width: float) -> None:
        """Draw the scale of the colours of a belt."""
        band = next(b for b in self._motion.parts if isinstance(b, Line) and b.value is not None)
        assert band.value is not None
        norm = Normalize(float(band.value.min()), float(band.value.max()))
        ax = self._axes(x, y, width, 0.12)
        bar = self.figure.colorbar(
            ScalarMappable(norm, TENSION_COLOURS), cax=ax, orientation="horizontal"
        )
        bar.ax.tick_params(labelsize="x-small", pad=1.5, length=2.5)
        label = f"{band.quantity}, {band.unit}"
        ax.set_title(label, loc="left", fontsize=SMALL, pad=3)

    def _legend(
        self, entries: list[Any], loc: str, where: tuple[float, float], columns: int
    ) -> None:
        if entries:
            place: Style = {"loc": loc, "bbox_to_anchor": where, "borderaxespad": 0.2}
            style: Style = {"frameon": False, "handlelength": 2.2, "labelspacing": 0.35}
            columns = min(columns, len(entries))
            self.figure.legend(handles=entries, ncols=columns, fontsize=SMALL, **place, **style)

    def _key(self) -> list[Any]:
        """Return a sample of each part with a name; parts of one name once."""
        samples: dict[str, Any] = {}
        for part in self._motion.parts:
            if isinstance(part, Line):
                samples |= _key_of_line(part)
            elif part.name and not getattr(part, "label", False):
                samples.setdefault(part.name, _sample(part))
        for name, sample in samples.items():
            sample.set_label(name)
        return list(samples.values())


def _sample(part: "Body | Arrow") -> Any:
    if isinstance(part, Arrow):
        colour = ROLES[part.role]
        tip: Style = {} if part.is_bars else {"marker": ">", "markevery": [-1], "markersize": 6}
        return Line2D([0, 1], [0, 0], color=colour, lw=2.2, **tip)
    shape = part.shapes[0]
    colour = ROLES[shape.role]
    if not isinstance(shape, Disc):
        return Patch(fc=colour, ec=EDGE, lw=0.8)
    ring: Style = {"color": "none", "marker": "o", "markersize": 8}
    if shape.open:
        circle: Style = ring | {"mfc": "none", "mec": colour, "mew": 1.4}
        if shape.role == "paper":  # a white line, which is on something dark
            halo = [withStroke(linewidth=5.0, foreground=ROLES["fixed"])]
            circle |= {"mfc": ROLES["fixed"], "path_effects": halo}
        return Line2D([], [], **circle)
    return Line2D([], [], **ring, mfc=colour, mec=EDGE, mew=0.8)


def _key_of_line(line: Line) -> dict[str, Any]:
    if not line.closed:
        return {line.name: Line2D([], [], color=ROLES[line.role], lw=2.2)} if line.name else {}
    samples: dict[str, Any] = {}
    edged = [withStroke(linewidth=BELT + BELT_EDGE, foreground=EDGE)]
    for mode in () if line.stuck is None else ("sticks", "slips"):
        words, colour, _ = BELT_CONTACT[mode]
        samples[words] = Line2D([], [], color=colour, lw=BELT, path_effects=edged)
    if line.patch is not None:
        samples["patch with other friction"] = Line2D([], [], color=ROLES["friction"], lw=7.0)
    return samples


def decimals_of(values: Any) -> int:
    """Return the number of decimals of a read-out: four digits of its largest number."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return max(0, 3 - int(np.floor(np.log10(largest)))) if largest > 0.0 else 3


SECONDS = 8.0  # that a run takes by default
FRAMES_PER_SECOND = {".gif": 20.0, ".mp4": 30.0}
MAX_FRAMES_PER_SECOND = {".gif": 50.0, ".mp4": 120.0}  # a GIF counts hundredths of a second
MAX_FRAMES = 6000
GIF_UNIT = 0.01  # s
GIF_COLOURS = 255  # one more marks a pixel that does not change
PALETTE_FRAMES = 5  # of which the colours of a GIF are taken
PILLOW_STEP = 4
FFMPEG = "ffmpeg"

FrameProgress = Callable[[int, int], None]
"""Called with the number of frames drawn and the total."""


class Timing(NamedTuple):
    """The frames of an animation: their times in s, and how long each is shown in s."""

    times: Any
    shown: float


def animate(
    result: "Record",
    path: Path,
    fps: float | None = None,
    speed: float | None = None,
    progress: FrameProgress | None = None,
    name: str = "",
) -> None:
    """Write the mechanism of a result in motion; equal results give identical GIFs.

    Parameters
    ----------
    path : Path
        Ends in .gif or .mp4.
    fps : float, optional
        Frames per second: 20 of a GIF, 30 of MP4.
    speed : float, optional
        Simulated seconds per second; by default the run takes 8 s.
    progress : callable, optional
        Called with the number of frames drawn and the total.
    name : str
        Of the file of the result, for messages.
    """
    check_animation(path)
    kind = path.suffix.lower()
    motion = _motion(result, name)
    timing = timing_of(motion, kind, fps, speed)
    title = result.attributes["title"] or result.attributes["kind"]
    if overrides := short_overrides(result.attributes):
        title += f" ({'; '.join(overrides)})"
    with rendering():
        frames = _frames(motion, title, timing, progress)
        image = _gif(frames, timing) if kind == ".gif" else _mp4(frames, timing)
    write_file(path, image, ANIMATIONS[kind])


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
    """Check that an animation can be written, and that no other file is replaced by one."""
    kind = path.suffix.lower()
    if kind not in ANIMATIONS:
        raise InputError(f"{path}: expected the name of an animation, which ends in .gif or .mp4")
    if kind == ".mp4" and shutil.which(FFMPEG) is None:
        raise InputError(
            f"{path}: MP4 needs the program ffmpeg, which is not installed; install it (on Debian"
            " 'apt install ffmpeg', see https://ffmpeg.org), or give a name that ends in .gif"
        )
    check_output(path, ANIMATIONS[kind])


def timing_of(motion: "Motion", kind: str, fps: float | None, speed: float | None) -> Timing:
    """Return the times of the frames.

    Parameters
    ----------
    kind : str
        ".gif" or ".mp4".
    fps, speed
        As of `animate`.
    """
    most = MAX_FRAMES_PER_SECOND[kind]
    fps = FRAMES_PER_SECOND[kind] if fps is None else fps
    if not 0.0 < fps <= most:
        raise ArgumentError(
            "fps", f"expected a number above 0 and up to {most:g} for {kind}, got {fps:g}"
        )
    duration = float(motion.time[-1] - motion.time[0])
    speed = (duration / SECONDS if duration else 1.0) if speed is None else speed
    if not 0.0 < speed < np.inf:
        raise ArgumentError("speed", f"expected a number above 0, got {speed:g}")
    shown = max(round(1.0 / fps / GIF_UNIT), 1) * GIF_UNIT if kind == ".gif" else 1.0 / fps
    count = duration / speed / shown
    if count > MAX_FRAMES:
        raise ArgumentError(
            "speed",
            f"at {speed:g} simulated seconds per second the animation would have"
            f" {count:.6g} frames, more than {MAX_FRAMES}; give a larger speed or fewer frames per"
            " second",
        )
    times = motion.time[0] + speed * shown * np.arange(ceil(count - 1e-9) + 1)
    return Timing(np.minimum(times, motion.time[-1]), shown)


def _frames(
    motion: "Motion", title: str, timing: Timing, progress: FrameProgress | None
) -> "_FrameImages":
    return _FrameImages(MovingPicture(motion, title), timing.times, progress)


class _FrameImages:
    """The frames of an animation as images, which are drawn when they are needed."""

    def __init__(self, picture: MovingPicture, times: Any, progress: FrameProgress | None) -> None:
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


def _gif(frames: _FrameImages, timing: Timing) -> bytes:
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


def _palette(frames: _FrameImages) -> Any:
    """Return an image with the colours of a GIF; white and black are among them."""
    from PIL import Image

    palette = Image.fromarray(np.concatenate(frames.some(PALETTE_FRAMES))).quantize(GIF_COLOURS)
    colours = np.array(palette.getpalette()).reshape(-1, 3)
    # Pillow looks for the colours of a GIF in steps of 4: it must find no other one near white.
    for exact in (0, 255):
        colours[np.all(np.abs(colours - exact) < 2 * PILLOW_STEP, axis=1)] = exact
    palette.putpalette(colours.ravel().tolist())
    return palette


def _mp4(frames: _FrameImages, timing: Timing) -> bytes:
    """Return an MP4 by ffmpeg, which reads the frames from a pipe."""
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
            lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            reason = lines[-1] if lines else f"it ended with code {process.returncode}"
            raise OutputError(f"cannot write the animation: ffmpeg failed: {reason}")
        return file.read_bytes()


def _feed(process: "subprocess.Popen[bytes]", frames: _FrameImages) -> None:
    """Write the frames to ffmpeg, and wait for it."""
    assert process.stdin is not None
    try:
        for frame in frames:
            process.stdin.write(frame.tobytes())
        process.stdin.close()
    except BrokenPipeError:  # it ended early; its message says why
        pass
    process.wait()
