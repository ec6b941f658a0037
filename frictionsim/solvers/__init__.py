"""Solvers for mechanisms of one coordinate, and of several coordinates and contacts."""

from typing import Any

from frictionsim.scenario import methods


def solver_of(law: str, method: str, system: Any, *others: Any) -> Any:
    """Return the solver for a friction law and a method.

    Parameters
    ----------
    law : str
        A name in `frictionsim.scenario.methods`; empty without dry friction.
    method : str
    system, others
        The arguments of `events.Events`.

    Returns
    -------
    Events or Law
        With `run(on_step)` and `state`.
    """
    from frictionsim.solvers.events import Events
    from frictionsim.solvers.laws import Published, Regularised, SetValued

    kind: Any = {methods.REGULARISED: Regularised, methods.PUBLISHED: Published}.get(law, SetValued)
    if method == "events" or not law:
        kind = Events
    integrator = methods.METHODS[method].scipy_class
    if not integrator:
        return kind(system, *others)
    # Imported here because SciPy takes 0.3 s to import.
    from frictionsim.solvers.scipy_methods import ScipyStep

    return kind(system, *others, ScipyStep(integrator))
