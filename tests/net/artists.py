"""What views draw, artist by artist, and coarse frames of animations."""

import json
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from PIL import Image, ImageSequence

import frictionsim as fs
from tests.net.digests import digest

BLOCKS = 8  # of a coarse frame, each way
# A view of any kind but its own is refused, and how is part of what a commit does.
VIEWS = {
    "pulley": ("response", "traction", "mechanism"),
    "marble_machine": ("response", "torque", "mechanism"),
    "epicyclic": ("response", "torque", "path"),
    "shaft": ("response", "friction_circle"),
    "belt_drive": ("speeds", "drive", "tension", "body"),
}


def of_file(path: Path, shown: str) -> Iterator[tuple[str, Any]]:
    """Yield what the views of a result or sweep draw, by their names, and its motion.

    `shown` is what `frictionsim show --json` prints of the file.
    """
    yield "?", _drawn(partial(_view, path, "?"))
    for view in views(shown):
        yield view, _drawn(partial(_view, path, view))
    yield "motion", _drawn(partial(_frames, path))


def views(shown: str) -> list[str]:
    """Return the views of a result, or of a sweep, which are its quantities."""
    if not shown.startswith("{"):  # a damaged file
        return []
    document = json.loads(shown)
    return list(document["quantities"] if "varied" in document else VIEWS.get(document["kind"], ()))


def _drawn(draw: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return the drawn content and warnings, or the reason for a refusal."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            content = draw()
        except Exception as error:  # a defect is what a commit does, too
            content = {"refused": f"{type(error).__name__}: {error}"}
    return content | {"warned": sorted({str(warning.message) for warning in told})}


def _view(path: Path, view: str) -> dict[str, Any]:
    figure = fs.plot(path, view)
    texts: list[Any] = figure.findobj(lambda one: hasattr(one, "get_text") and one.get_visible())
    content: dict[str, Any] = {
        "size": digest(figure.get_size_inches()),
        "texts": sorted({text.get_text() for text in texts}),
    }
    for number, axes in enumerate(figure.get_axes()):
        here = {"limits": digest([*axes.get_xlim(), *axes.get_ylim()]), "scale": axes.get_xscale()}
        for kind in ("lines", "collections", "patches", "images"):
            for i, artist in enumerate(getattr(axes, kind)):
                here[f"{kind}[{i}]"] = ARRAYS[kind](artist) | {"label": str(artist.get_label())}
        content[f"axes {number}"] = here
    return content


def _of_line(line: Any) -> dict[str, Any]:
    look = [to_hex(line.get_color()), line.get_linestyle(), str(line.get_marker())]
    return {"look": look, "xy": digest(np.asarray(line.get_xydata(), dtype=float))}


def _of_collection(collection: Any) -> dict[str, Any]:
    vertices = [path.vertices for path in collection.get_paths()]
    return {
        "colours": digest([to_hex(colour, True) for colour in collection.get_facecolor()]),
        "offsets": digest(np.ma.filled(collection.get_offsets(), np.nan)),
        "vertices": digest(np.concatenate(vertices)) if vertices else None,
        "values": _values(collection),
    }


def _of_patch(patch: Any) -> dict[str, Any]:
    look = [to_hex(patch.get_facecolor(), True), to_hex(patch.get_edgecolor())]
    path = patch.get_patch_transform().transform_path(patch.get_path())
    return {"look": look, "vertices": digest(path.vertices)}


def _of_image(image: Any) -> dict[str, Any]:
    return {"values": _values(image), "extent": digest(image.get_extent())}


def _values(artist: Any) -> Any:
    values = artist.get_array()
    return None if values is None else digest(np.ma.filled(np.ma.asarray(values, float), np.nan))


ARRAYS = {
    "lines": _of_line,
    "collections": _of_collection,
    "patches": _of_patch,
    "images": _of_image,
}


def _frames(path: Path) -> dict[str, Any]:
    """Return the frames of an animation, each as the mean greys of some blocks."""
    speed = float(fs.open(path).dataset["time"].to_numpy()[-1])  # a second in all
    with Image.open(fs.animate(path, path.with_suffix(".gif"), fps=5, speed=speed)) as image:
        greys = [
            np.asarray(frame.convert("L").resize((BLOCKS, BLOCKS), Image.Resampling.BOX))
            for frame in ImageSequence.Iterator(image)
        ]
        return {"size": str(image.size), "frames": [digest(grey) for grey in greys]}
