"""A kind of mechanism from another package that does something else in one run of a sweep."""

from pathlib import Path

from tests.support.plugins import BRAKE, install

SCENARIO = BRAKE / "frictionsim_brake" / "block_brake.toml"
ANGLE = "mechanism.initial_angle_deg"
ADDED = """

_sound_build = build


def build(scenario):
    if scenario.mechanism.initial_angle_deg == {angle}.0:
        _meanwhile()
    return _sound_build(scenario)


def _meanwhile():
{body}


simulation = simulation_of(build)
"""


def unreliable(folder: Path, angle: int, *body: str) -> Path:
    """Install the brake, and lines of Python that it runs at one initial angle, in degrees."""
    install(BRAKE, folder)
    lines = "\n".join(f"    {line}" for line in body)
    with (folder / "frictionsim_brake" / "block_brake.py").open("a") as module:
        module.write(ADDED.format(angle=angle, body=lines))
    return folder
