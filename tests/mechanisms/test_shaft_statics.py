"""Eq 24 of a body on a shaft for one unknown, against references in many digits."""

from collections.abc import Iterator
from math import nextafter, radians
from typing import Any

import mpmath
import pytest
from mpmath import mp, mpf

import frictionsim as fs
from frictionsim.errors import ScenarioError
from tests.support import shaft_balance
from tests.support.scenarios import SCENARIOS, Scenario, changed

DIRECTIONS = {"counter_clockwise": 1, "clockwise": -1}
TOLERANCE = mpf("1e-12")


@pytest.fixture(autouse=True)
def many_digits() -> Iterator[None]:
    with mp.workdps(shaft_balance.DIGITS):
        yield


SHORT = {"solver.duration": 1e-3}  # s; a run has the roots at the angle without those of a turn


def solved(data: Scenario) -> Any:
    """Return the roots of a scenario by name; None if its unknown does not enter eq 24."""
    try:
        scenario = fs.load(data, SHORT)
    except ScenarioError as error:
        if "does not enter eq 24" not in str(error):
            raise
        return None
    return fs.solve(scenario).quantities


def roots_of(quantities: Any) -> list[tuple[float, int]]:
    """Return the roots at the angle, in ascending order, with their directions."""
    roots = [
        (quantity.value, sign)
        for name, quantity in quantities.items()
        for direction, sign in DIRECTIONS.items()
        if name.removesuffix("_second").removesuffix(direction) != name.removesuffix("_second")
        and not name.removesuffix("_second").endswith(f"_counter_{direction}")
        and quantity.value is not None
    ]
    return sorted(roots)


def misses(values: list[tuple[float, int]], wanted: list[tuple[Any, int]]) -> list[Any]:
    """Return the wanted roots, with directions, that are not found to the tolerance."""

    def near(x: float, value: Any) -> bool:
        return abs(x - value) <= TOLERANCE * abs(value)

    return [
        (value, sign)
        for value, sign in wanted
        if not all(
            any(near(x, value) and s == direction for x, s in values)
            for direction in ((sign,) if sign else (1, -1))
        )
    ]


def test_roots_are_those_of_many_digits() -> None:
    found = 0
    for seed in range(24):
        data = shaft_balance.drawn_place(seed)
        quantities = solved(data)
        if quantities is None:
            continue
        assert not any("_largest" in name for name in quantities)
        roots = roots_of(quantities)
        wanted = shaft_balance.roots(data, data["statics"]["angle_deg"])
        assert misses(roots, wanted) == [], data
        assert len(roots) == sum(1 if sign else 2 for _, sign in wanted), data
        found += len(roots)
    assert found > 24


# --- degenerate cases


def crank(**changes: Any) -> Scenario:
    """Return a body with a load on a cord of radius 0.5 m and an effort on one of 1 m.

    The friction radius is 0.3 m: 0.5 m x 0.75/1.25, all of them exact.
    """
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "forces": [
            {"name": "load", "size": 8.0, "direction": [0.0, -1.0], "cord_radius": -0.5},
            {"name": "effort", "size": 1.0, "direction": [0.0, -1.0], "cord_radius": 1.0},
        ],
        "couples": [{"name": "motor", "size": 0.0}],
        "effects": {"shaft_friction": {"shaft_radius": 0.25, "mu_s": 0.75, "mu_k": 0.0}},
        "statics": {"unknown": "forces.effort.size"},
    }
    return changed(data, **changes)


def of(data: Scenario) -> dict[str, float | None]:
    """Return the roots of a scenario by name."""
    return {
        name: quantity.value
        for name, quantity in fs.solve(data, SHORT).quantities.items()
        if name.removesuffix("_second").endswith("clockwise")
    }


