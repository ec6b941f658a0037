"""`frictionsim fit`: interprets the options, runs the fit and writes its files."""

from pathlib import Path
from time import monotonic
from typing import Annotated, Any, NamedTuple

import typer

import frictionsim as fs
from frictionsim.cli.app import AsJson, NoClobber, Overrides, ScenarioFile, app
from frictionsim.cli.messages import print_beside_files, print_data, print_error, warn
from frictionsim.cli.sources import load_scenario
from frictionsim.errors import ArgumentError, OutputError, counted

# The option for an argument of `fs.fit` that has another name.
OPTIONS = {"channels": "channel", "quantities": "quantity", "units": "unit"}
SECONDS_BETWEEN_UPDATES = 0.2  # of the status line
BOUNDS = (
    "expected KEY=LOW:HIGH or KEY=LOW:HIGH:START, as effects.shaft_friction.mu_s=0.05:0.4; a free"
    " key needs bounds"
)


@app.command()
def fit(
    scenario: ScenarioFile,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW:HIGH[:START]",
            help="Key to fit, with its bounds; A,B for two of one value.",
        ),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measured data in CSV.", show_default=False)
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[=COLUMN]", help="Channel that was measured over time, and its column."
        ),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE", help="Quantity that was measured; with --over NAME[=COLUMN]."
        ),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=COLUMN", help="Key set by each row of the data; one run per row."
        ),
    ] = None,
    overrides: Overrides = None,
    sigma: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Standard deviation of a channel or quantity, in the unit of the data, or its"
            " column. [the scatter about the fit]",
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=UNIT", help="Unit of the data of a channel, as deg/s or rpm."),
    ] = None,
    time: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="Column of the times. [time, or the first]")
    ] = None,
    time_unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="Unit of the times, as ms. [s]")
    ] = None,
    time_offset: Annotated[
        float, typer.Option(metavar="SECONDS", help="Offset added to the times of the data.")
    ] = 0.0,
    starts: Annotated[
        int, typer.Option(min=1, metavar="N", help="Local searches, from points of a scan.")
    ] = 3,
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Seed of the scan and of the bootstrap.")
    ] = 0,
    bootstrap: Annotated[
        int, typer.Option(min=0, metavar="N", help="Number of bootstrap resamples for intervals.")
    ] = 0,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write the fitted scenario; a new file."
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw data, fit and residuals: .png, .pdf or .svg."),
    ] = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> int:
    """Fit keys of a scenario to measured data, with standard errors."""
    bounds = dict(_bounds(text) for text in free or ())
    options: dict[str, Any] = {
        "quantities": _quantities(quantity or [], bool(over)),
        "over": dict(_pair("over", text, "KEY=COLUMN", _column) for text in over or ()),
        "sigma": dict(_pair("sigma", text, "NAME=VALUE", _value) for text in sigma or ()),
        "units": dict(_pair("unit", text, "NAME=UNIT", str) for text in unit or ()),
        "time_offset": time_offset,
        "starts": starts,
        "seed": seed,
        "bootstrap": bootstrap,
    }
    options |= {} if time is None else {"time": _column(time)}
    options |= {} if time_unit is None else {"time_unit": time_unit}
    channels = dict(map(_name_and_column, channel or ()))
    loaded = load_scenario(scenario, overrides)
    files = _Files(output, plot)
    files.check(no_clobber)
    found = _fitted(loaded, data, channels, bounds, options)
    show = print_beside_files if any(files) else print_data
    show(found.to_json() if as_json else found.summary())
    files.write(found)
    if found.not_identified and not as_json:
        named = ", ".join(found.not_identified)
        keys = counted(len(found.values), "key")
        warn([f"{len(found.not_identified)} of {keys} not identified: {named}"])
    warn(found.warnings if as_json else found.data.warnings)
    if found.status != "done":
        print_error(f"fit {found.status}: {found.reason}; do not trust the estimates")
    return found.exit_code


def _fitted(
    scenario: "fs.Scenario",
    data: Path | None,
    channels: dict[str, str | int],
    free: dict[str, Any],
    options: dict[str, Any],
) -> "fs.Fit":
    """Run the fit, with errors that name the options."""
    from frictionsim.cli.monitor import StatusLine

    shown = 0.0
    with StatusLine() as show:

        def progress(runs: int) -> None:
            nonlocal shown
            if monotonic() - shown > SECONDS_BETWEEN_UPDATES:
                shown = monotonic()
                show(f"{runs} runs")

        try:
            return fs.fit(
                scenario, data=data, channels=channels, free=free, progress=progress, **options
            )
        except ArgumentError as error:
            raise ArgumentError(OPTIONS.get(error.argument, error.argument), error.text) from None


class _Files(NamedTuple):
    """The files to write; None if not wanted."""

    output: Path | None
    plot: Path | None

    def check(self, no_clobber: bool) -> None:
        """Check that the files can be written, before the fit."""
        from frictionsim.io.atomic_write import check_no_clobber
        from frictionsim.io.new_file import check_new
        from frictionsim.io.replaceable import check_apart

        options = ("-o", "--plot")
        given = {option: path for option, path in zip(options, self, strict=True) if path}
        check_apart(given)
        if self.plot is not None:
            from frictionsim.plots.picture_file import check_picture

            if no_clobber:
                check_no_clobber(self.plot)
            check_picture(self.plot)
        if self.output is not None:
            check_new(self.output, "scenario")

    def write(self, found: "fs.Fit") -> None:
        """Write the files; one that cannot be written does not keep the other from it."""
        errors = []
        for path, write in ((self.output, found.save_toml), (self.plot, found.save)):
            if path is not None:
                try:
                    write(path)
                except OutputError as error:
                    errors.append(str(error))
        if errors:
            raise OutputError("\n".join(errors))


def _pair(argument: str, text: str, wanted: str, read: Any) -> tuple[str, Any]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise ArgumentError(argument, f"expected {wanted}, got '{text}'")
    return name, read(value)


def _bounds(text: str) -> tuple[str, tuple[float, ...]]:
    key, _, value = (part.strip() for part in text.partition("="))
    key = ",".join(part.strip() for part in key.split(","))
    try:
        numbers = tuple(float(part) for part in value.split(":"))
    except ValueError:
        numbers = ()
    if not key or len(numbers) not in (2, 3):
        raise ArgumentError("free", f"{BOUNDS}, got '{text}'")
    return key, numbers


def _name_and_column(text: str) -> tuple[str, str | int]:
    name, equals, column = (part.strip() for part in text.partition("="))
    return name, _column(column) if equals else name


def _column(text: str) -> str | int:
    """Return a column: digits are its number, anything else its name."""
    return int(text) if text.isdecimal() else text


def _value(text: str) -> float | str:
    """Return a number, or else the name of a column."""
    try:
        return float(text)
    except ValueError:
        return text


def _quantities(texts: list[str], are_columns: bool) -> dict[str, Any]:
    if are_columns:
        return dict(map(_name_and_column, texts))
    found = {}
    for text in texts:
        name, value = _pair("quantity", text, "NAME=VALUE", _value)
        if isinstance(value, str):
            raise ArgumentError(
                "quantity",
                f"{name}: expected a number, got '{value}'; a column needs --over, whose rows are"
                " runs",
            )
        found[name] = value
    return found
