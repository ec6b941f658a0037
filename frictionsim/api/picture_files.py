"""Pictures of results and sweeps in files, as `frictionsim plot` writes them."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.api import result as results
from frictionsim.api.pictures import (
    check_no_body,
    check_no_choice,
    check_of_sweep,
    overlaid,
)
from frictionsim.api.sweep_result import Sweep, quantities_of, result_or_sweep
from frictionsim.errors import InputError
from frictionsim.io.atomic_write import check_no_clobber
from frictionsim.io.replaceable import check_apart

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from frictionsim.io.sweep_table import SweepTable
    from frictionsim.plots.appearance import Appearance
    from frictionsim.plots.window import Extent

    Drawings = dict[Path, Callable[[], Figure]]

FIRST: tuple[None] = (None,)  # where no view is named


class Choice(NamedTuple):
    """What of files is drawn.

    Attributes
    ----------
    views : sequence of str
        Views of a result, also several in a text with commas; of a sweep quantities, one picture
        for each text. "all" is each view or quantity.
    body : int or None
        As of `plot`.
    at : mapping
        As of `plot`.
    """

    views: Sequence[str] = ()
    body: int | None = None
    at: Mapping[str, Any] = {}


class Saved(NamedTuple):
    """What was written.

    Attributes
    ----------
    pictures : list of Path
    skipped : list of str
        The reasons why views, of all that there are, were not drawn.
    warnings : list of str
        On characters that the fonts lack.
    """

    pictures: list[Path]
    skipped: list[str]
    warnings: list[str]


def save_pictures(
    files: Sequence[Path],
    path: Path | None,
    choice: Choice,
    look: "Appearance",
    shown: "Extent",
    *,
    no_clobber: bool = False,
) -> Saved:
    """Draw what files hold, the result of a run, a sweep, or several results, into pictures.

    Parameters
    ----------
    files : sequence of Path
    path : Path or None
        Ends in .png, .pdf or .svg. Of several views each is written to FILE-<view>.png; without a
        path also one that is named.
    choice : Choice
    look : Appearance
    shown : Extent
    no_clobber : bool
        Do not replace existing files.

    Raises
    ------
    InputError
        If nothing can be drawn, or two pictures would be one file.
    OutputError
        If a picture cannot be written.
    """
    from frictionsim.plots.picture_file import check_format

    if path is not None:
        check_format(path)
    found = [(str(file), result_or_sweep(file)) for file in files]
    place = _Place(path or _default(files), path is not None, no_clobber)
    (_, first), *others = found
    if others:
        check_no_choice(choice.at)
        check_no_body(choice.body, "these are several")
        return _save_overlays(overlaid(found), place, choice, look, shown)
    if isinstance(first, Sweep):
        check_of_sweep(choice.body, shown)
        return _save_sweep(first.table, place, choice, look)
    check_no_choice(choice.at)
    return _save_views(first, place, choice, look, shown)


def _default(files: Sequence[Path]) -> Path:
    """Return the picture of some files: FILE.png, or both names, or how many there are more."""
    first, others = files[0], files[1:]
    if not others:
        return first.with_suffix(".png")
    second = others[0].stem if len(others) == 1 else f"and-{len(others)}-more"
    return first.with_name(f"{first.stem}-{second}.png")


class _Place(NamedTuple):
    """Where pictures are written to: `path`, which the user has `named` or not."""

    path: Path
    named: bool
    no_clobber: bool

    def of(self, views: Sequence[str]) -> list[Path]:
        """Return the file of each view; without views that of the first.

        Raises
        ------
        InputError
            If two are the same.
        OutputError
            If one cannot be written.
        """
        from frictionsim.plots import path_of

        if not views or (len(views) == 1 and self.named):
            paths = [self.path]
        else:
            names = [view.replace(",", "+").replace(" ", "") for view in views]
            check_apart(
                {
                    f"--view {view} (number {number})": path_of(self.path, name)
                    for number, (view, name) in enumerate(zip(views, names, strict=True), 1)
                }
            )
            paths = [path_of(self.path, name) for name in names]
        self.check(paths)
        return paths

    def check(self, paths: Sequence[Path]) -> None:
        """Check that files can be written."""
        from frictionsim.plots.picture_file import check_picture

        for path in paths:
            if self.no_clobber:
                check_no_clobber(path)
            check_picture(path)


def _views(choice: Choice) -> list[str]:
    """Return the views that are named, each once in a list; "all" stands alone."""
    from frictionsim.plots import ALL

    views = [name.strip() for text in choice.views for name in text.split(",")]
    if ALL in views and len(views) > 1:
        raise InputError(f"expected '--view {ALL}' alone, got it beside other views")
    return views


def _save_views(
    result: results.Result, place: _Place, choice: Choice, look: "Appearance", shown: "Extent"
) -> Saved:
    from frictionsim.plots import (
        ALL,
        check_applies,
        check_view,
        draw,
        path_of,
        plot_all,
        views_of,
    )

    views, body = _views(choice), choice.body
    known = views_of(result.kind)
    if views == [ALL]:
        place.check([path_of(place.path, name) for name in known])
        written, reasons = plot_all(result.record, place.path, body, look, shown)
        return Saved(list(written), reasons, _faults(written.values()))
    for view in views:
        check_view(result.kind, view)
        check_applies(result.kind, view, shown)
    return _save(
        {
            path: _drawing(draw, result.record, view, body, None, None, look, shown)
            for path, view in zip(place.of(views), views or FIRST, strict=True)
        },
        look,
    )


def _save_overlays(
    found: Any, place: _Place, choice: Choice, look: "Appearance", shown: "Extent"
) -> Saved:
    from frictionsim.plots import ALL, check_overlaid, draw_overlay, views_of_overlay
    from frictionsim.plots.overlay import check_overlay

    views = _views(choice)
    kind = found[0].record.attributes["kind"]
    check_overlay(found)
    if views == [ALL]:
        views = views_of_overlay(kind)
    for view in views:
        check_overlaid(kind, view)
    return _save(
        {
            path: _drawing(draw_overlay, found, view, None, look, shown)
            for path, view in zip(place.of(views), views or FIRST, strict=True)
        },
        look,
    )


def _save_sweep(table: "SweepTable", place: _Place, choice: Choice, look: "Appearance") -> Saved:
    from frictionsim.parameter_study.statistics import is_defined
    from frictionsim.plots import ALL, path_of
    from frictionsim.plots.sweep import draw_sweep

    views, reasons = list(choice.views), list[str]()
    if ALL in views:
        if len(views) > 1:
            raise InputError(f"expected '--view {ALL}' alone, got it beside other views")
        views = [name for name in table.values if is_defined(table, name)]
        reasons = [
            f"{name} is not defined in any run" for name in table.values if name not in views
        ]
        paths = [path_of(place.path, name) for name in views]
        place.check(paths)
    else:
        paths = place.of(views)
    drawings = {
        path: _drawing(draw_sweep, table, quantities_of(view), choice.at, None, None, look)
        for path, view in zip(paths, views or FIRST, strict=True)
    }
    return _save(drawings, look)._replace(skipped=reasons)


def _drawing(draw: Any, *arguments: Any) -> "Callable[[], Figure]":
    return lambda: draw(*arguments)


def _save(drawings: "Drawings", look: "Appearance") -> Saved:
    from frictionsim.plots.picture_file import save

    drawn = []
    for path, draw in drawings.items():
        drawn.append(draw())
        save(drawn[-1], path, look.dots_per_inch)
    return Saved(list(drawings), [], _faults(drawn))


def _faults(drawn: Any) -> list[str]:
    """Return what there is to say of the characters of pictures, each sentence once."""
    return list(dict.fromkeys(fault for figure in drawn for fault in figure.faults))
