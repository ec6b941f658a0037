"""The mechanism of a result with its forces: at an instant, and moving as a GIF or MP4.

The whole stands above its enlarged parts. The key has each force with its size at the instant.
"""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import ceil, inf
from pathlib import Path
from subprocess import CalledProcessError
from tempfile import TemporaryDirectory
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Polygon
from matplotlib.transforms import Affine2D, ScaledTranslation
from PIL import Image

from frictionsim.display import (
    BELT_CONTACT,
    BLACK,
    EDGE,
    ROLES,
    TENSION_COLOURS,
    picture_text,
    study_text,
    unit_text,
    with_minus,
)
from frictionsim.errors import ArgumentError, InputError, OutputError
from frictionsim.io.output_file import ANIMATIONS, check_output, write_file
from frictionsim.motion import motion_of
from frictionsim.motion.parts import Arrow, Body, Disc, Line
from frictionsim.motion.samples import REFUSED
from frictionsim.motion.shapes import bar_below
from frictionsim.plots.style import (
    DOTS_PER_INCH,
    POINTS,
    Look,
    add_legend,
    axis_label,
    letters_across,
    new_figure,
    plain,
    set_title,
    styled,
    title_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.motion.parts import Bounds, Motion
    from frictionsim.results import Record

BELT, STRIP, CORD = 4.5, 2.0, 1.8  # points, widths of a belt, of the strip on it, of a cord
PATCH: Look = {"colors": BLACK, "linestyles": [(0, (0.12, 0.3))], "linewidths": BELT + 6.0}
HEAD = 11.0  # of an arrow
BARS: dict[str, Look] = {  # ends of bars, which differ in grey print too
    "friction": {"marker": "o", "markersize": 3.5},
    "load": {"marker": "s", "markersize": 3.5, "markerfacecolor": "white"},
}
SEEN = 0.02  # of the largest force: a bar that is shorter has no end


class Mechanism:
    """A motion in Axes, which `show` moves to a frame: one drawing for pictures and animations."""

    def __init__(self, ax: Any, motion: "Motion", bounds: "Bounds") -> None:
        self.ax, self._motion = ax, motion
        self._moves: list[Callable[[int], None]] = []
        left, right, low, high = bounds
        ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        draw: dict[type, Callable[[Any], None]] = {
            Body: self._body,
            Line: self._line,
            Arrow: self._arrow,
        }
        for part in motion.parts:
            draw[type(part)](part)
        _draw_scales(ax, motion, bounds)

    def show(self, frame: int) -> None:
        """Show a frame."""
        for move in self._moves:
            move(frame)

    def _body(self, body: Body) -> None:
        artists = [self.ax.add_patch(_patch(shape)) for shape in body.shapes]
        if body.label:
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.8}
            text: Look = {"ha": "center", "va": "center", "fontsize": "small", "clip_on": True}
            self.ax.text(body.x[0], body.y[0], plain(body.name), bbox=box, zorder=6, **text)

        def move(frame: int) -> None:
            pose = Affine2D().rotate(body.angle[frame]).translate(body.x[frame], body.y[frame])
            for artist in artists:
                artist.set_transform(pose + self.ax.transData)
                artist.set_visible(body.visible is None or bool(body.visible[frame]))

        self._moves.append(move)

    def _line(self, line: Line) -> None:
        add, colour = self.ax.add_collection, ROLES[line.role]
        patch = None if line.patch is None else add(LineCollection([], **PATCH))
        wide = CORD if line.value is None else BELT
        edge = None if line.value is None else add(LineCollection([], colors=EDGE, lw=wide + 1.2))
        body = add(LineCollection([], linewidths=wide, capstyle="round", snap=False))
        if line.value is None:
            body.set_color(colour)
        else:
            body.set(cmap=TENSION_COLOURS, clim=(np.min(line.value), np.max(line.value)))
        strips: dict[int, Any] = {}
        if line.stuck is not None:
            around = add(LineCollection([], colors=EDGE, linewidths=STRIP + 1.0, zorder=5))
            for stuck, word in ((1, "sticks"), (0, "slips")):
                core = BELT_CONTACT[word][1]
                strips[stuck] = add(LineCollection([], colors=core, linewidths=STRIP, zorder=5))
        (marks,) = self.ax.plot([], [], ".", color=EDGE, markersize=2.5, zorder=4)

        def move(frame: int) -> None:
            points = line.points[frame if len(line.points) > 1 else 0]
            pieces = np.stack([np.roll(points, 1, axis=0), points], axis=1)
            pieces = pieces if line.closed else pieces[1:]
            for collection in filter(None, (edge, body)):
                collection.set_segments(pieces)
            if line.value is not None:
                body.set_array(line.value[frame] if line.closed else line.value[frame][1:])
            if patch is not None:
                patch.set_segments(pieces[np.asarray(line.patch)])
            if line.stuck is not None:
                around.set_segments(pieces[line.stuck[frame] >= 0])
                for stuck, strip in strips.items():
                    strip.set_segments(pieces[line.stuck[frame] == stuck])
            marks.set_data(*_marks(line, points, frame).T)

        self._moves.append(move)

    def _arrow(self, arrow: Arrow) -> None:
        colour, scale = ROLES[arrow.role], self._motion.scale
        if not arrow.is_bars:
            look: Look = {"arrowstyle": "-|>", "mutation_scale": HEAD, "shrinkA": 0, "shrinkB": 0}
            drawn = FancyArrowPatch((0, 0), (1, 0), color=colour, linewidth=2, zorder=7, **look)
            self.ax.add_patch(drawn)

            def move(frame: int) -> None:
                foot, vector = arrow.foot[frame], scale * arrow.vector[frame]
                drawn.set_visible(bool(np.hypot(*vector) > 0.0))
                drawn.set_positions(tuple(foot), tuple(foot + vector))

            self._moves.append(move)
            return
        bars = self.ax.add_collection(LineCollection([], colors=colour, linewidths=1.4, zorder=6))
        ends = self.ax.plot(
            [], [], linestyle="", color=colour, zorder=6, **BARS.get(arrow.role, {})
        )
        size = arrow.size
        least = SEEN * float(size.max(initial=0.0))

        def move_bars(frame: int) -> None:
            foot, vector = arrow.foot[frame], arrow.vector[frame]
            seen = size[frame] > least
            bars.set_segments(np.stack([foot, foot + scale * vector], axis=1)[seen])
            if arrow.role in BARS:
                ends[0].set_data(*(foot + scale * vector)[seen].T)

        self._moves.append(move_bars)


