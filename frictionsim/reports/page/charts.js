"use strict";
// Charts over time by Plotly: one time axis for all, and a line at the time of the clock.

frictionsim.Charts = class {
  constructor(container, data, clock, theme) {
    [this.data, this.clock, this.dark] = [data, clock, theme.dark];
    this.range = [clock.start, clock.end];
    this.comparison = data.results.length > 1;
    container.append(this.toolbar(), frictionsim.marksKey(data));
    this.charts = data.charts.map((chart) => new frictionsim.Chart(container, chart, this));
    clock.follow((time) => this.charts.forEach((chart) => chart.showTime(time)));
    theme.follow((dark) => {
      if (dark === this.dark) return;
      this.dark = dark;
      this.charts.forEach((chart) => chart.drawAnew());
    });
  }

  toolbar() {
    const { element, button } = frictionsim;
    return element("div", { class: "toolbar", role: "group", "aria-label": "Time axis of the charts" },
      button("Zoom in", "Zoom in about the time of the clock", () => this.zoomAbout(0.5)),
      button("Zoom out", "Zoom out about the time of the clock", () => this.zoomAbout(2)),
      button("All", "Show the whole run", () => this.zoom([this.clock.start, this.clock.end])));
  }

  zoomAbout(factor) {
    const { start, end, time } = this.clock;
    const wide = factor * (this.range[1] - this.range[0]);
    if (wide >= end - start) this.zoom([start, end]);
    else {
      const from = Math.min(Math.max(time - wide / 2, start), end - wide);
      this.zoom([from, from + wide]);
    }
  }

  // Shows the same part of the run in all charts.
  zoom(range) {
    if (range[0] === this.range[0] && range[1] === this.range[1]) return;
    this.range = [...range];
    for (const chart of this.charts) chart.zoom();
  }
};

frictionsim.Chart = class {
  constructor(container, chart, all) {
    [this.chart, this.all, this.drawn] = [chart, all, false];
    const { element } = frictionsim;
    const unit = frictionsim.unit(chart.unit);
    this.plot = element("div", { class: "plot", role: "img", "aria-label": `${chart.words} over time` });
    this.chartOf = new frictionsim.Plot(this.plot);
    this.cursor = element("div", { class: "cursor", "aria-hidden": "true" });
    this.key = new frictionsim.Key(this, chart.lines);
    this.details = element("details", { class: "chart", "data-name": chart.name, open: chart.first, ontoggle: () => this.draw() },
      element("summary", {}, `${chart.words} (${chart.name.replaceAll("_", " ")})${unit === "1" ? "" : `, ${unit}`}`),
      this.key.element,
      element("div", { class: "frame" }, this.plot, this.cursor));
    container.append(this.details);
    this.draw();
  }

  draw() {
    if (!this.details.open) return;
    if (this.drawn) {
      // The window may have another width since it was closed.
      this.chartOf.resize().then(() => this.showTime(this.all.clock.time));
      return;
    }
    this.drawn = true;
    this.chartOf.draw(this.traces(), this.layout()).then(() => {
      this.plot.on("plotly_relayout", (change) => this.relayouted(change));
      this.plot.on("plotly_click", ({ points }) => { this.all.clock.pause(); this.all.clock.set(points[0].x); });
      this.plot.on("plotly_afterplot", () => this.showTime(this.all.clock.time));
      this.showTime(this.all.clock.time);
    });
  }

  drawAnew() {
    this.key.colour();
    if (this.drawn) this.chartOf.draw(this.traces(), this.layout());
  }

  traces() {
    const { comparison, dark } = this.all;
    const unit = frictionsim.plain(this.chart.unit === "1" ? "" : ` ${frictionsim.unit(this.chart.unit)}`);
    return this.chart.lines.map((line, number) => ({
      type: "scatter",
      mode: "lines",
      x: this.all.data.times[line.time],
      y: line.values,
      line: { ...frictionsim.lineStyle(line, comparison, dark), shape: line.steps ? "hv" : "linear" },
      visible: !this.key.hidden.has(number),
      hovertemplate: `%{y:.7~g}${unit}<extra>${frictionsim.plain(this.key.label(line))}</extra>`,
    }));
  }

  layout() {
    const colours = frictionsim.chartColours(this.all.dark);
    const axis = { color: colours.text, gridcolor: colours.grid, linecolor: colours.axis, zerolinecolor: colours.axis, showline: true, ticks: "outside", tickcolor: colours.axis };
    const unit = this.chart.unit === "1" ? "" : `, ${frictionsim.unit(this.chart.unit)}`;
    return {
      height: 200,
      separators: ".", // none between thousands
      margin: { l: 72, r: 12, t: 8, b: 38 },
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 12, color: colours.text },
      hovermode: "x unified",
      hoverdistance: -1,
      hoverlabel: { bgcolor: colours.hover, bordercolor: colours.axis, font: { color: colours.text } },
      showlegend: false,
      xaxis: { ...axis, range: [...this.all.range], title: { text: "time, s", standoff: 4 }, unifiedhovertitle: { text: "%{x:.9~g} s" } },
      yaxis: { ...axis, title: { text: this.inLines(`${this.chart.name.replaceAll("_", " ")}${unit}`), standoff: 6 }, automargin: true },
      shapes: frictionsim.marks(this.all.data.results, this.all.comparison, colours, this.all.dark),
    };
  }

  // In two lines if it is longer than the chart is high.
  inLines(text) {
    const words = text.split(" ");
    const half = Math.ceil(words.length / 2);
    const lines = text.length > 22 ? [words.slice(0, half), words.slice(half)] : [words];
    return lines.map((line) => frictionsim.plain(line.join(" "))).join("<br>");
  }

  // What Plotly says after the reader has zoomed this chart.
  relayouted(change) {
    const { start, end } = this.all.clock;
    if (change["xaxis.autorange"]) this.all.zoom([start, end]);
    else if ("xaxis.range[0]" in change) this.all.zoom([change["xaxis.range[0]"], change["xaxis.range[1]"]]);
    else if (change["xaxis.range"]) this.all.zoom(change["xaxis.range"]);
  }

  zoom() {
    if (this.drawn) this.chartOf.zoom(() => this.all.range);
  }

  // The cursor is an element of its own: to have Plotly draw it would take too long for each frame.
  showTime(time) {
    if (!this.drawn || !this.details.open) return;
    this.key.showTime(time);
    const layout = this.plot._fullLayout;
    if (!layout?.xaxis?._length) return;
    const { _offset: offset, _length: length, range } = layout.xaxis;
    const part = range[1] > range[0] ? (time - range[0]) / (range[1] - range[0]) : 0;
    this.cursor.hidden = !(part >= 0 && part <= 1);
    this.cursor.style.transform = `translateX(${offset + part * length}px)`;
  }
};
