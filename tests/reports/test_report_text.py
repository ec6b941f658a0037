"""The text of a report without scripts: headings, tables and sentences."""

import re
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Quantity
from tests.support.html_elements import charts_of, data_of, panels_of, report_of
from tests.support.scenarios import SCENARIOS

FAST = {"solver.rtol": 1e-6}
MAX_SAMPLES = 4000  # of a line, more than a screen has side by side


@pytest.fixture(scope="module")
def pulley() -> fs.Result:
    return fs.solve(SCENARIOS / "pulley.toml", FAST)


@pytest.fixture(scope="module")
def heavy() -> fs.Result:
    return fs.solve(SCENARIOS / "pulley.toml", {**FAST, "mechanism.load": 2300.0})


def html_of(*results: fs.Result, **attributes: str) -> str:
    """Return the page of results with other attributes; several are named r0, r1, ..."""
    changed = [
        fs.Result(
            result.record._replace(attributes=result.record.attributes | attributes),
            Path(f"r{number}.h5") if len(results) > 1 else None,
        )
        for number, result in enumerate(results)
    ]
    return report_of(changed)


def plain(html: str) -> str:
    """Return the text of the body before its data."""
    body = html[html.index("<body>") : html.index('id="data"')]
    body = re.sub(r"<script.*?</script>", " ", body, flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]*>", " ", body).split())


def row(html: str, name: str) -> list[str]:
    """Return the texts of the row of a table that begins with a name."""
    cells = next(
        line for line in html.splitlines() if re.match(rf'<tr><th scope="row"[^>]*>{name}<', line)
    )
    return re.sub(r"<[^>]*>", "|", cells).replace("||", "|").strip("|").split("|")


def test_a_report_has_title_status_summary_audit_scenario_origin_and_then_warnings(
    pulley: fs.Result,
) -> None:
    html, text = html_of(pulley), plain(html_of(pulley))
    assert "<title>Pulley on a dry shaft</title>" in html
    assert "kind pulley effects shaft_friction, viscous_damping" in text
    assert "friction law set-valued backend events" in text
    driven = fs.solve("epicyclic_dwell", {"solver.duration": 0.1})
    assert "friction law none needed backend events" in plain(html_of(driven))
    assert "✓ done" in text
    quantity = pulley.quantities["force_to_lift"]
    assert row(html, "force_to_lift") == ["force_to_lift", f"{quantity.value:.10g}", "N"]
    assert row(html, "energy_balance")[-1] == "ok"
    assert "mu_s = 0.2" in text
    assert row(html, "version of frictionsim")[1] == fs.__version__
    body = html[html.index("<body>") :]
    assert body.count("<caption>") == body.count("<table>")
    assert "breakaway shaft stick slip +" in text
    assert "weight of the load 2224 N" in text  # four digits
    assert '<th scope="row">travel of the load</th>' in html  # beside the drawing
    assert "<thead><tr><td></td><td></td>" not in html  # names of several runs
    html = html_of(pulley, warnings="first warning\nsecond warning")
    assert html.index("first warning") < html.index("second warning") < html.index('id="charts"')


@pytest.mark.parametrize(
    ("status", "reason", "words"),
    [
        ("failed", "non_finite at t = 1 s", "✕ failed : non_finite at t = 1 s"),
        ("interrupted", "SIGINT", "‖ interrupted : SIGINT"),
        ("done", "self-audit failed: x", "⚠ done, but its audit failed : self-audit failed: x"),
    ],
)
def test_the_status_is_in_words_with_a_sign(
    pulley: fs.Result, status: str, reason: str, words: str
) -> None:
    text = plain(html_of(pulley, status=status, reason=reason))
    assert words in text
    note = "The run did not come to its end: what follows is what there is up to 3 s."
    assert (note in text) == (status != "done")


def test_several_results_are_side_by_side_with_the_difference_of_two(
    pulley: fs.Result, heavy: fs.Result
) -> None:
    html = html_of(pulley, heavy)
    lift = [result.quantities["force_to_lift"].value or 0.0 for result in (pulley, heavy)]
    expected = [*(f"{value:.10g}" for value in lift), f"{lift[1] - lift[0]:.3g}"]
    assert row(html, "force_to_lift")[1:4] == expected
    assert row(html, "mechanism.load")[1:] == ["2224.1", "2300.0"]
    assert "load = 2300 N less load = 2224.1 N" in html
    assert "less" not in plain(html_of(pulley, heavy, pulley))
    assert "The scenarios are the same." in plain(html_of(pulley, pulley))