def _patch(shape: Any) -> Any:
    """Return a shape as an artist."""
    colour = ROLES[shape.role]
    if isinstance(shape, Disc):
        face, edge = ("none", colour) if shape.open else (colour, EDGE)
        width = 1.4 if shape.open else 0.8
        return Circle((shape.x, shape.y), shape.radius, facecolor=face, edgecolor=edge, lw=width)
    edge = EDGE if shape.closed else colour
    look: Look = {"facecolor": colour, "edgecolor": edge, "linewidth": 0.8 if shape.closed else 1.6}
    return Polygon(shape.points, closed=shape.closed, fill=shape.closed, **look)


def _marks(line: Line, points: Any, frame: int) -> Any:
    """Return the places of the marks that run with a cord or belt, (n, 2), m."""
    if not line.spacing:
        return np.zeros((0, 2))
    legs = np.hypot(*np.diff(points, axis=0).T)
    if line.closed:
        return points[:: max(1, round(line.spacing / float(np.mean(legs))))]
    along = np.concatenate([[0.0], np.cumsum(legs)])
    run = 0.0 if line.travel is None else float(line.travel[frame])
    places = np.arange(run % line.spacing, along[-1], line.spacing)
    return np.column_stack([np.interp(places, along, xy) for xy in points.T])


# Pictures.

MIN_WHOLE, MAX_WHOLE, DETAIL, FRAME = 1.3, 4.6, 2.4, 0.9  # inches, of drawings, and of the title
BESIDE = (3.0, 2.0)  # widths of the whole and of a single detail, which stands beside it
BAR, BELOW = 0.22, 11.0  # of the width of the drawing: the longest bar of a scale; points


