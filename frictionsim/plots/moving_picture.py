"""A picture of a mechanism that is moved from frame to frame: drawing, details, numbers, key."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from frictionsim.motion.parts import Arrow, Band, Body, Disc, Motion, Trail
from frictionsim.motion.poses import (
    decimals_of,
    moment_of,
    shown_value,
    shown_word,
    state_word,
)
from frictionsim.plots.literal_text import literal, make_literal
from frictionsim.plots.moving_parts import BELT, BELT_EDGE, CMAP, COLOURS, EDGE, moving
from frictionsim.plots.style import BLACK, WIDTH, Style

if TYPE_CHECKING:
    from frictionsim.motion.parts import Bounds

POINTS = 72.0  # per inch
WIDE = 1.6  # width relative to the height: numbers and key of a wider drawing stand below it
# Inches.
TITLE, MARGIN, ROW = 0.42, 0.12, 0.21
PANEL = 2.9  # width of numbers and key beside a drawing
MIN_HEIGHT, MAX_HEIGHT = 1.0, 4.6  # of the drawing
DETAIL, CAPTION = 2.1, 0.3
BAR = 0.62  # height of the scale of colours
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
        entries, rows = self._key(), len(motion.readouts) + 1 + (motion.state is not None)
        scaled = any(isinstance(part, Band) and part.value is not None for part in motion.parts)
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
        moment = moment_of(self._motion.time, time)
        for part in self._drawn:
            part.move(moment, time)
        for text, write in self._numbers:
            text.set_text(literal(write(moment, time)))
        self._draw_moved()
        return np.asarray(self.canvas.buffer_rgba())

    def _draw_moved(self) -> None:
        """Draw what moves over what does not, which is drawn once."""
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
            self._drawn.append(moving(ax, part, 1.0 if labels else THICK, 1.0 / POINTS / scale))
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
        """Return what is written beside the drawing: a name, and a function of the time."""
        motion = self._motion
        places = max(0, 3 - int(np.floor(np.log10(max(float(np.ptp(motion.time)), 1e-12)))))
        rows: list[tuple[str, Any]] = [("time", lambda moment, time: f"{time:.{places}f} s")]
        if motion.state is not None:
            rows.append(("contact", lambda moment, time: state_word(motion, moment)))
        for readout in motion.readouts:
            decimals = 0 if readout.unit == "1" else decimals_of(readout.value)
            unit = "" if readout.unit == "1" else " " + readout.unit.replace("^2", "²")

            def write(
                moment: Any,
                time: float,
                readout: Any = readout,
                decimals: int = decimals,
                unit: str = unit,
            ) -> str:
                if readout.words:
                    return shown_word(readout, moment)
                text = f"{shown_value(readout, moment):.{decimals}f}"
                if not float(text):
                    text = text.lstrip("-")
                return text.replace("-", "\N{MINUS SIGN}") + unit

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
            self._scale(x, y - 0.25, PANEL - 0.3)
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
            self._scale(0.25 * WIDTH, y - 0.25, 0.5 * WIDTH)
            y -= BAR
        self._legend(entries, "upper center", (0.5, y / self._height), columns=COLUMNS)

    def _scale(self, x: float, y: float, width: float) -> None:
        """Draw the scale of the colours of a belt."""
        band = next(b for b in self._motion.parts if isinstance(b, Band) and b.value is not None)
        assert band.value is not None
        norm = Normalize(float(band.value.min()), float(band.value.max()))
        ax = self._axes(x, y, width, 0.12)
        bar = self.figure.colorbar(ScalarMappable(norm, CMAP), cax=ax, orientation="horizontal")
        bar.ax.tick_params(labelsize="x-small", pad=1.5, length=2.5)
        label = f"{band.quantity}, {band.unit}"
        ax.text(-0.02, 0.5, label, ha="right", va="center", fontsize=SMALL, transform=ax.transAxes)

    def _legend(
        self, entries: list[Any], loc: str, where: tuple[float, float], columns: int
    ) -> None:
        if entries:
            place: Style = {"loc": loc, "bbox_to_anchor": where, "borderaxespad": 0.2}
            look: Style = {"frameon": False, "handlelength": 2.2, "labelspacing": 0.35}
            columns = min(columns, len(entries))
            self.figure.legend(handles=entries, ncols=columns, fontsize=SMALL, **place, **look)

    def _key(self) -> list[Any]:
        """Return a sample of each part with a name; parts of one name once."""
        found: dict[str, Any] = {}
        for part in self._motion.parts:
            if isinstance(part, Band):
                found |= _key_of_band(part)
            elif part.name and not getattr(part, "label", False):
                found.setdefault(part.name, _sample(part))
        for name, sample in found.items():
            sample.set_label(name)
        return list(found.values())


def _sample(part: "Body | Trail | Arrow") -> Any:
    if isinstance(part, Trail):
        return Line2D([], [], color=COLOURS["path"], lw=1.5)
    if isinstance(part, Arrow):
        colour = COLOURS[part.role]
        tip: Style = {"marker": ">", "markevery": [-1], "markersize": 6}
        return Line2D([0, 1], [0, 0], color=colour, lw=2.2, **tip)
    shape = part.shapes[0]
    colour = COLOURS[shape.role]
    if shape.role == "cut":
        return Patch(fc="none", ec=colour, ls=(0, (4, 3)))
    if not isinstance(shape, Disc):
        return Patch(fc=colour, ec=EDGE, lw=0.8)
    ring: Style = {"color": "none", "marker": "o", "markersize": 8}
    if shape.open:
        circle: Style = ring | {"mfc": "none", "mec": colour, "mew": 1.4}
        if shape.role == "paper":  # a white line, which is on something dark
            halo = [withStroke(linewidth=5.0, foreground=COLOURS["fixed"])]
            circle |= {"mfc": COLOURS["fixed"], "path_effects": halo}
        return Line2D([], [], **circle)
    return Line2D([], [], **ring, mfc=colour, mec=EDGE, mew=0.8)


def _key_of_band(band: Band) -> dict[str, Any]:
    if band.value is None and band.touching is None:
        colour = EDGE if band.role is None else COLOURS[band.role]
        return {band.name: Line2D([], [], color=colour, lw=2.2)} if band.name else {}
    found: dict[str, Any] = {}
    edged = [withStroke(linewidth=BELT + BELT_EDGE, foreground=EDGE)]
    if band.sticking is not None:
        found["sticks on the pulley"] = Line2D([], [], color=BLACK, lw=BELT, path_effects=edged)
        found["slips on the pulley"] = Line2D([], [], color="white", lw=BELT, path_effects=edged)
    elif band.touching is not None:
        found["touches the pulley"] = Line2D([], [], color="white", lw=BELT, path_effects=edged)
    if band.patch is not None:
        found["patch with other friction"] = Line2D([], [], color=COLOURS["friction"], lw=7.0)
    return found
