"""The picture of a friction circle, against separate complex arithmetic, and vanishing forces."""

import tomllib
from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Polygon

from frictionsim.errors import InputError
from frictionsim.results import Record
from tests.plots.test_paper import check_texts
from tests.support import motions
from tests.support.cases import one_in, slow
from tests.support.records import draw, shown, with_channels, without
from tests.support.scenarios import shipped
from tests.support.shaft_forces import TIMES, acting, couples, drawn_motion, drawn_shaft, moment

VIEW = "friction_circle"
DRAWN = range(4)
MARKED = "#0072B2"  # the colour of what the eye follows in other drawings


def made(data: Any, channels: Any) -> Record:
    record = motions.record_of("shaft", channels, data)
    return record._replace(attributes=record.attributes | {"backend": "events"})


def drawn(number: int) -> Record:
    return made(drawn_shaft(number), drawn_motion(number))


def arrows(ax: Any) -> dict[str, tuple[complex, complex]]:
    """Return tail and way of each straight arrow in a drawing, as complex numbers."""
    vectors = {}
    for patch in ax.patches:
        if isinstance(patch, FancyArrowPatch) and patch._posA_posB is not None:
            tail, tip = (complex(*place) for place in patch._posA_posB)
            vectors[patch.get_label()] = tail, tip - tail
    return vectors


def key_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def value_of(text: str) -> float:
    """Return the first number in a text."""
    word = next(w for w in text.replace("\N{MINUS SIGN}", "-").split() if w[-1].isdigit())
    return float(word)


def crank() -> Record:
    return shown("shaft", solver__rtol=1e-6, solver__duration=0.9, output__interval=0.05)


@pytest.mark.parametrize("number", one_in(2, DRAWN))
@pytest.mark.parametrize("sample", [0, 13])
def test_arrows_act_where_the_forces_do_balance_and_have_their_moments(
    number: int, sample: int
) -> None:
    data, channels = drawn_shaft(number), drawn_motion(number)
    figure = draw(drawn(number), VIEW, time=float(TIMES[sample]))
    whole, enlarged = figure.axes
    vectors, wanted = arrows(whole), acting(data, channels)
    scale = abs(vectors["weight of the body"][1]) / (8.0 * 9.81)
    for name, (place, force) in wanted.items():
        if name not in vectors:  # too short to be seen
            assert abs(scale * force[sample]) < 0.05
            continue
        assert vectors[name][1] == pytest.approx(scale * force[sample]), name
        if name != "cord":
            assert vectors[name][0] == pytest.approx(place[sample]), name
    foot, way = vectors["reaction"]
    assert way == pytest.approx(-scale * sum(force[sample] for _, force in wanted.values()))
    torque = channels["friction_torque"][sample]
    assert moment(foot, way) / scale == pytest.approx(torque)
    (arm,) = (line for line in enlarged.lines if line.get_label() == "lever arm")
    (x0, x1), (y0, y1) = arm.get_data()
    assert (x0, y0) == (0.0, 0.0)
    assert complex(x1, y1) == pytest.approx(foot)
    assert moment(complex(x1, y1), way / scale) == pytest.approx(torque)
    # The resultant of all forces and couples, without the inertia force.
    forces = [pair for name, pair in wanted.items() if "inertia" not in name]
    applied = sum(moment(p, f)[sample] for p, f in forces)
    applied += sum(size[sample] for size in couples(data, channels).values())
    (words,) = (text for text in key_of(figure) if text.startswith("resultant"))
    assert value_of(words) == pytest.approx(abs(sum(f[sample] for _, f in forces)), rel=1e-3)
    if "couple" in words:
        assert value_of(words.split("couple of")[1]) == pytest.approx(applied, rel=1e-3)
    else:
        foot, way = vectors["resultant"]
        assert moment(foot, way) / scale == pytest.approx(applied)


def test_circles_and_shaft_are_true_to_scale_and_the_contact_is_on_the_shaft() -> None:
    figure = draw(drawn(1), VIEW)
    enlarged = figure.axes[1]
    circles = [patch for patch in enlarged.patches if isinstance(patch, Circle)]
    radii = sorted(circle.get_radius() for circle in circles)
    wanted = [0.02 * np.sin(np.arctan(mu)) for mu in (0.2, 0.3)]
    assert radii[:3] == pytest.approx([*wanted, 0.02])
    assert [t for t in key_of(figure) if t.startswith("circle of")] == [
        f"circle of static friction, radius {1e3 * wanted[1]:.4g} mm",
        f"circle of kinetic friction, radius {1e3 * wanted[0]:.4g} mm",
    ]
    contact, way = arrows(enlarged)["reaction"]
    assert abs(contact) == pytest.approx(0.02)
    # It presses on the body from within: outwards, along its line of action.
    assert (contact.conjugate() * way).real > 0.0
    assert moment(contact, way) == pytest.approx(moment(arrows(figure.axes[0])["reaction"][0], way))


