"""Animations of results from Python."""

from collections.abc import Callable
from os import PathLike
from pathlib import Path

from frictionsim.api import result as results
from frictionsim.api.arguments import as_path
from frictionsim.io.atomic_write import check_no_clobber


def animate(
    source: "results.Result | str | PathLike[str]",
    path: str | PathLike[str],
    *,
    fps: float | None = None,
    speed: float | None = None,
    no_clobber: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the mechanism of a result in motion, as `frictionsim plot --animate` does.

    Parameters
    ----------
    source : Result or path
        The result of a run.
    path : path
        Of the animation; it ends in .gif or .mp4, which needs the program ffmpeg.
    fps : float, optional
        Frames per second: 20 of a GIF, 30 of MP4.
    speed : float, optional
        Simulated seconds per second; by default the whole run takes 8 s.
    no_clobber : bool
        Do not replace an existing file.
    progress : callable, optional
        Is told the number of frames that are drawn, and of all.

    Returns
    -------
    Path
        The animation.

    Raises
    ------
    InputError
        If there is nothing to show, or no ffmpeg for MP4.
    OutputError
        If the file cannot be written, or would replace another kind of file.
    """
    from frictionsim.plots import animation

    target = as_path("animate", path)
    if no_clobber:
        check_no_clobber(target)
    animation.check_animation(target)
    if not isinstance(source, results.Result):
        source = results.open(as_path("result", source))
    animation.animate(source.record, target, fps, speed, progress, str(source.path or ""))
    return target
