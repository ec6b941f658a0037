"""The command that compiles kernels ahead of their use."""

from typing import Annotated

import typer

from frictionsim.cli.app import Quiet, app
from frictionsim.cli.messages import print_beside_files
from frictionsim.cli.monitor import monitor_run


@app.command("warm-up")
def warm_up(
    kind: Annotated[
        str | None,
        typer.Argument(help="Kind of mechanism. [all that have kernels]", show_default=False),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Compile the kernels of the shipped scenarios ahead of their use, for containers and CI."""
    from frictionsim.api.warming import warming

    total, found = 0.0, False
    with monitor_run(1.0, with_progress=False, quiet=True) as monitor:
        for scenario, backend, seconds in warming(kind, monitor):
            total, found = total + seconds, True
            if not quiet:
                took = f"compiled in {seconds:.1f} s" if seconds else "compiled already"
                print_beside_files(f"{scenario}, {backend}: {took}")
    if not quiet:
        print_beside_files(f"{total:.1f} s of compilation" if found else "no kernels to compile")
