"""One run of a scenario: its monitor, samples, checkpoints, audit and record."""
