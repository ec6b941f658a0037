"""Mistakes in a user's program that `mypy --strict` finds, one a line with the comment `wrong`."""

from pathlib import Path

import frictionsim as fs

scenario = fs.load(3)  # wrong
text: int = fs.load("a.toml").to_toml()  # wrong
result = fs.solve(scenario, overrides={"solver.rtol": 1e-9}, outptu="a.h5")  # wrong
fs.solve("a.toml", max_wall="3")  # wrong
fs.solve("a.toml", progress=3)  # wrong
value: float = result.quantities["breakaway_time"].value  # wrong
result.status = "done"  # wrong
angle = result.datasets["angle"]  # wrong
opened: fs.Scenario = fs.open(Path("a.h5"))  # wrong
fs.compare(result, None)  # wrong
fs.plot(result, "response", "ax")  # wrong
fs.plott(result)  # wrong
fs.cost("a.toml", repeats="many")  # wrong
scenario.replace(7)  # wrong
