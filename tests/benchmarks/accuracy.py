"""Accuracy of the backends on the pulley's reference profile, and on a crank barely over its top.

Run it as `python -m tests.benchmarks.accuracy`.
"""

from math import cos, degrees, pi, sin, sqrt
from statistics import median
from typing import Any

from scipy.optimize import brentq

from frictionsim.results import Record
from tests.support.problems import RETURN_FORCE, RETURN_STICK
from tests.support.scenarios import Scenario, changed, pulley, shipped, simulate, with_method

REPEATS = 9
PUBLISHED = ("published", "rkf45")


def measured(law: str, backend: str, **solver: Any) -> tuple[Record, float]:
    """Return a run of the return profile and the median of its wall seconds."""
    data = pulley(drive__force=RETURN_FORCE, solver__duration=12.0, **solver)
    data = with_method(data, law, backend)
    runs = [simulate(data) for _ in range(REPEATS)]
    return runs[-1], median(run.statistics.wall_seconds for run in runs)


EXCESSES = (1e-2, 1e-4, 1e-6)
NUDGE = 1e-9  # rad, of the start: small against what bends the motion, large against roundings


def over_the_top(excess: float) -> Scenario:
    """Return a crank that comes over its top with so much of its first speed to spare."""
    data = shipped("epicyclic", drive={"torque": 0.0}, effects__tracer_point=None)
    mechanism, effects = data["mechanism"], data["effects"]
    crank, planet = mechanism["crank_mass"], mechanism["planet_mass"]
    sun, wheel = mechanism["sun_radius"], mechanism["planet_radius"]
    length, g = sun + wheel, effects["gravity"]["g"]
    weight, inertia = (crank / 2.0 + planet) * g * length, (2.0 * crank + 9.0 * planet) / 6.0
    couple = effects["hinge_friction"]["torque_kinetic"] * sun / wheel
    roll = effects["rolling_friction"]["arm"] * planet * g * length / wheel
    # A little beyond the top the weight drives as much as friction takes.
    top = brentq(lambda q: weight * cos(q) + couple + roll * sin(q), 0.5 * pi, pi)
    work = weight * (sin(top) + 1.0) + couple * (top + 0.5 * pi) + roll * (2.0 - cos(top))
    mechanism["initial_angle_deg"] = -90.0
    mechanism["initial_angular_velocity"] = sqrt(2.0 * work / inertia) / length * (1.0 + excess)
    return data


def final_angle(data: Scenario, rtol: float, nudge: float = 0.0) -> float:
    """Return the angle after 4 s; the crank nearly stands still on its way."""
    start = data["mechanism"]["initial_angle_deg"] + degrees(nudge)
    solver = {"duration": 4.0, "rtol": rtol, "atol": 1e-2 * rtol, "backend": "events"}
    run = simulate(changed(data, solver=solver, mechanism__initial_angle_deg=start))
    return float(run.channels["angle"][-1])


def gears() -> None:
    """Print the error of `events` at rtol 1e-11 against 1e-13, and the growth of a nudge."""
    print("barely over the top: excess of speed, error rad, growth of an error of the start")
    for excess in EXCESSES:
        data = over_the_top(excess)
        fine = final_angle(data, 1e-13)
        error, nudged = abs(final_angle(data, 1e-11) - fine), final_angle(data, 1e-13, NUDGE)
        print(f"  {excess:.0e} {error:.1e} {abs(nudged - fine) / NUDGE:.2g}")


def main() -> None:
    gears()
    print(f"{'backend':10s} {'setting':>12s} {'stop, s':>9s} {'angle, rad':>10s} {'steps':>7s} ms")
    settings = [
        (law, backend, {"rtol": rtol, "atol": rtol * 1e-3})
        for law, backend in (("set-valued", "events"), ("set-valued", "rkf45"), PUBLISHED)
        for rtol in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    ]
    settings += [(*PUBLISHED, {"step": step}) for step in (1e-2, 1e-3, 1e-4)]
    for law, backend, setting in settings:
        changes = {f"solver__{name}": value for name, value in setting.items()}
        run, seconds = measured(law, backend, **changes)
        if run.status != "done":
            print(f"{law:10s} {backend:10s} {run.status}: {run.reason}")
            continue
        stop = abs(run.transitions[1].time - RETURN_STICK[0])
        angle = abs(run.channels["angle"][-1] - RETURN_STICK[1])
        name, value = next(iter(setting.items()))
        print(
            f"{law:10s} {backend:10s} {name + f' {value:.0e}':>12s} {stop:9.1e} {angle:10.1e}"
            f" {run.statistics.steps:7d} {seconds * 1e3:.1f}"
        )


if __name__ == "__main__":
    main()