def test_couples_are_curved_arrows_in_their_direction() -> None:
    data, channels = drawn_shaft(1), drawn_motion(1)
    ax = draw(made(data, channels), VIEW).axes[0]
    wanted = {name: float(size[-1]) for name, size in couples(data, channels).items()}
    curved = {p.get_label(): p for p in ax.patches if getattr(p, "_path_original", None)}
    assert curved.keys() == {"motor", "torsion spring", "viscous damping"}
    for name, patch in curved.items():
        points = patch._path_original.vertices @ [1.0, 1.0j]
        turned = np.angle(points[1:] / points[:-1])
        assert np.sign(turned).tolist() == [np.sign(wanted[name])] * len(turned), name


def test_an_instant_is_that_of_the_sample_before() -> None:
    figure = draw(crank(), VIEW, time=0.62)
    assert figure.axes[0].get_title() == "at 0.6 s: slips forward"
    i = int(np.searchsorted(crank().channels["time"], 0.6))
    (words,) = (text for text in key_of(figure) if text.startswith("reaction"))
    assert value_of(words) == pytest.approx(crank().channels["shaft_reaction"][i], rel=1e-3)
    assert draw(crank(), VIEW, time=0.2).axes[0].get_title() == "at 0.2 s: sticks"


def two_forces(x: float = 0.3, mu: tuple[float, float] = (0.2, 0.1), **changes: Any) -> Record:
    """Return a result at rest of two equal forces to one side or to opposite sides."""
    forces = [
        {"name": "left", "size": 50.0, "point": [-0.3, 0.0], "direction": [0.0, 1.0]},
        {"name": "right", "size": 50.0, "point": [x, 0.1], "direction": [0.0, 1.0]},
    ]
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "forces": forces,
        "effects": {"shaft_friction": {"shaft_radius": 0.02, "mu_s": mu[0], "mu_k": mu[1]}},
    } | changes
    still = np.zeros(2)
    channels = {"time": np.arange(2.0), "angle": still, "angular_velocity": still}
    return made(data, channels | {"friction_torque": still + 0.01, "mode": np.zeros(2, int)})


def test_a_couple_of_forces_has_no_resultant_and_one_far_away_goes_through_the_axis() -> None:
    forces = tomllib.loads(two_forces().attributes["scenario"])["forces"]
    forces[1]["direction"] = [0.0, -1.0]
    figure = draw(two_forces(forces=forces), VIEW)
    words = key_of(figure)
    assert "resultant: none, but a couple of \N{MINUS SIGN}30 N m" in words
    assert "reaction of the shaft: none" in words
    assert arrows(figure.axes[0]).keys() == {"left", "right"}
    assert not arrows(figure.axes[1])
    assert figure.axes[0].get_title().endswith("the shaft has no friction at this instant")
    forces[0]["size"], forces[1]["point"] = 51.0, [0.3, 0.0]
    (words,) = (t for t in key_of(draw(two_forces(forces=forces), VIEW)) if t[:9] == "resultant")
    assert words == "resultant, 1 N, with a couple of \N{MINUS SIGN}30.3 N m"


def test_a_torque_of_rounding_is_none() -> None:
    forces = [
        {"name": name, "size": size, "point": [arm, 0.0], "direction": [0.0, 1.0]}
        for name, size, arm in (("a", 1.0, 0.1), ("b", 1.0, 0.2), ("c", -2.0, 0.15))
    ]
    assert 0.1 + 0.2 - 2.0 * 0.15 != 0.0
    words = key_of(draw(two_forces(forces=forces), VIEW))
    assert "resultant: none" in words
    assert not any("e-1" in text or "e\N{MINUS SIGN}1" in text for text in words)


def test_without_dry_friction_there_is_the_body_alone() -> None:
    figure = draw(without(two_forces(effects={}), "friction_torque", "mode"), VIEW)
    (ax,) = figure.axes
    assert ax.get_title() == "at 1 s\nno dry friction: the reaction goes through the axis"
    assert arrows(ax)["reaction"][0] == 0.0
    assert not [text for text in key_of(figure) if "circle" in text or "lever arm" in text]
    # Without coefficients of friction the circles are points.
    figure = draw(two_forces(mu=(0.0, 0.0)), VIEW)
    radii = [p.get_radius() for p in figure.axes[1].patches if isinstance(p, Circle)]
    assert sorted(radii) == pytest.approx([0.02, 0.03])


def test_of_small_friction_circles_the_shaft_is_left_out() -> None:
    figure = draw(two_forces(mu=(0.01, 0.005)), VIEW)
    left, right = figure.axes[1].get_xlim()
    assert right == -left == pytest.approx(4.0 * 0.02 * np.sin(np.arctan(0.01)))
    assert "contact" not in [text.get_text() for text in figure.axes[1].texts]


def test_of_many_forces_the_largest_are_named() -> None:
    forces = [
        {"name": f"f{i}", "size": float(i + 1), "point": [0.3, 0.1 * i], "direction": [1.0, i]}
        for i in range(25)
    ]
    figure = draw(two_forces(forces=forces), VIEW)
    assert "15 smaller forces" in key_of(figure)
    assert [t for t in key_of(figure) if t.startswith("f")] == [
        f"f{i}, {i + 1} N" for i in range(15, 25)
    ]
    assert arrows(figure.axes[0]).keys() >= {f"f{i}" for i in range(12, 25)}


