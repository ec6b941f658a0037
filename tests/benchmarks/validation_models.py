"""The models of a belt that are held to closed forms, and how a scenario is run with each."""

from typing import NamedTuple

from frictionsim.errors import InputError
from frictionsim.results import Record
from frictionsim.scenario.model_validation import ValidationFailure
from tests.benchmarks.results_common import WARM_UP_FRACTION, say, solve


class Model(NamedTuple):
    """A model of the belt: what chooses it in a scenario."""

    name: str
    overrides: tuple[str, ...]
    without: tuple[str, ...] = ()  # effects that it does without
    guided: bool = False  # it has no motion across the belt


POLYGON = Model("polygon", ("mechanism.belt.wrap=polygon",))
CORRECTED = Model("corrected", ("mechanism.belt.wrap=corrected",))
STRING = Model("string", (), ("contact", "bending", "gravity"), guided=True)
MODELS = (POLYGON, CORRECTED, STRING)
REFUSED: list[str] = []  # what a part leaves out, and why


def run(
    model: Model,
    bodies: int,
    *overrides: str,
    base: str = "belt_drive",
    without: tuple[str, ...] = (),
) -> Record | None:
    """Run a shipped scenario with a model, compiled before; None if it is refused or fails."""
    settings = ("solver.backend=moreau", f"mechanism.belt.bodies={bodies}", *model.overrides)
    kept = [key for key in overrides if not (model.guided and key.startswith("effects.contact"))]
    left = tuple({*without, *model.without})
    say(f"  {model.name}, {bodies} bodies")
    try:
        solve(base, *settings, *kept, *WARM_UP_FRACTION, without=left)
        done = solve(base, *settings, *kept, without=left)
    except ValidationFailure as error:
        return _left_out(model.name, "; ".join(error.lines()))
    except InputError as error:
        return _left_out(f"{model.name}, {bodies} bodies", str(error))
    if done.status != "done":
        return _left_out(f"{model.name}, {bodies} bodies", done.reason)
    return done


def _left_out(what: str, reason: str) -> None:
    say(f"  left out: {reason}")
    REFUSED.append(f"Left out: {what} ({' '.join(reason.split())}).")