class Drawing:
    """A figure of a motion: the whole, its enlarged parts, numbers, and scales."""

    def __init__(self, motion: "Motion", figure: "Figure | SubFigure", title: str) -> None:
        self._motion = motion
        left, right, low, high = motion.bounds
        details, beside = motion.details, len(motion.details) == 1
        width = float(figure.bbox.width / figure.dpi) * (BESIDE[0] / sum(BESIDE) if beside else 1.0)
        whole = float(np.clip(width * (high - low) / (right - left), MIN_WHOLE, MAX_WHOLE))
        self._lines = _readout_lines(motion, letters_across(figure, 0.83))
        heights = [0.16 * (1 + self._lines[0].count("\n")), whole]
        heights += [min(DETAIL, width / len(details))] if details and not beside else []
        coloured = [p for p in motion.parts if isinstance(p, Line) and p.value is not None]
        if isinstance(figure, Figure):  # else it has the height of its place
            figure.set_figheight(FRAME + sum(heights) + (0.7 if coloured else 0.0))
        set_title(figure, title)
        columns = 2 if beside else max(len(details), 1)
        widths = BESIDE if beside else None
        grid = figure.add_gridspec(
            len(heights), columns, height_ratios=heights, width_ratios=widths
        )
        top = figure.add_subplot(grid[0, :])
        top.set_axis_off()
        self._text = top.text(0.0, 1.0, "", fontsize="small", va="top")
        self.axes = figure.add_subplot(grid[1, 0] if beside else grid[1, :])
        self._views = [Mechanism(self.axes, motion, motion.bounds)]
        self.axes.set_axis_off()
        for i, detail in enumerate(details):
            ax = figure.add_subplot(grid[1, 1] if beside else grid[2, i])
            ax.set_title(plain(fill(detail.name, 24)), fontsize="small")
            ax.set(xticks=[], yticks=[])
            self._views.append(Mechanism(ax, motion, detail.bounds))
        for line in coloured:
            values = np.asarray(line.value)
            scale = Normalize(float(values.min()), float(values.max()))
            colours = ScalarMappable(scale, TENSION_COLOURS)
            bar = figure.colorbar(colours, ax=self.axes, location="bottom", aspect=50, pad=0.02)
            bar.set_label(axis_label(line.quantity, line.unit))

        self.moving = [top, *(view.ax for view in self._views)]

    def show(self, frame: int) -> None:
        """Show a frame with its numbers."""
        for view in self._views:
            view.show(frame)
        self._text.set_text(plain(self._lines[frame]))


def _readout_lines(motion: "Motion", across: int) -> list[str]:
    """Return the time and the readouts of each frame, in lines that fit across a figure."""
    places = max(0, 4 - int(np.floor(np.log10(max(float(np.ptp(motion.time)), 1e-9)))))
    frames = [f"at {round(time, places):.6g} s" for time in motion.time.tolist()]
    room = 0
    for readout in motion.readouts:
        length = len(readout.name) + 16
        between = "\n" if length > room else ",   "
        room = (across if length > room else room) - length
        pairs = zip(frames, readout.texts, strict=True)
        frames = [f"{text}{between}{readout.name} {value}" for text, value in pairs]
    return frames


def _draw_scales(ax: Any, motion: "Motion", bounds: "Bounds") -> None:
    """Draw bars for a length and a force below a drawing."""
    left, right, low, _ = bounds
    wide = BAR * (right - left)
    sizes = [p.size.max() for p in motion.parts if isinstance(p, Arrow)]
    scales = [(bar_below(wide), "m", 1.0)]
    if motion.scale > 0.0:
        force = bar_below(min(wide / motion.scale, float(max(sizes))))
        scales.append((force, "N", motion.scale))
    for row, (size, unit, scale) in enumerate(scales, start=1):
        down = ScaledTranslation(0.0, -row * BELOW / POINTS, ax.figure.dpi_scale_trans)
        ends, look = [left, left + size * scale], {"color": BLACK, "linewidth": 1.2, "marker": "|"}
        ax.plot(ends, [low, low], transform=ax.transData + down, clip_on=False, **look)
        text: Look = {"xytext": (5.0, -row * BELOW), "textcoords": "offset points", "va": "center"}
        text |= {"fontsize": "x-small", "annotation_clip": False}
        ax.annotate(f"{study_text(size)} {unit}", (ends[1], low), **text)


