"""`frictionsim plot`: pictures of results and sweeps."""

from pathlib import Path
from typing import Annotated

import typer

from frictionsim.cli.app import AsJson, NoClobber, ResultFile, app
from frictionsim.cli.completion import views
from frictionsim.cli.messages import print_beside_files, print_error
from frictionsim.errors import InputError


@app.command()
def plot(
    result: ResultFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Picture: .png, .pdf or .svg. [RESULT.png]"
        ),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(
            "--view",
            metavar="NAME",
            help="View to draw, or 'all'; of a sweep quantities. [the first]",
            autocompletion=views,
        ),
    ] = None,
    body: Annotated[
        int | None,
        typer.Option("--body", metavar="N", help="Number of the body for the view 'body'."),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            "--at", metavar="KEY=VALUE", help="The one value of a varied key of a sweep to draw."
        ),
    ] = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> None:
    """Draw a view of a result, or a sweep; --view all draws each into FILE-<view>.png."""
    from frictionsim.api.pictures import save_pictures

    pictures, reasons = save_pictures(
        result,
        output,
        view,
        body,
        at=_values_by_key(at or []),
        no_clobber=no_clobber,
    )
    if as_json:
        print_beside_files(
            {"result": str(result), "pictures": list(map(str, pictures)), "skipped": reasons}
        )
        return
    print_beside_files("\n".join(map(str, pictures)))
    for reason in reasons:
        print_error(f"view skipped: {reason}")


def _values_by_key(given: list[str]) -> dict[str, str]:
    """Return the values that --at gives.

    Raises
    ------
    InputError
        If one is not KEY=VALUE, or a key has two.
    """
    found: dict[str, str] = {}
    for text in given:
        key, equals, value = text.partition("=")
        if not equals or not key.strip() or not value.strip():
            raise InputError(f"--at {text}: expected KEY=VALUE, as mechanism.load=2000")
        if key.strip() in found:
            raise InputError(f"--at {text}: this key has a value already; give one for each key")
        found[key.strip()] = value.strip()
    return found
