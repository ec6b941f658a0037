"use strict";
// The key of a chart: a sample of each line, its name, and its value at the time of the clock.

frictionsim.Key = class {
  constructor(chart, lines) {
    [this.chart, this.lines, this.hidden] = [chart, lines, new Set()];
    const { element } = frictionsim;
    this.values = lines.map(() => element("output", {}));
    this.samples = lines.map(() => this.sample());
    this.element = element("div", { class: "key" }, ...lines.map((line, number) => this.entry(line, number)));
    this.colour();
  }

  label(line) {
    const result = this.chart.all.data.results[line.result].label;
    const names = this.chart.all.comparison ? [result, line.label] : [line.label];
    return names.filter(Boolean).join(": ") || line.channel.replaceAll("_", " ");
  }

  entry(line, number) {
    const { element } = frictionsim;
    const inner = [this.samples[number], this.label(line)];
    const name = this.lines.length < 2 ? element("span", { class: "name" }, ...inner)
      : element("button", { type: "button", class: "name", "aria-pressed": "true", title: "Show or hide this line", onclick: (event) => this.toggle(number, event.currentTarget) }, ...inner);
    return element("span", { class: "entry" }, name, " ", this.values[number]);
  }

  toggle(number, button) {
    if (!this.hidden.delete(number)) this.hidden.add(number);
    button.setAttribute("aria-pressed", String(!this.hidden.has(number)));
    if (this.chart.drawn) this.chart.chartOf.restyle({ visible: !this.hidden.has(number) }, [number]);
  }

  sample() {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    for (const [name, value] of Object.entries({ width: 34, height: 10, "aria-hidden": "true" })) svg.setAttribute(name, value);
    for (const [name, value] of Object.entries({ x1: 0, x2: 34, y1: 5, y2: 5, "stroke-width": 2 })) line.setAttribute(name, value);
    svg.append(line);
    return svg;
  }

  colour() {
    this.lines.forEach((line, number) => {
      const { color, dash } = frictionsim.lineStyle(line, this.chart.all.comparison, this.chart.all.dark);
      const drawn = this.samples[number].firstChild;
      drawn.setAttribute("stroke", color);
      drawn.setAttribute("stroke-dasharray", dash === "solid" ? "none" : dash.replaceAll("px", ""));
    });
  }

  showTime(time) {
    const unit = this.chart.chart.unit === "1" ? "" : ` ${frictionsim.unit(this.chart.chart.unit)}`;
    this.lines.forEach((line, number) => {
      const value = frictionsim.valueAt(this.chart.all.data.times[line.time], line, time);
      this.values[number].textContent = `${frictionsim.number(value)}${Number.isFinite(value) ? unit : ""}`;
    });
  }
};

// The value of a line at a time: between two samples linear, or that of the sample before.
frictionsim.valueAt = (times, line, time) => {
  const before = frictionsim.lastUpTo(times, time);
  if (before < 0) return NaN;
  const [a, b] = [line.values[before], line.values[before + 1]];
  if (times[before] === time || line.steps) return before + 1 < times.length || times[before] === time ? a : NaN;
  return a + (b - a) * (time - times[before]) / (times[before + 1] - times[before]);
};

// Sticking phases as areas and events as lines, for Plotly; of several results strips at the bottom.
frictionsim.marks = (results, comparison, colours, dark) => results.flatMap((result, number) => {
  const height = 0.035;
  const [y0, y1] = comparison ? [number * height, (number + 0.8) * height] : [0, 1];
  const fillcolor = comparison ? frictionsim.lineStyle({ result: number, column: 0 }, true, dark).color : colours.stick;
  const areas = result.sticking.map(([x0, x1]) => ({ type: "rect", xref: "x", yref: "paper", x0, x1, y0, y1, fillcolor, layer: "below", line: { width: 0 } }));
  if (comparison) return areas;
  const dash = (name) => (name === "breakaway" ? "6px,2px" : name === "comes to rest" ? "6px,2px,1px,2px" : "1px,2px");
  return [...areas, ...result.events.names.map((name, event) => {
    const x = result.events.time[event];
    return { type: "line", xref: "x", yref: "paper", x0: x, x1: x, y0: 0, y1: 1, line: { color: colours.event, width: 1.2, dash: dash(name) } };
  })];
});

// What areas and lines of the charts mean.
frictionsim.marksKey = ({ results }) => {
  const notes = [];
  if (results.length > 1) {
    if (results.some(({ sticking }) => sticking.length)) notes.push("Strips at the bottom: sticking, in the colour of the result.");
  } else {
    const [{ sticking, sticking_words: words, events }] = results;
    if (sticking.length) notes.push(`Grey areas: ${words}.`);
    if (events.names.length) notes.push("Upright lines: events (breakaway dashed, coming to rest dash-dotted, others dotted).");
    else if (events.time.length) notes.push(`${events.time.length} events, too many to mark.`);
  }
  if (results.length) notes.push("Click a chart to set the clock, drag to zoom all, double-click to see all.");
  return frictionsim.element("p", { class: "note" }, notes.join(" "));
};
