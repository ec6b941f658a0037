"""What is logged of a run at its start and its end."""

import logging
from typing import TYPE_CHECKING

from frictionsim.results import MODES

if TYPE_CHECKING:
    from frictionsim.results import Record
    from frictionsim.scenario.settings import Scenario

LOG = logging.getLogger(__name__)


def log_scenario(scenario: "Scenario") -> None:
    """Log what is simulated, and how."""
    solver = scenario.solver
    LOG.info(
        "scenario %s: kind %s, effects %s, law %s, backend %s",
        scenario.origin.source or scenario.title or scenario.kind,
        scenario.kind,
        ", ".join(scenario.effect_names) or "none",
        scenario.law or "none",
        solver.backend,
    )
    for override in scenario.origin.overrides:
        LOG.debug("overridden: %s", override)
    LOG.debug("limit: %d steps", solver.max_steps)


def log_end(run: "Record") -> None:
    """Log how a run ended."""
    if LOG.isEnabledFor(logging.DEBUG):
        modes = dict(MODES)
        for e in run.transitions:
            before, after = modes[e.mode_from], modes[e.mode_to]
            LOG.debug("event at t = %.9g s: %s from %s to %s", e.time, e.contact, before, after)
        for name, check in run.checks.items():
            LOG.debug("audit %s: %.3g, limit %.3g", name, check.value, check.limit)
    statistics = run.statistics
    assert statistics is not None, "a run that was just solved has them"
    LOG.info(
        "run %s at t = %.9g s: samples %d, events %d, steps %d, rejected %d, wall time %.3g s",
        run.status,
        run.time[-1] if run.time.size else 0.0,
        run.time.size,
        len(run.transitions),
        statistics.steps,
        statistics.rejected,
        statistics.wall_seconds or 0.0,
    )
