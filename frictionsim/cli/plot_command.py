"""`frictionsim plot`: pictures of results and sweeps."""

from pathlib import Path
from typing import Annotated

import typer

import frictionsim as fs
from frictionsim.cli.app import AsJson, NoClobber, app
from frictionsim.cli.completion import styles, views
from frictionsim.cli.messages import print_beside_files, print_error
from frictionsim.cli.monitor import StatusLine
from frictionsim.errors import InputError


def write_animation(
    results: list[Path],
    animation: Path,
    fps: float | None,
    speed: float | None,
    *,
    no_clobber: bool,
    as_json: bool,
) -> None:
    """Write an animation, with its progress on a terminal."""
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


@app.command()
def plot(
    result: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT",
            help="Result or sweep in HDF5; several results are drawn over each other.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Picture: .png, .pdf or .svg. [RESULT.png]"
        ),
    ] = None,
    view: Annotated[
        list[str] | None,
        typer.Option(
            "--view",
            metavar="NAME",
            help="View to draw, or 'all'; for a sweep: quantities. [the first]",
            autocompletion=views,
        ),
    ] = None,
    body: Annotated[
        int | None,
        typer.Option("--body", metavar="N", help="Number of the body for the view 'body'."),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="KEY=VALUE", help="Value to draw of a varied key of a sweep."),
    ] = None,
    time: Annotated[
        float | None,
        typer.Option(
            "--time", metavar="SECONDS", help="Time of the instant to draw. [last sample]"
        ),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option("--from", metavar="SECONDS", help="Start of the time window."),
    ] = None,
    stop: Annotated[
        float | None, typer.Option("--to", metavar="SECONDS", help="End of the time window.")
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(metavar="NAME,NAME", help="Channels to plot over time. [default of the kind]"),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Width of the picture in mm, cm, in or pt: 84mm."),
    ] = None,
    height: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Height of the picture. [that of the view]"),
    ] = None,
    dpi: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Dots per inch of a PNG. [100]")
    ] = None,
    style: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="paper, talk, or user for your matplotlibrc.",
            autocompletion=styles,
        ),
    ] = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            "--animate",
            metavar="FILE",
            help="Write an animation (.gif or .mp4) instead of a picture.",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="N", help="Frames per second. [20 of .gif, 30 of .mp4]"),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed", metavar="X", help="Simulated seconds per second. [the run takes 8 s]"
        ),
    ] = None,
    no_title: Annotated[bool, typer.Option("--no-title", help="Leave out the title.")] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> None:
    """Draw views of a result or sweep; named views are written to FILE-<view>.png."""
    of_pictures: dict[str, object] = {
        "--output": output,
        "--view": view,
        "--body": body,
        "--at": at,
        "--time": time,
        "--from": start,
        "--to": stop,
        "--channels": channels,
        "--width": width,
        "--height": height,
        "--dpi": dpi,
        "--style": style,
        "--no-title": no_title or None,
    }
    check_options(animate, of_pictures | {"--fps": fps, "--speed": speed})
    if animate is not None:
        write_animation(result, animate, fps, speed, no_clobber=no_clobber, as_json=as_json)
        return
    from frictionsim.api.pictures import ViewSelection, save_pictures
    from frictionsim.plots.style import appearance
    from frictionsim.plots.view import extent

    done = save_pictures(
        result,
        output,
        ViewSelection(view or [], body, _values_by_key(at or [])),
        appearance(width, height, dpi, not no_title, style),
        extent(time, (start, stop), channels),
        no_clobber=no_clobber,
    )
    pictures = list(map(str, done.pictures))
    if as_json:
        named = str(result[0]) if len(result) == 1 else list(map(str, result))
        print_beside_files({"result": named, "pictures": pictures, "skipped": done.skipped})
    else:
        print_beside_files("\n".join(pictures))
        for reason in done.skipped:
            print_error(f"view skipped: {reason}")


def _values_by_key(given: list[str]) -> dict[str, str]:
    """Return the values given with --at, by key."""
    found: dict[str, str] = {}
    for text in given:
        key, equals, value = text.partition("=")
        if not equals or not key.strip() or not value.strip():
            raise InputError(f"--at {text}: expected KEY=VALUE, e.g. mechanism.load=2000")
        if key.strip() in found:
            raise InputError(f"--at {text}: this key is given twice; give one value per key")
        found[key.strip()] = value.strip()
    return found