@cache
def rotor(mass: float = 1.0) -> Record:
    """Return a result of a heavy body with an eccentric mass that turns fast."""
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.02, "mass": 5.0},
        "effects": {
            "gravity": {},
            "eccentric_mass": {"mass": mass, "radius": 0.05, "azimuth_deg": 30.0},
            "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.2, "mu_k": 0.15},
            "end_stops": {"lowest_angle_deg": -40.0},
        },
    }
    flat = np.zeros(2)
    channels = {"time": np.arange(2.0), "angle": flat + 2.6, "angular_velocity": flat + 36.0}
    channels |= {"angular_acceleration": flat, "friction_torque": flat - 0.27}
    return made(data, channels)


def test_nothing_has_the_colour_of_a_force_that_is_none() -> None:
    ax = draw(rotor(), VIEW).axes[0]
    colours = {
        name: next(p.get_edgecolor() for p in ax.patches if p.get_label() == name)
        for name in ("weight of the body", "weight of the eccentric mass")
    }
    assert len(set(colours.values())) == 2
    faces = [p.get_facecolor() for p in ax.patches if not isinstance(p, FancyArrowPatch)]
    blue = to_rgba(MARKED)
    assert blue not in faces
    assert blue not in [to_rgba(one.get_color()) for one in ax.lines]
    # What comes against the stop is still there, and so is the fifth spoke.
    polygons = [p for p in ax.patches if isinstance(p, Polygon)]
    assert len(polygons) == 2
    assert len([one for one in ax.lines if np.size(one.get_xdata()) == 2]) >= 5


def test_the_key_says_which_arrow_is_too_short_to_be_drawn() -> None:
    words = key_of(draw(rotor(0.1), VIEW))
    assert "weight of the eccentric mass, 0.981 N (not drawn)" in words
    assert "weight of the eccentric mass, 9.81 N" in key_of(draw(rotor(), VIEW))


def test_an_end_stop_is_a_couple_and_a_missing_channel_is_named() -> None:
    with pytest.raises(InputError, match="has no channel angular_acceleration"):
        draw(without(drawn(1), "angular_acceleration"), VIEW)
    record = with_channels(two_forces(), stop_torque=np.array([0.0, -3.0]))
    assert "end stop, \N{MINUS SIGN}3 N m" in key_of(draw(record, VIEW))
    assert not [t for t in key_of(draw(record, VIEW, time=0.5)) if "end stop" in t]


@pytest.mark.parametrize(
    "appearance", [{}, slow({"width": "84mm", "style": "paper", "title": False})]
)
@pytest.mark.parametrize("name", ["shaft", slow("hoist_drum"), slow("swing_door")])
def test_texts_of_shipped_scenarios_are_apart(name: str, appearance: dict[str, Any]) -> None:
    channels = {"time": TIMES, "angle": 2.0 * TIMES, "angular_velocity": 2.0 + 0.0 * TIMES}
    channels |= {"angular_acceleration": TIMES, "friction_torque": 0.1 + 0.0 * TIMES}
    figure = draw(made(shipped(name), channels), VIEW, **appearance)
    if not appearance:
        figure.draw_without_rendering()
    check_texts(figure)


def test_a_name_without_space_is_left_out() -> None:
    forces = [
        {"name": f"force-{i}", "size": 10.0, "point": [0.3, 0.0], "direction": [1.0, 0.01 * i]}
        for i in range(10)
    ]
    figure = draw(two_forces(forces=forces), VIEW)
    named = [text for text in figure.axes[0].texts if text.get_text().startswith("force")]
    assert len(named) < 10
    assert {f"force-{i}, 10 N" for i in range(10)} <= {*key_of(figure)}
    figure.draw_without_rendering()
    check_texts(figure)


@pytest.mark.parametrize("kind", ["shaft", "pulley"])
def test_the_static_limit_is_drawn_with_the_friction_torque(kind: str) -> None:
    record = crank() if kind == "shaft" else shown("pulley")
    journal = tomllib.loads(record.attributes["scenario"])["effects"]["shaft_friction"]
    radius = journal["shaft_radius"] * np.sin(np.arctan(journal["mu_s"]))
    figure = draw(record)
    assert key_of(figure)[-1] == "limit of static friction"
    ax = next(ax for ax in figure.axes if ax.get_ylabel().split()[:2] == ["friction", "torque,"])
    limits = [np.asarray(line.get_ydata()) for line in ax.lines[1:]]
    limits = [values for values in limits if values.size == record.channels["time"].size]
    assert len(limits) == 2
    for limit, sign in zip(limits, (-1.0, 1.0), strict=True):
        assert limit == pytest.approx(sign * radius * record.channels["shaft_reaction"])


def test_a_body_without_friction_has_no_static_limit() -> None:
    assert not draw(shown("shaft", effects=None, solver__duration=0.1)).legends
