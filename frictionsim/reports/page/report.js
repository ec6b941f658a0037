"use strict";
// Puts the page of runs together.

frictionsim.start = async () => {
  const data = frictionsim.data = await frictionsim.load();
  const theme = frictionsim.theme = new frictionsim.Theme();
  document.getElementById("tools").append(theme.button());
  const steps = frictionsim.increasing(data.results.map((result) => data.times[result.steps]));
  if (steps.length) {
    const events = frictionsim.increasing(data.results.map((result) => result.events.time));
    const clock = frictionsim.clock = new frictionsim.Clock(steps[0], steps.at(-1), steps, events);
    const container = document.getElementById("charts");
    frictionsim.addDrawings(data, clock);
    frictionsim.charts = new frictionsim.Charts(container, data, clock, theme);
    for (const { motion, label } of data.results) {
      if (frictionsim.BeltChart.bandOf(motion)) {
        new frictionsim.BeltChart(container, motion, data.results.length > 1 ? label : "", clock, theme);
      }
    }
    container.append(...container.querySelectorAll("#undrawn"));
    new frictionsim.Controls(document.getElementById("clock"), clock);
    frictionsim.followEvents(clock);
    await Promise.all(frictionsim.charts.charts.map((chart) => chart.chartOf.work));
  } else document.querySelectorAll("#events button").forEach((button) => { button.disabled = true; });
  performance.mark("ready");
  frictionsim.ready = true;
};

// All values of several arrays, each once.
frictionsim.increasing = (arrays) =>
  Float64Array.from(new Set(arrays.flatMap((values) => [...values]))).sort();

// A function that returns the line of the charts that a read-out of a result is of.
frictionsim.lineOf = ({ charts, times }, number) => ({ channel, member }) => {
  const lines = charts.flatMap((chart) => chart.lines);
  const line = lines.find((found) => found.result === number && found.channel === channel && (!member || found.label === member));
  return line && { ...line, times: times[line.time] };
};

// The drawing of each result, side by side on one clock; or why there is none.
frictionsim.addDrawings = (data, clock) => {
  const { element } = frictionsim;
  const container = document.getElementById("drawings");
  frictionsim.drawings = data.results.map(({ motion, no_motion: reason, label }, number) => {
    const several = data.results.length > 1;
    const caption = element("figcaption", {}, several ? label : "");
    if (!motion) {
      container.append(element("figure", { class: "no-drawing" }, element("p", { class: "note" }, reason), caption));
      return null;
    }
    const canvas = element("canvas", { role: "img", "aria-label": `The mechanism in motion${several ? `: ${label}` : ""}` });
    container.append(element("figure", {}, caption, canvas));
    const drawing = new frictionsim.Drawing(canvas, motion, frictionsim.lineOf(data, number));
    clock.follow((time) => drawing.draw(time));
    return drawing;
  });
};

frictionsim.start().catch((error) => {
  document.getElementById("message").textContent = `The charts cannot be shown: ${error.message}`;
  throw error;
});
