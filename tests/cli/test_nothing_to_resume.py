"""`resume` of a file that is not there says so, and suggests no other run."""

from collections.abc import Callable

import pytest

import frictionsim as fs

Told = Callable[..., tuple[str, str]]


@pytest.mark.parametrize("name", ["k.h5", "k.partial.h5", "int2.h5", "j.nc"])
def test_a_missing_file_is_nothing_to_resume(name: str, told: Told) -> None:
    told("solve", "pulley", "--set", "solver.duration=0.01", "-o", "int.h5", "--quiet")
    _, said = told("resume", name, code=2)
    assert f"{name}: there is nothing to resume" in said
    assert "output.checkpoint" in said
    assert "int.h5" not in said
    for resume in (fs.resume, fs.resume_sweep):
        with pytest.raises(fs.InputError, match="there is nothing to resume"):
            resume(name)


def test_the_unfinished_file_is_resumed(told: Told) -> None:
    told("solve", "pulley", "-o", "a.h5", "--max-steps", "5", "--quiet", code=5)
    told("resume", "a.h5", "--quiet")
    _, said = told("resume", "no/a.h5", code=2)
    assert "there is no folder 'no'" in said