R_S = mpf("0.25") * mpf("0.75") / mpf("1.25")
BY_HAND: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any], Any, Any]] = {
    # of the crank, of its load and its effort; counter-clockwise and clockwise roots
    "1 x - 0.5 8 = +-0.15 (x + 8)": ({}, {}, {}, [5.2 / 0.85], [2.8 / 1.15]),
    # x r_s - 4 = -r_s (x + 8): a linear equation; that of the other sign has no root.
    "an arm as large as the friction radius": (
        {}, {}, {"cord_radius": 0.15}, [], [float((4 - 8 * R_S) / (2 * R_S))]
    ),
    # 4 + 0.1 x = 0.15 |x - 8|: a light effort holds the load, a heavy one its own friction.
    "an arm below the friction radius": (
        {}, {}, {"cord_radius": -0.1, "direction": [0.0, 1.0]}, [], [-2.8 / 0.25, 5.2 / 0.05]
    ),
    # Its moment vanishes, and a load on the axis is held by any friction.
    "a force through the axis": (
        {}, {"cord_radius": -0.1}, {"cord_radius": 0.0, "direction": [1.0, 0.0]}, [], []
    ),
    "load and moment vanish together": (
        {}, {}, {"cord_radius": 0.5, "direction": [0.0, 1.0]}, [8.0], [8.0]
    ),
    "every value is a root": ({}, {"size": 0.0}, {"cord_radius": 0.15}, [], []),
    "no friction": ({"effects": {}}, {}, {}, [4.0], [4.0]),
    # The load is above the axis, where cosine and sine of 45 deg differ by a rounding.
    "a root that is zero is no rounding": (
        {"effects": {}, "statics__angle_deg": 45.0},
        {"cord_radius": None, "point": [0.5, 0.5]}, {}, [0.0], [0.0]
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BY_HAND)
def test_a_crank_by_hand(name: str) -> None:
    keys, load, effort, forward, backward = BY_HAND[name]
    data = crank(**keys)
    for force, changes in zip(data["forces"], (load, effort), strict=True):
        force |= changes
    data["forces"] = [{k: x for k, x in f.items() if x is not None} for f in data["forces"]]
    wanted = {"effort_counter_clockwise": None, "effort_clockwise": None}
    for way, roots in (("counter_clockwise", forward), ("clockwise", backward)):
        names = f"effort_{way}", f"effort_{way}_second"
        wanted |= {n: pytest.approx(x, rel=1e-14) for n, x in zip(names, roots, strict=False)}
    assert of(data) == wanted


def test_a_double_root_is_one() -> None:
    """The couple of 0.75 N m is the limit 0.15 m x 5 N: an effort across the load adds to that.

    A load smaller by 1e-9 moves the two roots apart by the square root of that. One that differs
    by a rounding ties.
    """
    data = crank()
    load, effort = data["forces"]
    effort |= {"cord_radius": 0.0, "direction": [1.0, 0.0]}
    load["cord_radius"], data["couples"][0]["size"] = 0.0, 0.75
    for size in (5.0, nextafter(5.0, 0.0), nextafter(5.0, 6.0)):
        load["size"] = size
        assert of(data) == {"effort_counter_clockwise": 0.0, "effort_clockwise": None}
    load["size"] = 5.0 * (1.0 - 1e-9)
    root = float(mpmath.sqrt(25 - shaft_balance.written(load["size"]) ** 2))
    assert of(data) == {  # 0.75^2 = 0.15^2 (load^2 + x^2)
        "effort_counter_clockwise": pytest.approx(-root, rel=1e-6),
        "effort_counter_clockwise_second": pytest.approx(root, rel=1e-6),
        "effort_clockwise": None,
    }
    load["size"] = 5.0 * (1.0 + 1e-9)
    assert of(data) == {"effort_counter_clockwise": None, "effort_clockwise": None}


@pytest.mark.parametrize("mu", [1e-3, 1e-300])
def test_roots_tend_to_the_balance_without_friction(mu: float) -> None:
    data = crank()
    data["effects"]["shaft_friction"]["mu_s"] = mu
    high, low = of(data).values()
    assert high == pytest.approx(4.0, rel=mu)  # r (4 + 8)/4 = 0.75 mu
    assert low == pytest.approx(4.0, rel=mu)


def test_loads_that_cancel_leave_no_rounding_in_a_root() -> None:
    """0.1 N at 0.3 m against 0.03 N at 1 m, which numbers of base 2 miss by 1e-18 N m."""
    data = crank(effects={})
    data["forces"] = [
        {"name": "one", "size": 0.1, "direction": [0.0, 1.0], "cord_radius": 0.3},
        {"name": "two", "size": 0.03, "direction": [0.0, 1.0], "cord_radius": -1.0},
    ]
    data["statics"]["unknown"] = "couples.motor.size"
    assert mpf(0.03) - mpf(0.1) * mpf(0.3) != 0
    assert of(data) == {"motor_counter_clockwise": 0.0, "motor_clockwise": 0.0}
    data["forces"][1]["size"] = 0.03 * (1.0 + 1e-9)
    left = pytest.approx(0.03e-9, rel=1e-6)
    assert of(data) == {"motor_counter_clockwise": left, "motor_clockwise": left}


def test_couples_over_the_angle_that_cancel_leave_no_moment() -> None:
    """0.1 + 0.2 - 0.3 N m, which numbers of base 2 miss by 6e-17 N m, in tables over the angle."""
    data = crank(effects={}, forces=[])
    del data["statics"]
    data["couples"] = [
        {"name": name, "size": {"angle_deg": [-90.0, 0.0, 90.0], "value": [0.0, size, 0.0]}}
        for name, size in (("one", 0.1), ("two", 0.2), ("three", -0.3))
    ]
    assert 0.1 + 0.2 - 0.3 != 0.0
    statics = fs.static(fs.load(data))
    assert statics["applied_torque"].value == 0.0
    assert statics["breakaway_direction"].value == 0.0


# --- other unknowns and places, and between stops; their notes are in messages/shaft.txt

CRANK, DRUM, DOOR = (SCENARIOS / f"{name}.toml" for name in ("shaft", "hoist_drum", "swing_door"))


UNITS = {
    "size": "N",
    "distance": "m",
    "cord_radius": "m",
    "mu_s": "1",
    "shaft_radius": "m",
    "mass": "kg",
    "radius": "m",
    "g": "m/s^2",
    "stiffness": "N m/rad",
    "free_angle_deg": "deg",
}


def known_keys(scenario: Any) -> list[str]:
    """Return the keys that eq 24 can be solved for, as the refusal of another one names them."""
    with pytest.raises(ScenarioError) as caught:
        fs.load(scenario, {"statics.unknown": "none of them"})
    (fault,) = caught.value.faults
    return fault.partition("; known: ")[2].split(", ")


@pytest.mark.parametrize("scenario", [CRANK, DRUM, DOOR])
def test_all_known_keys_are_solved_for(scenario: Any) -> None:
    keys = known_keys(scenario)
    assert len(keys) > 4
    for key in keys:
        table, _, word = key.rpartition(".")
        place = {"statics.angle_deg": 30.0, "statics.time": 0.6}
        quantities = fs.solve(scenario, {"statics.unknown": key, **place, **SHORT}).quantities
        (root,) = [
            quantity
            for name, quantity in quantities.items()
            if name.endswith("_clockwise") and not name.endswith("_counter_clockwise")
        ]
        assert root.unit == ("N m" if table.startswith("couples") else UNITS[word]), key
        # The key is one of the scenario: a value that is found may be set.
        signed = word in ("size", "cord_radius", "free_angle_deg")
        if root.value is not None and word != "distance" and (signed or root.value > 0.0):
            moved = {key: root.value, **place}
            if word == "mu_s":
                moved["effects.shaft_friction.mu_k"] = 0.0
            rest = fs.static(scenario, moved)
            limit = rest["static_limit"].value
            assert rest["static_margin"].value == pytest.approx(0.0, abs=1e-13 * (limit or 1.0))


def test_the_place_of_the_statics_is_the_start_or_another() -> None:
    start = fs.static(CRANK, {"mechanism.initial_angle_deg": 30.0})
    assert fs.static(CRANK, {"statics.angle_deg": 30.0}) == start
    assert fs.static(CRANK)["angle"].value == 0.0


def test_the_balance_of_a_driven_body_is_that_without_its_drive() -> None:
    load, speed = {"forces.effort.size": 100.0}, {"time": [0.0, 1.0], "value": [0.0, 2.0]}
    free = fs.static(CRANK, load)
    driven = fs.static(CRANK, load | {"drive.speed": speed})
    assert driven == free
    assert free.notes == ("at 0 deg and 0 s, it breaks away clockwise",)
    told = "; all values and notes are of it without drive"
    assert driven.notes == (f"at 0 s, the drive holds the body{told}", *free.notes)
    later = fs.static(CRANK, load | {"drive.speed": speed, "statics.time": 0.5})
    assert later.notes[0] == f"at 0.5 s, the drive turns the body at 1 rad/s{told}"
    # Of the run the channel has the torque of the drive in it: what holds the body leaves none.
    run = fs.solve(CRANK, load | {"drive.speed": 0.0, "solver.duration": 0.1})
    assert run.dataset["applied_torque"].values == pytest.approx(0.0, abs=1e-13)
    drive = run.dataset["drive_torque"].values
    assert drive == pytest.approx(-free["applied_torque"].value, rel=1e-13)


def test_the_balance_without_an_unknown() -> None:
    quantities = fs.static(CRANK, {"statics.time": 1.0})
    value = {name: quantity.value for name, quantity in quantities.items()}
    # 230 N instead of 200 N at 0.2 m
    assert value["applied_torque"] == pytest.approx(0.2 * 30.0, rel=1e-14)
    assert value["lever_arm"] == pytest.approx(value["applied_torque"] / value["shaft_reaction"])
    assert value["static_limit"] == pytest.approx(
        value["friction_radius_static"] * value["shaft_reaction"]
    )
    assert value["static_margin"] == pytest.approx(value["static_limit"] - value["applied_torque"])
    assert value["breakaway_direction"] == 1.0
    back = fs.static(CRANK, {"forces.effort.size": 100.0})
    assert back["breakaway_direction"].value == -1.0
    assert fs.static(DOOR, {"forces.hinges.size": 0.0})["lever_arm"].value is None


SPRUNG = {
    "kind": "shaft",
    "mechanism": {"inertia": 1.0},
    "couples": [{"name": "push", "size": 0.0}],
    "effects": {
        "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5, "normal_load": 200.0},
        "torsion_spring": {"stiffness": 8.0, "free_angle_deg": -40.0},
    },
    "statics": {"unknown": "couples.push.size"},
}
TWIST, HELD = 8.0 * radians(40.0), 2.4  # of the spring, and of the friction, N m
LOWER, UPPER = ({f"{side}_angle_deg": 0.0} for side in ("lowest", "highest"))
MU_S = "effects.shaft_friction.mu_s"


@pytest.mark.parametrize(
    ("stops", "free", "unknown", "roots", "said"),
    [
        (None, -40.0, "push", (TWIST - HELD, TWIST + HELD), "from 3.18505 N m to 7.98505 N m"),
        (LOWER, -40.0, "push", (None, TWIST + HELD), "up to 7.98505 N m"),
        (UPPER, -40.0, "push", (TWIST - HELD, None), "from 3.18505 N m on"),
        (UPPER, 40.0, "push", (-TWIST - HELD, None), "from -7.98505 N m on"),
        (LOWER, -40.0, MU_S, (None, None), f"rests with every {MU_S}"),
        (LOWER, 40.0, MU_S, (None, None), f"moves counter-clockwise with every {MU_S}"),
    ],
)
def test_on_a_stop_a_body_rests_with_all_that_presses_it_there(
    stops: Any, free: float, unknown: str, roots: tuple[float | None, float | None], said: str
) -> None:
    keys = {"effects.end_stops": stops, "effects.torsion_spring.free_angle_deg": free}
    if unknown == MU_S:
        keys["statics.unknown"] = MU_S
    quantities = fs.static(fs.load(SPRUNG, keys))
    label = unknown.rpartition(".")[2]
    for way, root in zip(("clockwise", "counter_clockwise"), roots, strict=True):
        expected = None if root is None else pytest.approx(root, rel=1e-14)
        assert quantities[f"{label}_{way}"].value == expected
    assert any(note.endswith(said) for note in quantities.notes)


def test_a_body_rests_on_its_stop() -> None:
    quantities = fs.static(fs.load(SPRUNG, {"effects.end_stops": LOWER}))
    assert quantities["breakaway_direction"].value == 0.0
    assert quantities["stop_torque"].value == pytest.approx(TWIST, rel=1e-15)
    opened = fs.static(fs.load(SPRUNG, {"effects.end_stops": LOWER, "couples.push.size": 20.0}))
    assert opened["breakaway_direction"].value == 1.0
    assert opened["stop_torque"].value == 0.0
    assert "stop_torque" not in fs.static(CRANK)
