"""The default tests pass in other places, for other users, on other processors and versions."""

import sys

import pytest

from tests.surroundings import ALL, Surroundings, combined, run


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="users and shells of POSIX")
@pytest.mark.parametrize("name", ALL)
def test_the_default_tests_pass(name: str) -> None:
    assert run(ALL[name], [])[0] == 0


def test_surroundings_together_have_what_is_particular_about_each() -> None:
    place = combined(["path with a space", "no AVX2", "no UTF-8", "SIGINT ignored", "Python 3.13"])
    assert place.folder == ALL["path with a space"].folder
    assert place.environment == {**ALL["no AVX2"].environment, **ALL["no UTF-8"].environment}
    assert (place.before, place.python) == ("trap '' INT; ", "python3.13")
    assert not place.ordinary_user
    assert combined([]) == Surroundings()
