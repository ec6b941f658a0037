"""The number of drawn examples of a test, by the profile of Hypothesis."""

from hypothesis import settings

FEW, MANY = 25, 500  # by default, and every night


def examples(few: int) -> settings:
    """Return the settings of a test whose examples take long: `few`, and as many more at night."""
    return settings(max_examples=few * settings().max_examples // FEW)
