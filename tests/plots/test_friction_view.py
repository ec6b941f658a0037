"""The view `friction`: over the moment of all else, and over the speed with its law."""

from math import atan, sin

import numpy as np
import pytest
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.errors import InputError
from tests.support.records import draw, shown, with_scenario
from tests.support.scenarios import shipped, simulate

R_S, R_K = (0.0254 * sin(atan(mu)) for mu in (0.2, 0.1))


def lines(figure: Figure, panel: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the points of the lines of a panel, by their words in the legend."""
    return {
        str(line.get_label()): (np.asarray(line.get_xdata()), np.asarray(line.get_ydata()))
        for line in figure.axes[panel].lines
    }


def test_friction_rises_with_the_moment_and_drops_to_the_kinetic_limit() -> None:
    figure = draw(shown("pulley"), "friction")
    moment, size = lines(figure, 0)["run"]
    peak = int(np.flatnonzero(size == np.nanmax(size))[-1])
    # At breakaway (P - W) r_e = r_s (P + W), with P = W (r_e + r_s)/(r_e - r_s).
    limit = 2.0 * 2224.1 * 0.0508 * R_S / (0.0508 - R_S)
    assert (moment[peak], size[peak]) == pytest.approx((limit, limit), rel=1e-9)
    assert moment[peak + 1] == pytest.approx(limit, rel=1e-9)  # drops where it is
    assert size[peak + 1] == pytest.approx(limit * R_K / R_S, rel=1e-9)
    assert size[:peak] == pytest.approx(moment[:peak], abs=1e-9)  # it holds what acts
    assert size == pytest.approx(np.minimum(size, lines(figure, 0)["static limit"][1]), rel=1e-12)
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    dashes = dict(zip(words, [h.get_linestyle() for h in legend.get_lines()], strict=True))
    assert (dashes["law set-valued"], dashes["static limit"]) == ("-", "--")
    law, run = figure.axes[1].lines
    assert law.get_color() == "#000000"  # as no run is drawn, and below the run of this law
    assert law.get_linewidth() < run.get_linewidth()
    speed, part = lines(figure, 1)["law set-valued"]
    assert set(np.round(part[speed > 0.0], 12)) == {round(-R_K / R_S, 12)}
    assert sorted(part[speed == 0.0])[:: len(part[speed == 0.0]) - 1] == [-1.0, 1.0]


def test_the_run_lies_on_the_curve_of_its_law() -> None:
    changes = {"effects__shaft_friction__law": "regularised", "solver__backend": "bdf"}
    speed_changes = {"effects__shaft_friction__transition_speed": 0.5}
    figure = draw(shown("pulley_return", **changes, **speed_changes), "friction")
    (v, part), (speed, shown_part) = lines(figure, 1).values()
    # Between points of the curve, which are 0.0025 rad/s apart where it bends.
    assert shown_part == pytest.approx(np.interp(speed, v, part), abs=2e-4)


def test_a_gear_has_the_moment_of_its_equation() -> None:
    record = shown("epicyclic")
    moment, _ = lines(draw(record, "friction"), 0)["run"]
    inertia = fs.static("epicyclic")["inertia"].value
    assert inertia is not None
    a, T = record.channels["angular_acceleration"], record.channels["friction_torque"]
    of_samples = np.abs(inertia * a - T)
    assert np.isin(np.round(of_samples, 9), np.round(moment, 9)).mean() > 0.99  # at other events


def test_a_constant_normal_load_leaves_the_moment_of_couples_alone() -> None:
    data = shipped("stick_slip", effects__gravity=None, effects__shaft_friction__normal_load=20.0)
    record = simulate(data)
    spring, (couple,) = data["effects"]["torsion_spring"], data["couples"]
    of = record.channels
    assert not of["shaft_reaction"].any()
    pull = np.interp(record.time, couple["size"]["time"], couple["size"]["value"])
    of_samples = np.abs(pull - spring["stiffness"] * of["angle"])
    moment, _ = lines(draw(record, "friction"), 0)["run"]
    nearest = np.abs(moment[:, None] - of_samples).min(axis=0)
    assert nearest == pytest.approx(0.0 * nearest, abs=1e-9 * of_samples.max())  # rounding


@pytest.mark.parametrize("view", ["response", "friction", "mechanism"])
def test_a_journal_that_was_edited_is_refused_by_its_faults(view: str) -> None:
    record = shown("pulley")
    edited = with_scenario(record, record.attributes["scenario"].replace("mu_s", "mu_x"))
    with pytest.raises(InputError, match=r"is not valid: .*shaft_friction\.mu_x: unknown"):
        draw(edited, view)


def test_without_dry_friction_there_is_nothing_to_draw() -> None:
    frictionless = fs.solve("pulley", {"effects.shaft_friction": None, "solver.duration": 0.1})
    with pytest.raises(InputError, match="friction_torque"):
        frictionless.plot("friction")