def key_of(motion: "Motion", frame: int | None = None) -> dict[str, Any]:
    """Return the key of a motion by words; at a frame with the size of each force."""
    handles: dict[str, Any] = {}
    for part in motion.parts:
        if isinstance(part, Body):
            if part.name and not part.label:
                handles.setdefault(part.name, _sample(part))
            continue
        look: Look = {"color": ROLES[part.role], "linewidth": 2.0}
        if isinstance(part, Line):
            if part.stuck is not None:
                for text, core in BELT_CONTACT.values():
                    mark: Look = {"marker": "s", "markersize": 8, "linestyle": ""}
                    handles[text] = Line2D([], [], mfc=core, mec=EDGE, **mark)
            if part.patch is not None:
                teeth: Look = {"linestyle": PATCH["linestyles"][0], "linewidth": BELT}
                handles["patch with other friction"] = Line2D([], [], color=BLACK, **teeth)
        elif part.is_bars:
            look |= {"linewidth": 1.4, **BARS.get(part.role, {})}
        else:
            look |= {"marker": ">", "markevery": [1], "markersize": 6}
        if part.name and not (isinstance(part, Line) and part.value is not None):
            words = part.name
            if frame is not None and part.size is not None and part.size.ndim == 1:
                size = with_minus(picture_text(float(part.size[frame])))
                words += f", {size} {unit_text(part.unit)}"
            handles.setdefault(words, Line2D([0, 1], [0, 0], **look))
    return handles


def _sample(body: Body) -> Any:
    shape = body.shapes[0]
    colour = ROLES[shape.role]
    marker: Look = {"linestyle": "", "marker": "s", "markersize": 8}
    if isinstance(shape, Disc):
        marker["marker"] = "o"
        if shape.open:
            return Line2D([], [], mec=colour, mew=1.6, mfc="none", **marker)
    return Line2D([], [], mfc=colour, mec=EDGE, mew=0.8, **marker)


def draw_mechanism(record: "Record", figure: "Figure | SubFigure", sample: int = -1) -> None:
    """Draw the mechanism with its forces at a sample."""
    _, key = draw_still(record, figure, motion_at(record, sample))
    add_legend(figure, key, columns=3)


def draw_still(
    record: "Record", figure: "Figure | SubFigure", motion: "Motion"
) -> tuple[Any, dict[str, Any]]:
    """Draw a motion of one frame; return the Axes of the whole, and the key by words."""
    drawing = Drawing(motion, figure, title_of(record))
    drawing.show(0)
    return drawing.axes, key_of(motion, 0)


def motion_at(record: "Record", sample: int) -> "Motion":
    """Return the motion of a single sample, whose arrows are on the scale of the run."""
    of_run = None
    with suppress(InputError):  # other samples may have numbers that cannot be drawn
        of_run = motion_of(record)
    motion = motion_of(record, sample % len(record.time))
    if motion is None:
        raise InputError("cannot draw this result: there is no drawing of its kind")
    return motion._replace(bounds=of_run.bounds, scale=of_run.scale) if of_run else motion


# Animations.

SECONDS = 8.0  # that a run takes by default
FRAMES_PER_SECOND = {".gif": 20.0, ".mp4": 30.0}
MAX_FRAMES_PER_SECOND = {".gif": 50.0, ".mp4": 120.0}  # a GIF counts hundredths of a second
MAX_FRAMES = 6000
FFMPEG = "ffmpeg"


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


