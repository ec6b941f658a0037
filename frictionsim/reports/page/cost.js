"use strict";
// The work-precision diagram: error over work, one line for each law and method.

frictionsim.Costs = class {
  constructor(data) {
    this.data = data;
    this.error = data.errors[0];
    this.work = data.work[0];
    this.rows = frictionsim.rowsOf("settings");
    this.lines = [...new Set(data.rows.map((row) => row.line))];
  }

  start() {
    const controls = document.getElementById("controls");
    const words = (name) => [name, frictionsim.withUnit(this.data.columns[name].words, this.data.columns[name].unit)];
    controls.append(
      frictionsim.select("error", "error", this.data.errors.map(words), this.error, (name) => { this.error = name; this.draw(); }),
      frictionsim.select("work", "over", this.data.work.map(words), this.work, (name) => { this.work = name; this.draw(); }));
    controls.hidden = false;
    for (const table of document.querySelectorAll("table.study")) frictionsim.makeSortable(table);
    frictionsim.followColours(() => this.draw());
    this.draw().then(() =>
      document.getElementById("chart").on("plotly_click", ({ points }) => frictionsim.mark(this.rows[points[0].customdata])));
  }

  value(name, row) {
    return this.data.columns[name].values[row];
  }

  // All that is known of a setting, for the read-out.
  words(row) {
    const { name, reason } = this.data.rows[row];
    const lines = [`<b>${frictionsim.label(name, 120)}</b>`];
    for (const [key, { unit, words }] of Object.entries(this.data.columns)) {
      const shown = frictionsim.shown(this.value(key, row));
      if (shown !== "none" && lines.length < 24) lines.push(frictionsim.label(`${words}: ${shown}${unit === "1" ? "" : ` ${unit}`}`));
    }
    return [...lines, ...(reason ? [frictionsim.label(reason, 120)] : [])].join("<br>");
  }

  trace(line, number) {
    const at = this.data.rows.flatMap((row, place) =>
      (row.line === line && !row.failed && this.value(this.work, place) > 0 && this.value(this.error, place) > 0 && this.value(this.error, place) < Infinity ? [place] : []));
    const { colour, symbol, dash } = frictionsim.lineStyle(number);
    return {
      name: frictionsim.label(line), x: at.map((row) => this.value(this.work, row)), y: at.map((row) => this.value(this.error, row)),
      customdata: at, hovertext: at.map((row) => this.words(row)), hoverinfo: "text", mode: "lines+markers",
      line: { color: colour, dash, width: 1.6 }, marker: { color: colour, symbol, size: 9, line: { color: frictionsim.colour("text"), width: 0.7 } },
    };
  }

  // Failed settings are crosses at the upper edge, at the work that they took.
  failed(line, number) {
    const at = this.data.rows.flatMap((row, place) => (row.line === line && row.failed && this.value(this.work, place) > 0 ? [place] : []));
    const count = this.data.rows.filter((row) => row.line === line && row.failed).length;
    if (!count) return [];
    return [{
      name: frictionsim.label(`${line}: ${count} failed`), x: at.map((row) => this.value(this.work, row)), y: at.map(() => 0.98), yaxis: "y2",
      customdata: at, hovertext: at.map((row) => this.words(row)), hoverinfo: "text", mode: "markers",
      marker: { color: frictionsim.lineStyle(number).colour, symbol: "x-thin", size: 11, line: { width: 2.5, color: frictionsim.lineStyle(number).colour } },
    }];
  }

  draw() {
    const of = (name) => this.data.columns[name];
    const floor = { ...this.data.floors_of, ...this.data.floors }[this.error];
    const traces = [...this.lines.map((line, number) => this.trace(line, number)),
      ...this.lines.flatMap((line, number) => this.failed(line, number))];
    const title = (name) => frictionsim.label(frictionsim.withUnit(of(name).words, of(name).unit));
    const left = this.data.rows.filter((row, place) => !row.failed && !(this.value(this.error, place) > 0)).length;
    document.getElementById("note").textContent = [
      left ? `${left} settings have no such error, or none above zero, and are in the table only.` : "",
      floor > 0 ? `Errors below ${frictionsim.shown(floor, 2)} (line) are below the reference uncertainty.` : "",
    ].filter(Boolean).join(" ");
    return frictionsim.show(traces, {
      xaxis: frictionsim.logAxis(title(this.work), traces.flatMap(({ x }) => x)),
      yaxis: frictionsim.logAxis(title(this.error), [...traces.flatMap(({ y, yaxis }) => (yaxis ? [] : y)), ...(floor > 0 ? [floor] : [])]),
      yaxis2: { overlaying: "y", range: [0, 1], visible: false, fixedrange: true },
      shapes: floor > 0 ? [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: floor, y1: floor, line: { color: frictionsim.colour("faint"), dash: "dot" } }] : [],
    });
  }
};

frictionsim.startStudy((data) => {
  frictionsim.costs = new frictionsim.Costs(data);
  frictionsim.costs.start();
});
