"""`frictionsim plot`: pictures of results and sweeps."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import frictionsim as fs
from frictionsim.cli.app import AsJson, NoClobber, app, named_by_option
from frictionsim.cli.completion import styles, views
from frictionsim.cli.messages import log_on_stderr, print_beside_files, print_error
from frictionsim.cli.monitor import EndingSignals, StatusLine
from frictionsim.errors import ArgumentError

if TYPE_CHECKING:
    from frictionsim.api.pictures import PlotOptions


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
            help="screen or paper. [screen]",
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
    """Draw views of a result or sweep. Named views are written to FILE-<view>.png."""
    log_on_stderr(0)
    with (
        named_by_option({"window": "from and --to", "title": "no-title"}),
        EndingSignals("files already written are kept", activity="drawing"),
    ):
        from frictionsim.api.pictures import PlotOptions, SavedPictures, save_pictures

        options = PlotOptions.among(locals(), window=(start, stop), title=not no_title)
        if animate is None:
            done = save_pictures(result, output, options, no_clobber=no_clobber)
        else:
            if output is not None:
                raise ArgumentError("output", "it does not apply to an animation")
            options.check_for("an animation")
            if len(result) > 1:
                raise ArgumentError(
                    "animate",
                    f"expected one result, got {len(result)}; 'frictionsim report'"
                    " shows several moving side by side",
                )
            done = SavedPictures([_animated(result[0], animate, options, no_clobber)], [])
    pictures = list(map(str, done.pictures))
    if as_json:
        named = str(result[0]) if len(result) == 1 else list(map(str, result))
        print_beside_files({"result": named, "pictures": pictures, "skipped": done.skipped})
    else:
        print_beside_files("\n".join(pictures))
        for reason in done.skipped:
            print_error(f"view skipped: {reason}")


def _animated(result: Path, path: Path, options: "PlotOptions", no_clobber: bool) -> Path:
    """Write an animation, with its progress on a terminal."""
    with StatusLine() as line:
        return fs.animate(
            result,
            path,
            fps=options.fps,
            speed=options.speed,
            no_clobber=no_clobber,
            progress=lambda done, count: line(f"frame {done} of {count}"),
        )