def test_a_result_without_samples_has_tables_only(pulley: fs.Result) -> None:
    record = pulley.record
    channels = {name: values[:0] for name, values in record.channels.items()}
    events = {name: values[:0] for name, values in record.events.items()}
    none = record._replace(channels=channels, events=events, quantities={}, checks={})
    empty = fs.Result(none)
    html = report_of(empty)
    assert "This result has no samples: there is nothing to draw, only tables." in plain(html)
    assert charts_of(html) == {}
    assert data_of(html) == {}
    # The charts of others stay.
    assert len(panels_of(report_of([empty, pulley]))["force on the cord, N"]) == 1


def test_lines_are_the_channels_with_both_sides_of_a_jump_and_no_sample_left_out(
    pulley: fs.Result,
) -> None:
    record, html = pulley.record, report_of(pulley)
    panels = panels_of(html)
    assert list(panels) == [
        "force on the cord, N",
        "torque of the dry friction on the pulley, N m",
        "angular velocity of the pulley, rad/s",
        "angle of the pulley, rad",
    ]
    energies = panels_of(html, "more")["energies, J"]
    assert [line["name"] for line in energies][:2] == ["input", "damping"]
    (force,) = panels["force on the cord, N"]
    assert force["line"]["simplify"] is False
    at_events = np.isin(force["x"], record.events["time"])
    others = ~np.isin(record.channels["time"], record.events["time"])
    # Charts have numbers of 4 bytes.
    assert np.array_equal(
        force["y"][~at_events], record.channels["drive_force"][others].astype("f4")
    )
    (friction,) = panels["torque of the dry friction on the pulley, N m"]
    (event,) = record.transitions
    sides = [record.events[f"friction_torque_{side}"][0] for side in ("before", "after")]
    shown = friction["y"][friction["x"] == event.time]
    assert [shown[0], shown[2]] == pytest.approx(sides)
    assert np.isnan(shown[1])


def test_sticking_is_shaded_and_events_have_one_colour_in_chart_and_table(
    pulley: fs.Result,
) -> None:
    html = report_of(pulley)
    (event,) = pulley.record.transitions
    for traces, layout in charts_of(html).values():
        *shapes, cursor = layout["shapes"]
        assert (cursor["name"], cursor["x0"]) == ("cursor", 0.0)
        lines = [shape for shape in shapes if shape["type"] == "line"]
        assert [line["x0"] for line in lines] == [event.time]
        (area,) = (shape for shape in layout["shapes"] if shape["type"] == "rect")
        assert (area["x0"], area["x1"]) == (0.0, event.time)
        (mark,) = (trace for trace in traces if trace["name"] == "breakaway")
        assert f'style="background:{mark["marker"]["color"]}"></span>breakaway' in html
        assert lines[0]["line"]["color"] == mark["marker"]["color"]
        axis = layout["template"]["layout"]["xaxis"]
        assert (axis["minallowed"], axis["maxallowed"]) == (0.0, 3.0)


def test_a_long_channel_is_thinned_and_keeps_ends_extremes_and_gaps(
    pulley: fs.Result,
) -> None:
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 12.0, 23_331)
    values = np.cumsum(rng.normal(size=time.size))
    values[rng.integers(0, time.size, 5)] = np.nan
    values[[0, -1]] = 1.0
    values[rng.integers(1000, 10_000)] = 1e3
    channels = {name: np.interp(time, pulley.record.channels["time"], of)
                for name, of in pulley.record.channels.items()}  # fmt: skip
    channels |= {"time": time, "mode": np.ones(time.size, dtype=int), "angular_velocity": values}
    events = {name: of[:0] for name, of in pulley.record.events.items()}
    changed = fs.Result(pulley.record._replace(channels=channels, events=events))
    (line,) = panels_of(report_of(changed))["angular velocity of the pulley, rad/s"]
    assert MAX_SAMPLES / 2 < line["x"].size <= MAX_SAMPLES
    kept = np.searchsorted(time, line["x"])
    assert np.array_equal(line["y"], values[kept].astype("f4"), equal_nan=True)
    assert (kept[0], kept[-1]) == (0, time.size - 1)
    assert np.nanmax(line["y"]) == 1e3
    assert np.isnan(line["y"]).sum() == np.isnan(values).sum()


def test_numbers_of_tables_have_the_sign_of_charts_and_a_value_to_read(pulley: fs.Result) -> None:
    numbers = {"a-b": -1.5e-07, "c": -0.0, "d": None}
    quantities = {name: Quantity(value, "N") for name, value in numbers.items()}
    html = report_of(fs.Result(pulley.record._replace(quantities=quantities)))
    assert (
        '<td class="number" data-value="-1.5e-07">\N{MINUS SIGN}1.5e\N{MINUS SIGN}07</td>' in html
    )
    assert '<td class="number" data-value="-0.0">0</td>' in html
    assert row(html, "d") == ["d", "none", "N"]
    assert row(html, "a-b")[0] == "a-b"