def animate(
    record: "Record",
    path: Path,
    fps: float | None = None,
    speed: float | None = None,
    progress: Callable[[int, int], None] | None = None,
    name: str = "",
) -> None:
    """Write the mechanism of a result in motion as a GIF or MP4, by the suffix of the path.

    Parameters
    ----------
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
    try:
        motion = motion_of(record)
    except InputError as error:
        raise InputError(f"{name}: {error}" if name else str(error)) from None
    if motion is None:
        raise InputError(f"{REFUSED}: there is no drawing of its kind")
    fps = rate_of(kind, fps)
    frames = frames_of(motion.time, fps, speed)
    with styled(), TemporaryDirectory(prefix="frictionsim-") as folder:
        figure = new_figure()
        drawing = Drawing(motion, figure, title_of(record))
        drawing.show(0)
        add_legend(figure, key_of(motion), columns=3)
        figure.draw_without_rendering()
        figure.set_layout_engine(None)  # what is drawn keeps its place, and is drawn once
        part, writer = Path(folder, f"animation{kind}"), _writer(kind, fps, drawing)
        try:
            with writer.saving(figure, str(part), DOTS_PER_INCH):
                for count, frame in enumerate(frames.tolist(), 1):
                    drawing.show(frame)
                    writer.grab_frame()
                    if progress is not None:
                        progress(count, len(frames))
        except CalledProcessError as error:
            lines = str(error.stderr or "").strip().splitlines()
            reason = lines[-1] if lines else f"it ended with code {error.returncode}"
            raise OutputError(f"cannot write the animation: ffmpeg failed: {reason}") from None
        write_file(path, part.read_bytes(), ANIMATIONS[kind])


class GifWriter:
    """A GIF, of which a frame draws anew only what moves: like a writer of matplotlib."""

    def __init__(self, fps: float, drawing: Drawing) -> None:
        self._fps, self._moving = fps, drawing.moving
        self._images: list[Image.Image] = []

    @contextmanager
    def saving(self, figure: Figure, path: str, dpi: float) -> Iterator[None]:
        """Write the frames that are grabbed meanwhile."""
        figure.dpi = dpi
        canvas: Any = FigureCanvasAgg(figure)
        self._canvas = canvas
        for visible in (False, True):
            for ax in self._moving:
                ax.set_visible(visible)
            if not visible:
                canvas.draw()
                self._still = canvas.copy_from_bbox(figure.bbox)
        yield
        first, *others = self._images
        duration = int(1000.0 / self._fps)
        first.save(path, save_all=True, append_images=others, duration=duration, loop=0)

    def grab_frame(self) -> None:
        """Draw a frame."""
        self._canvas.restore_region(self._still)
        for ax in self._moving:
            ax.draw(self._canvas.get_renderer())
        image = Image.fromarray(np.asarray(self._canvas.buffer_rgba())).convert("RGB")
        octree = Image.Quantize.FASTOCTREE  # ten times faster than the default
        # One palette, of the first frame, whose key has all colours: what stands still stays equal.
        first = self._images[0] if self._images else None
        self._images.append(image.quantize(method=octree, palette=first, dither=Image.Dither.NONE))


def _writer(kind: str, fps: float, drawing: Drawing) -> Any:
    if kind == ".gif":
        return GifWriter(fps, drawing)
    from matplotlib.animation import FFMpegWriter  # slow

    writer: Any = FFMpegWriter
    return writer(fps=fps)


def rate_of(kind: str, fps: float | None) -> float:
    """Return the frames per second of an animation."""
    most = MAX_FRAMES_PER_SECOND[kind]
    fps = FRAMES_PER_SECOND[kind] if fps is None else fps
    if not 0.0 < fps <= most:
        raise ArgumentError(
            "fps", f"expected a number above 0 and up to {most:g} for {kind}, got {fps:g}"
        )
    if kind != ".gif":
        return fps
    # A GIF counts hundredths of a second, and Pillow's writer cuts what is less than one off.
    return 100.0 / (max(round(100.0 / fps), 1) + 1e-6)


def frames_of(time: Any, fps: float, speed: float | None) -> Any:
    """Return the frame of a motion, with times in s, that each frame of an animation shows."""
    duration = float(time[-1] - time[0])
    speed = (duration / SECONDS if duration else 1.0) if speed is None else speed
    if not 0.0 < speed < inf:
        raise ArgumentError("speed", f"expected a number above 0, got {speed:g}")
    count = duration / speed * fps
    if count > MAX_FRAMES:
        raise ArgumentError(
            "speed",
            f"at {speed:g} simulated seconds per second the animation would have {count:.6g}"
            f" frames, more than {MAX_FRAMES}; give a larger speed or fewer frames per second",
        )
    times = time[0] + speed / fps * np.arange(ceil(count - 1e-9) + 1)
    return np.maximum(np.searchsorted(time, times, side="right") - 1, 0)
