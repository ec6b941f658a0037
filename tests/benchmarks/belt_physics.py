"""What the belt drive of Kubas 2014, section 4, does: the capstan's ratio, creep, the mesh, slip.

Run it as `python -m tests.benchmarks.belt_physics`; it takes some minutes and prints tables.
"""

import tomllib
from math import exp, pi
from pathlib import Path

import numpy as np

from frictionsim.scenario.overrides import apply_override
from frictionsim.scenario.validation import validate
from frictionsim.simulation.simulate import RunResult, run

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def simulate(*overrides: str, without: tuple[str, ...] = (), base: str = "belt_drive") -> RunResult:
    """Run a shipped scenario with keys set and effects left out."""
    data = tomllib.loads((SCENARIOS / f"{base}.toml").read_text())
    for effect in without:
        del data["effects"][effect]
    for override in overrides:
        apply_override(data, override)
    return run(validate(data, SCENARIOS), lambda t: None)


def figure(result: RunResult, name: str) -> float:
    value = result.quantities[name].value
    return float("nan") if value is None else value


def capstan() -> None:
    """T1/T2 of a belt that slips on its driver as a whole, against exp(mu pi)."""
    print(f"capstan, mu = 0.3: exp(mu pi) = {exp(0.3 * pi):.4f}")
    ramp = "drive.driver.torque={time = [0.0, 0.3], value = [0.0, -20.0]}"
    for bodies in (150, 300):
        for without in (("bending",), ()):
            result = simulate(
                ramp,
                f"mechanism.belt.bodies={bodies}",
                "effects.belt_friction.mu_s=0.3",
                "effects.belt_friction.mu_k=0.3",
                "solver.backend=moreau",
                "solver.duration=0.6",
                without=without,
            )
            ratio = figure(result, "tension_tight") / figure(result, "tension_slack")
            bending = "without" if without else "with"
            print(
                f"  {bodies} bodies, {bending} bending: {ratio:.4f}"
                f" ({100 * (ratio / exp(0.3 * pi) - 1):+.2f} %), {result.status}"
            )


def creep() -> None:
    """The mean slip against the elastic creep dT/EA, over the number of bodies."""
    print("creep over 1.5 to 3 s, no bending: bodies, slip %, dT/EA %, slip over it, scatter rad/s")
    for bodies in (60, 150, 300, 600):
        result = simulate(
            f"mechanism.belt.bodies={bodies}",
            "solver.backend=moreau",
            "solver.duration=3.0",
            'output.channels=["pulley_speed", "pulley_angle"]',
            without=("bending",),
        )
        late = result.time >= 1.5
        speed = result.channels["pulley_speed"][late]
        turned = np.ptp(result.channels["pulley_angle"][late], axis=0)
        slip = 100.0 * (1.0 - turned[1] / turned[0])
        strain = (
            100.0 * (figure(result, "tension_tight") - figure(result, "tension_slack")) / 1.52e5
        )
        scatter = np.std(speed[:, 0])
        print(f"  {bodies} {slip:.3f} {strain:.3f} {slip / strain:.3f} {scatter:.3f}", flush=True)


def published() -> None:
    """The slip that the published friction has at three tolerances, beside that of exact stick."""
    print("slip over the last 4 ms of 20 ms: law, rtol, slip %, share that sticks, steps")
    short = ("solver.backend=rkf45", "solver.duration=0.02", "output.interval=1e-4")
    for rtol in (1e-2, 1e-3, 1e-4):
        for base in ("belt_drive", "belt_drive_published"):
            result = simulate(f"solver.rtol={rtol}", *short, base=base)
            print(
                f"  {base} {rtol:g} {figure(result, 'slip_percent'):.3f}"
                f" {figure(result, 'stick_fraction'):.3f} {result.statistics.steps}",
                flush=True,
            )


if __name__ == "__main__":
    capstan()
    creep()
    published()
