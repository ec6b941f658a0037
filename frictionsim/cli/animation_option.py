"""`frictionsim plot --animate`: the mechanism of a result in motion."""

from pathlib import Path

import frictionsim as fs
from frictionsim.cli.messages import print_beside_files
from frictionsim.cli.status_line import StatusLine
from frictionsim.errors import InputError


def animate(
    results: list[Path],
    animation: Path,
    fps: float | None,
    speed: float | None,
    *,
    no_clobber: bool,
    as_json: bool,
) -> None:
    """Write an animation, with its progress on a terminal.

    Raises
    ------
    InputError
        If there are several results, or it is not valid.
    """
    if len(results) > 1:
        raise InputError(
            f"--animate shows one result, got {len(results)}; 'frictionsim report' shows several"
            " moving side by side"
        )
    result = results[0]
    with StatusLine() as line:
        fs.animate(
            result,
            animation,
            fps=fps,
            speed=speed,
            no_clobber=no_clobber,
            progress=lambda done, count: line(f"frame {done} of {count}"),
        )
    if as_json:
        print_beside_files({"result": str(result), "pictures": [str(animation)], "skipped": []})
    else:
        print_beside_files(str(animation))


def check_options(animate: Path | None, others: dict[str, object]) -> None:
    """Check that options of animations come with --animate, and those of pictures without it.

    Parameters
    ----------
    animate : Path or None
    others : dict
        By option its value, None if it is not given.

    Raises
    ------
    InputError
    """
    given = [name for name, value in others.items() if value is not None]
    if animate is None:
        wrong = [name for name in given if name in ("--fps", "--speed")]
        if wrong:
            raise InputError(f"{wrong[0]} is for an animation: give --animate FILE.gif as well")
        return
    wrong = [name for name in given if name not in ("--fps", "--speed")]
    if wrong:
        raise InputError(
            f"{wrong[0]} is for a picture and --animate for an animation: give one of them"
        )
