"""A mechanism in motion as SVG, and what its parts do from frame to frame, which the page plays.

The parts are drawn once, and shown larger by `<use>`. Of each attribute that changes the page has
its value at each frame: the scripts only set it.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import BELT_CONTACT, TENSION_SCALE, study_text, unit_text
from frictionsim.motion.parts import ROUNDOFF, Arrow, Body, Disc, Line, Outline, texts
from frictionsim.motion.shapes import bar_below
from frictionsim.reports.html import Html, escaped

if TYPE_CHECKING:
    from frictionsim.motion.parts import Motion

SIZE = 5000  # units along the larger side of a drawing
HEAD, LABEL, MARK = 90, 150, 10  # units: length of the head of an arrow; of a letter; of a mark
MARK_REACH = 90  # units across a cord
BELT_MARK_REACH = 120
STRIPS = (("sticks", 1), ("slips", 0))


class Track(NamedTuple):
    """An attribute of elements, or their "text", at each frame."""

    ids: tuple[str, ...]
    name: str
    values: Sequence[str]


class Row(NamedTuple):
    """A row beside a drawing: a sample of the part as HTML, its name, and what it reads per frame.

    The values are those of an arrow, a couple or a readout; empty for a part without a size.
    """

    sample: Html
    name: str
    values: Sequence[str] = ()


class Drawing:
    """The drawing of a motion.

    Attributes
    ----------
    svg : str
        The whole, and its enlargements.
    rows : list of Row
    tracks : list of Track
    is_wide : bool
        It needs the width of its place.
    """

    def __init__(self, motion: "Motion", name: str, words: str) -> None:
        self._motion, self._name, self._count = motion, name, 0
        left, right, bottom, top = motion.bounds
        self._unit = SIZE / max(right - left, top - bottom)
        self._origin = np.array([left, top])
        self.rows: list[Row] = []
        self.tracks: list[Track] = []
        parts = "".join(map(self._part, motion.parts))
        labels, below = self._labels()
        box = self._box(motion.bounds)
        bottom = max(box[3], below) + 1.3 * LABEL  # with a line for the scale
        whole = f"{box[0]:.0f} {box[1]:.0f} {box[2]:.0f} {bottom:.0f}"
        self.is_wide = box[2] > 1.5 * box[3]
        self.svg = (
            f'<svg class="drawing" viewBox="{whole}" role="img" aria-label="{escaped(words)}">'
            f'<g id="{name}">{parts}</g>{labels}{self._scale_bar(bottom)}</svg>'
        )
        details = "".join(
            f'<figure><svg class="drawing" viewBox="{" ".join(f"{x:.1f}" for x in self._box(b))}">'
            f'<use href="#{name}"/></svg><figcaption>{escaped(of)}</figcaption></figure>'
            for of, b in motion.details
        )
        self.svg += f'<div class="details">{details}</div>' if details else ""
        self._readouts()

    def _box(self, bounds: Any) -> tuple[float, float, float, float]:
        left, right, bottom, top = bounds
        (x, y), (u, v) = (
            self._placed(np.array(corner)) for corner in ((left, top), (right, bottom))
        )
        return float(x), float(y), float(u - x), float(v - y)

    def _placed(self, points: Any) -> Any:
        """Return points (..., 2), m, in units of the drawing, downwards."""
        return (points - self._origin) * (self._unit, -self._unit)

    def _id(self) -> str:
        self._count += 1
        return f"{self._name}-{self._count}"

    def _set(self, ids: Iterable[str], name: str, values: Sequence[str]) -> str:
        """Return an attribute at the first frame, and keep it where it changes."""
        if any(value != values[0] for value in values):
            self.tracks.append(Track(tuple(ids), name, values))
        return f' {name}="{values[0]}"'

    def _part(self, part: Any) -> str:
        if isinstance(part, Body):
            return self._body(part)
        if isinstance(part, Arrow):
            return self._bars(part) if part.is_bars else self._arrow(part)
        return self._belt(part) if part.closed else self._cord(part)

    def _body(self, body: Body) -> str:
        own = self._id()
        x, y = self._placed(np.stack([body.x, body.y], axis=-1)).T
        turns = (-np.degrees(body.angle) % 360.0).tolist()
        places = zip(x.tolist(), y.tolist(), turns, strict=True)
        moves = [f"translate({a:.1f} {b:.1f})rotate({turn:.2f})" for a, b, turn in places]
        attributes = self._set([own], "transform", moves)
        if body.visible is not None:
            seen = ["visible" if each else "hidden" for each in body.visible]
            attributes += self._set([own], "visibility", seen)
        if body.name and not body.label:
            self._row(_sample_of(body.shapes[0]), body.name)
        return f'<g id="{own}"{attributes}>{"".join(map(self._shape, body.shapes))}</g>'

    def _shape(self, shape: Disc | Outline) -> str:
        if isinstance(shape, Disc):
            x, y, r = (self._unit * each for each in (shape.x, -shape.y, shape.radius))
            look = f"line-{shape.role}" if shape.open else f"fill-{shape.role}"
            return f'<circle class="{look}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.2f}"/>'
        path = _path(shape.points * (self._unit, -self._unit), 1)
        look = f"fill-{shape.role}" if shape.closed else f"line-{shape.role}"
        return f'<path class="{look}" d="{path}{"Z" if shape.closed else ""}"/>'

    def _paths(self, line: Line) -> list[str]:
        points = np.broadcast_to(line.points, (len(self._motion.time), *line.points.shape[1:]))
        if len(line.points) == 1:
            return [_path(self._placed(line.points[0]))] * len(points)
        return [_path(each) for each in self._placed(points)]

    def _cord(self, line: Line) -> str:
        own = self._id()
        paths = self._paths(line)
        if line.name:
            values = () if line.size is None else texts(line.size, line.unit)
            self._row(_sample(f"line-{line.role}", "M1 7H25"), line.name, values)
        if line.travel is None:
            return f'<path id="{own}" class="line-{line.role} cord"{self._set([own], "d", paths)}/>'
        marks, gap = self._id(), self._unit * line.spacing - MARK
        attributes = self._set([own, marks], "d", paths)
        offsets = 0.5 * MARK - self._unit * line.travel % (self._unit * line.spacing)
        run = self._set([marks], "stroke-dashoffset", [f"{each:.0f}" for each in offsets])
        return (
            f'<path id="{own}" class="line-{line.role} cord"{attributes}/><path id="{marks}"'
            f' class="marks" stroke-width="{MARK_REACH}" stroke-dasharray="{MARK} {gap:.0f}"'
            f"{attributes}{run}/>"
        )

    def _belt(self, line: Line) -> str:
        edge, marks, plain = self._id(), self._id(), self._id()
        points = self._placed(line.points)
        whole, halves = _words(points), _words(0.5 * (points + np.roll(points, 1, axis=1)))
        ids = [edge, marks, plain] if line.value is None else [edge, marks]
        around = self._set(ids, "d", [f"M{' '.join(frame)}Z" for frame in whole])
        gap = self._unit * line.spacing - MARK
        parts = [
            f'<path id="{marks}" class="marks" stroke-width="{BELT_MARK_REACH}"'
            f' stroke-dasharray="{MARK} {gap:.0f}"{around}/>',
            f'<path id="{edge}" class="belt-edge"{around}/>',
        ]
        if line.patch is not None:
            flags = np.broadcast_to(line.patch, points.shape[:2])
            parts.insert(0, self._pieces(whole, flags, ["patch"]))
            self._row(_sample("patch", "M1 7H25"), "patch with other friction")
        if line.value is None:
            parts.append(
                f'<path id="{plain}" class="belt" style="stroke:var(--role-moving)"{around}/>'
            )
        else:
            low, high = float(line.value.min()), float(line.value.max())
            share = (line.value - low) / ((high - low) or 1.0)
            level = np.minimum((share * len(TENSION_SCALE)).astype(int), len(TENSION_SCALE) - 1)
            for i, colour in enumerate(TENSION_SCALE):
                parts.append(self._pieces(whole, level == i, ["belt"], f"stroke:{colour}"))
            words = f"{low:.4g} to {high:.4g} {unit_text(line.unit)}"
            self._row(_colour_scale(), line.quantity, [words])
        for mode, stuck in STRIPS if line.stuck is not None else ():
            some = np.asarray(line.stuck == stuck)
            if some.any():
                parts.append(self._pieces(halves, some, [f"{mode}-edge", mode], after=1))
                self._row(_sample(f"{mode}-edge", "M1 7H25", mode), BELT_CONTACT[mode][0])
        return "".join(parts)

    def _pieces(
        self, words: list[list[str]], chosen: Any, looks: list[str], style: str = "", after: int = 0
    ) -> str:
        """Return the pieces of a closed line that are chosen, as a path in each of some looks.

        The piece of a point begins at the point before it and ends at it; or with `after`, where
        the points are halfway before those that are chosen, from there to the next.
        """
        paths = []
        for points, flags in zip(words, chosen, strict=True):
            around = [points[-1], *points, points[0]]
            ends = np.flatnonzero(np.diff(np.concatenate([[0], flags, [0]]))).tolist()
            runs = zip(ends[::2], ends[1::2], strict=True)
            paths.append(
                "".join(f"M{' '.join(around[a + after : b + after + 1])}" for a, b in runs)
                or "M0 0"
            )
        ids = [self._id() for _ in looks]
        attribute = f' style="{style}"' if style else ""
        move = self._set(ids, "d", paths)
        pairs = zip(ids, looks, strict=True)
        return "".join(f'<path id="{i}" class="{look}"{attribute}{move}/>' for i, look in pairs)

    def _bars(self, bars: Arrow) -> str:
        own, paths = self._id(), []
        feet = self._placed(bars.foot)
        spans = bars.vector * self._motion.scale * (self._unit, -self._unit)
        for foot, span in zip(np.rint(feet).astype(int), np.rint(spans).astype(int), strict=True):
            some = np.flatnonzero(span.any(axis=1))
            pairs = zip(foot[some].tolist(), span[some].tolist(), strict=True)
            paths.append("".join(f"M{x} {y}l{u} {v}" for (x, y), (u, v) in pairs) or "M0 0")
        largest = bars.size.max(axis=-1)
        values = [f"up to {text}" for text in texts(largest, bars.unit)]
        self._row(_sample(f"line-{bars.role}", "M1 7H25"), bars.name, values)
        return f'<path id="{own}" class="line-{bars.role} bars"{self._set([own], "d", paths)}/>'

    def _arrow(self, arrow: Arrow) -> str:
        own = self._id()
        size = arrow.size
        seen = (size > ROUNDOFF * size.max(initial=0.0))[:, None]
        foot = self._placed(arrow.foot)
        way = np.where(seen, arrow.vector * self._motion.scale * (self._unit, -self._unit), 0.0)
        length = np.linalg.norm(way, axis=-1, keepdims=True)
        along = way / np.maximum(length, np.finfo(float).tiny)
        head = np.minimum(HEAD, 0.6 * length)
        tip, base = foot + way, foot + way - head * along
        across = 0.36 * head * along[:, ::-1] * (-1.0, 1.0)
        corners = np.stack([foot, base, base + across, tip, base - across, base], axis=1)
        paths = [_path(each, 1) for each in corners]
        role = arrow.role
        sample = _sample(f"arrow line-{role} fill-{role}", "M1 7H16M16 3L25 7L16 11Z")
        self._row(sample, arrow.name, texts(np.where(seen[:, 0], size, 0.0), arrow.unit))
        look = f"arrow line-{role} fill-{role}"
        return f'<path id="{own}" class="{look}"{self._set([own], "d", paths)}/>'

    def _labels(self) -> tuple[str, float]:
        """Return the names of bodies below them, and how far down they reach."""
        bodies = [p for p in self._motion.parts if isinstance(p, Body) and p.label]
        labels, below = [], 0.0
        for body in bodies:
            x, y = self._placed(np.array([body.x[0], body.y[0]]))
            radius = max(s.radius for s in body.shapes if isinstance(s, Disc)) * self._unit
            down = y + 1.25 * radius + LABEL
            below = max(below, down + 0.4 * LABEL)
            style = f'x="{x:.0f}" y="{down:.0f}" font-size="{LABEL}" text-anchor="middle"'
            labels.append(f"<text {style}>{escaped(body.name)}</text>")
        return "".join(labels), below

    def _scale_bar(self, bottom: float) -> str:
        """Return a bar of a round length at the lower left."""
        length = bar_below(0.2 * SIZE / self._unit)
        words = f"{study_text(1e3 * length)} mm" if length < 1.0 else f"{study_text(length)} m"
        x, y, reach = 0.01 * SIZE, bottom - 0.012 * SIZE, self._unit * length
        return (
            f'<path class="ruler" d="M{x:.0f} {y - 40:.0f}v40h{reach:.0f}v-40"/>'
            f'<text x="{x + reach + 40:.0f}" y="{y:.0f}" font-size="{LABEL}">{words}</text>'
        )

    def _row(self, sample: Html, name: str, values: Any = ()) -> None:
        if all(row.name != name for row in self.rows):
            self.rows.append(Row(sample, name, values))

    def _readouts(self) -> None:
        for readout in self._motion.readouts:
            self.rows.append(Row(Html(), readout.name, readout.texts))


def _words(points: Any) -> list[list[str]]:
    """Return the points of each frame, (frames, n, 2), as SVG writes them."""
    return [[f"{x} {y}" for x, y in frame] for frame in np.rint(points).astype(int).tolist()]


def _path(points: Any, decimals: int = 0) -> str:
    """Return straight lines through points (n, 2), in units, as SVG writes them."""
    if decimals:
        return "M" + " ".join(f"{each:.{decimals}f}" for each in points.ravel().tolist())
    return "M" + " ".join(map(str, np.rint(points).astype(int).ravel().tolist()))


def _colour_scale() -> Html:
    width = 60.0 / len(TENSION_SCALE)
    bars = "".join(
        f'<rect x="{width * i:.2f}" width="{width + 0.3:.2f}" y="1" height="12" fill="{colour}"/>'
        for i, colour in enumerate(TENSION_SCALE)
    )
    return Html(f'<svg class="sample scale" viewBox="0 0 60 14">{bars}</svg>')


def _sample(look: str, path: str, over: str = "") -> Html:
    """Return a small drawing for the key; `over` looks like this over it."""
    upper = f'<path class="{over}" d="{path}"/>' if over else ""
    return Html(
        f'<svg class="sample" viewBox="0 0 26 14"><path class="{look}" d="{path}"/>{upper}</svg>'
    )


def _sample_of(shape: Disc | Outline) -> Html:
    if not isinstance(shape, Disc):
        return _sample(f"fill-{shape.role}", "M3 2H23V12H3Z")
    circle = "M13 2a5 5 0 1 1 -.01 0Z"
    if not shape.open:
        return _sample(f"fill-{shape.role}", circle)
    return _sample(f"line-{shape.role}", circle)
