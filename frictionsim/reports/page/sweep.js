"use strict";
// A quantity of a sweep over its keys: curves, a map, a scatter, a histogram, Sobol indices.

frictionsim.DONE = 1;
frictionsim.FAILED = 2;
frictionsim.AUDIT_FAILED = 3;
frictionsim.MAX_CURVES = 12;

frictionsim.Sweep = class {
  constructor(data) {
    this.data = data;
    this.isGrid = data.design === "grid";
    this.quantity = Math.max(data.quantities.findIndex(({ varies }) => varies), 0);
    const varied = data.keys.flatMap((key, i) => (key.values.length > 1 ? [i] : []));
    this.x = varied[0] ?? 0;
    this.second = this.isGrid && varied.length > 1 ? varied[1] : -1;
    this.view = this.views()[0];
    this.at = data.keys.map(() => 0);
    this.log = {};
  }

  // How a quantity can be drawn, the first one by default.
  views() {
    const { keys, quantities, of_sample } = this.data;
    if (of_sample) return ["histogram", "scatter", ...(quantities.some(({ indices }) => indices) ? ["indices"] : [])];
    if (!this.isGrid) return ["scatter"];
    if (this.second < 0) return ["curves"];
    return keys[this.x].numeric && keys[this.second].numeric ? ["map", "curves"] : ["curves", "map"];
  }

  start() {
    for (const table of document.querySelectorAll("table.study")) frictionsim.makeSortable(table);
    for (const row of frictionsim.rowsOf("runs")) {
      const button = document.createElement("button");
      [button.type, button.textContent] = ["button", row.cells[0].textContent];
      row.cells[0].replaceChildren(button);
      button.addEventListener("click", () => this.showRun(Number(button.textContent)));
    }
    frictionsim.followColours(() => this.draw());
    this.draw().then(() => document.getElementById("chart").on("plotly_click", ({ points }) => {
      const place = points[0].customdata;
      if (Number.isInteger(place)) this.showRun(this.data.runs[place]);
    }));
  }

  change(name, value) {
    this[name] = value;
    if (this.second === this.x) this.second = -1;
    if (!this.views().includes(this.view)) this.view = this.views()[0];
    this.draw();
  }

  controls() {
    const { keys, quantities } = this.data;
    const named = (list) => list.map(({ name, unit }, i) => [i, frictionsim.withUnit(name, unit)]);
    const with_keys = this.view === "curves" || this.view === "map" || this.view === "scatter";
    const found = [
      frictionsim.select("quantity", "quantity", named(quantities), this.quantity, (i) => this.change("quantity", Number(i))),
      frictionsim.select("view", "drawn as", this.views().map((view) => [view, { indices: "Sobol indices" }[view] ?? view]), this.view, (view) => this.change("view", view)),
    ];
    if (with_keys) {
      const others = named(keys).filter(([i]) => i !== this.x);
      found.push(frictionsim.select("x", "over", named(keys), this.x, (i) => this.change("x", Number(i))));
      if (others.length) found.push(frictionsim.select("second", this.isGrid ? "and" : "coloured by", [[-1, "no other key"], ...others], this.second, (i) => this.change("second", Number(i))));
      if (keys[this.x].numeric) found.push(frictionsim.check("logx", "logarithmic key", this.isLog("x"), (log) => { this.log[`x${this.x}`] = log; this.draw(); }));
    }
    if (this.view === "curves" || this.view === "scatter") found.push(frictionsim.check("logy", "logarithmic quantity", this.isLog("y"), (log) => { this.log[`y${this.quantity}`] = log; this.draw(); }));
    for (const i of with_keys && this.isGrid ? this.fixed() : []) {
      const shown = Array.from(keys[i].values, (value, code) => [code, this.valueText(keys[i], code)]);
      found.push(frictionsim.select(`at${i}`, `${frictionsim.visible(keys[i].name.slice(0, 60))} =`, shown, this.at[i], (code) => { this.at[i] = Number(code); this.draw(); }));
    }
    found.push(this.numberOfRun());
    return found;
  }

  numberOfRun() {
    const outer = document.createElement("label");
    const input = document.createElement("input");
    Object.assign(input, { type: "number", name: "run", min: 0, max: this.data.all - 1 });
    input.addEventListener("change", () => this.showRun(input.valueAsNumber));
    outer.append("values of run", input);
    return outer;
  }

  // The keys of a grid that have one value each in the picture.
  fixed() {
    return this.data.keys.flatMap((key, i) => (i === this.x || i === this.second || key.values.length < 2 ? [] : [i]));
  }

  isLog(axis) {
    const [number, of] = axis === "x" ? [this.x, this.data.keys] : [this.quantity, this.data.quantities];
    return this.log[`${axis}${number}`] ?? of[number].log;
  }

  valueText(key, code) {
    return key.numeric ? `${frictionsim.shown(key.values[code])}${key.unit && key.unit !== "1" ? ` ${key.unit}` : ""}` : key.values[code];
  }

  valueOf(key, place) {
    return this.data.keys[key].values[this.data.keys[key].codes[place]];
  }

  // Where a run stands on the axis of a key.
  onAxis(key, place) {
    const value = this.valueOf(key, place);
    return this.data.keys[key].numeric ? value : frictionsim.label(value);
  }

  // The kept runs that are in the picture.
  places() {
    const fixed = this.isGrid ? this.fixed() : [];
    return Array.from(this.data.runs.keys()).filter((place) =>
      fixed.every((i) => this.data.keys[i].codes[place] === this.at[i]));
  }

  value(place) {
    return this.data.quantities[this.quantity].values[place];
  }

  words(place) {
    const { keys, quantities, runs, status, statuses } = this.data;
    const { name, unit } = quantities[this.quantity];
    const lines = [`run ${runs[place]}: ${statuses[status[place]]}`, `${name} = ${frictionsim.shown(this.value(place))} ${unit === "1" ? "" : unit}`,
      ...keys.slice(0, 12).map((key) => `${key.name} = ${this.valueText(key, key.codes[place])}`)];
    return lines.map((line) => frictionsim.label(line, 120)).join("<br>");
  }

  points(name, places, more) {
    return {
      name, x: places.map((place) => this.onAxis(this.x, place)), y: places.map((place) => this.value(place)), customdata: places,
      hovertext: places.map((place) => this.words(place)), hoverinfo: "text", mode: "markers", ...more,
    };
  }

  // Runs without a sound value, each kind with its mark, where they would be.
  marks(places, y) {
    const of = (status) => places.filter((place) => this.data.status[place] === status);
    const undefined_ = of(frictionsim.DONE).filter((place) => Number.isNaN(this.value(place)));
    const kinds = [["failed", of(frictionsim.FAILED), "x-thin"], ["not defined", undefined_, "triangle-down-open"], ["not run", of(0), "line-ew"]];
    const colour = frictionsim.colour("text");
    return kinds.flatMap(([name, found, symbol], number) => (found.length ? [this.points(`${name}: ${found.length}`, found, {
      ...(y ? { y: found.map(y) } : { y: found.map(() => 0.03 + 0.03 * number), yaxis: "y2" }),
      marker: { symbol, size: 9, color: colour, line: { width: 2, color: colour } },
    })] : []));
  }

  sound(places) {
    return places.filter((place) => this.data.status[place] === frictionsim.DONE && !Number.isNaN(this.value(place)));
  }

  doubtful(places) {
    const found = places.filter((place) => this.data.status[place] === frictionsim.AUDIT_FAILED && !Number.isNaN(this.value(place)));
    return found.length ? [this.points(`audit failed: ${found.length}`, found, { marker: { symbol: "diamond-open", size: 11, color: frictionsim.colour("text") } })] : [];
  }

  axisOfKey({ name, unit, numeric, values }, log) {
    const title = frictionsim.label(frictionsim.withUnit(name, unit));
    return numeric ? frictionsim.numberAxis(title, log, values) : frictionsim.axis(title, { type: "category" });
  }

  axes() {
    const { keys, quantities } = this.data;
    const { name, unit, values } = quantities[this.quantity];
    const x = keys[this.x];
    return {
      xaxis: this.axisOfKey(x, this.isLog("x")),
      yaxis: frictionsim.numberAxis(frictionsim.label(frictionsim.withUnit(name, unit)), this.isLog("y"), values),
      yaxis2: { overlaying: "y", range: [0, 1], visible: false, fixedrange: true },
    };
  }

  curves() {
    const places = this.places();
    const sound = this.sound(places).sort((a, b) => this.data.keys[this.x].codes[a] - this.data.keys[this.x].codes[b]);
    const key = this.data.keys[this.second];
    const codes = key ? [...new Set(places.map((place) => key.codes[place]))].sort((a, b) => a - b) : [null];
    const shown = codes.slice(0, frictionsim.MAX_CURVES);
    const traces = shown.map((code, number) => {
      const { colour, symbol, dash } = frictionsim.lineStyle(number);
      const found = code === null ? sound : sound.filter((place) => key.codes[place] === code);
      return this.points(code === null ? "done" : frictionsim.label(this.valueText(key, code)), found, {
        mode: this.data.keys[this.x].numeric ? (found.length > 200 ? "lines" : "lines+markers") : "markers", line: { color: colour, dash, width: 1.6 }, marker: { color: colour, symbol, size: 7, line: { color: frictionsim.colour("text"), width: 0.7 } },
      });
    });
    const note = codes.length > shown.length ? `The first ${shown.length} of ${codes.length} curves are drawn.` : "";
    return [[...traces, ...this.doubtful(places), ...this.marks(places)], { ...this.axes(), legend: { title: { text: key ? frictionsim.label(frictionsim.withUnit(key.name, key.unit)) : "" } } }, note];
  }

  map() {
    const [x, y] = [this.data.keys[this.x], this.data.keys[this.second]];
    const places = this.places();
    const z = Array.from(y.values, () => new Array(x.values.length).fill(null));
    const at = Array.from(y.values, () => new Array(x.values.length).fill(null));
    const words = Array.from(y.values, () => new Array(x.values.length).fill(""));
    for (const place of places) {
      const [row, column] = [y.codes[place], x.codes[place]];
      [at[row][column], words[row][column]] = [place, this.words(place)];
      const status = this.data.status[place];
      if ((status === frictionsim.DONE || status === frictionsim.AUDIT_FAILED) && !Number.isNaN(this.value(place))) z[row][column] = this.value(place);
    }
    const texts = (key) => (key.numeric ? Array.from(key.values) : key.values.map((text) => frictionsim.label(text)));
    const { name, unit } = this.data.quantities[this.quantity];
    const heat = {
      type: "heatmap", x: texts(x), y: texts(y), z, customdata: at, hovertext: words, hoverinfo: "text", colorscale: "Cividis",
      colorbar: { title: { text: frictionsim.label(frictionsim.withUnit(name, unit), 40), side: "right" } },
    };
    const height = (place) => this.onAxis(this.second, place);
    const doubtful = this.doubtful(places).map((trace) => ({ ...trace, y: trace.customdata.map(height), marker: { ...trace.marker, color: "#d55e00" } }));
    const layout = this.axes();
    layout.yaxis = this.axisOfKey(y, y.log);
    return [[heat, ...doubtful, ...this.marks(places, height)], layout, "Empty cells have no value."];
  }

  scatter() {
    const places = this.places();
    const key = this.data.keys[this.second];
    const found = this.sound(places);
    const marker = { size: 6, color: frictionsim.colour("accent"), opacity: 0.75 };
    if (key) Object.assign(marker, {
      color: found.map((place) => (key.numeric ? this.valueOf(this.second, place) : key.codes[place])), colorscale: "Cividis", showscale: true,
      colorbar: { title: { text: frictionsim.label(frictionsim.withUnit(key.name, key.unit), 40), side: "right" }, ...(key.numeric ? {} : { tickvals: [...key.values.keys()], ticktext: key.values.map((text) => frictionsim.label(text, 30)) }) },
    });
    const note = key && !key.numeric ? "Colours stand for the values of a key of text." : "";
    return [[this.points("done", found, { marker }), ...this.doubtful(places), ...this.marks(places)], this.axes(), note];
  }

  histogram() {
    const { name, unit, sample: found } = this.data.quantities[this.quantity];
    const layout = { xaxis: frictionsim.axis(frictionsim.label(frictionsim.withUnit(name, unit))), yaxis: frictionsim.axis("runs") };
    if (!found) return [[], layout, "This quantity is not defined in any run."];
    const edges = Array.from(found.edges);
    const bar = {
      type: "bar", name: "runs", x: edges.slice(1).map((edge, i) => (edge + edges[i]) / 2), y: Array.from(found.counts), width: edges.slice(1).map((edge, i) => edge - edges[i]),
      marker: { color: "#56b4e9", line: { color: frictionsim.colour("text"), width: 0.5 } },
      hovertext: edges.slice(1).map((edge, i) => frictionsim.label(`${found.counts[i]} runs from ${frictionsim.shown(edges[i])} to ${frictionsim.shown(edge)} ${unit === "1" ? "" : unit}`)), hoverinfo: "text",
    };
    const top = Math.max(...found.counts);
    const line = (words, value, dash) => ({ type: "scatter", name: `${words} ${frictionsim.shown(value, 5)}`, x: [value, value], y: [0, top], mode: "lines", hoverinfo: "name", line: { dash, width: 2, color: frictionsim.colour("text") } });
    const lines = [line("mean", found.mean, "solid"), line("5 %", found.low, "dot"), line("50 %", found.median, "dash"), line("95 %", found.high, "dot")];
    return [[bar, ...lines], layout, `From ${found.defined} independent runs in which it is defined.`];
  }

  indices() {
    const found = this.data.quantities[this.quantity].indices;
    if (!found) return [[], {}, "This quantity does not vary, or is not one of the first that do: it has no Sobol indices here."];
    if (!found.first.length) return [[], {}, found.basis];
    const order = [...found.keys.keys()].sort((a, b) => found.total[a] - found.total[b]);
    const bar = (words, values, interval, colour, pattern) => ({
      type: "bar", orientation: "h", name: words, y: order.map((i) => frictionsim.label(found.keys[i], 50)), x: order.map((i) => values[i]), marker: { color: colour, pattern: { shape: pattern }, line: { color: frictionsim.colour("text"), width: 0.6 } },
      ...(interval ? { error_x: { type: "data", symmetric: false, color: frictionsim.colour("text"), array: order.map((i) => interval[2 * i + 1] - values[i]), arrayminus: order.map((i) => values[i] - interval[2 * i]) } } : {}),
    });
    return [[bar("first-order index", found.first, found.first_interval, "#0072b2", ""), bar("total index", found.total, found.total_interval, "#56b4e9", "/")],
      { xaxis: frictionsim.axis("part of the variance"), yaxis: frictionsim.axis("", { type: "category" }) }, found.basis];
  }

  draw() {
    const controls = document.getElementById("controls");
    const focused = document.activeElement?.name;
    controls.replaceChildren(...this.controls());
    controls.hidden = false;
    if (focused && controls.elements[focused]) controls.elements[focused].focus();
    const [traces, layout, note] = this[this.view]();
    document.getElementById("note").textContent = note;
    return frictionsim.show(traces, layout);
  }

  // The values of keys and quantities of a run, below the chart.
  showRun(run) {
    const { keys, quantities, runs, status, statuses, reasons, warnings } = this.data;
    const place = runs.indexOf(run);
    const panel = document.getElementById("run");
    if (place < 0) {
      panel.textContent = Number.isInteger(run) && run >= 0 && run < this.data.all ? `Run ${run} is not in this page; frictionsim show FILE --csv prints all runs.` : `There is no such run; the sweep has the runs 0 to ${this.data.all - 1}.`;
      return;
    }
    const list = document.createElement("dl");
    const add = (words, value) => {
      const [term, detail] = [document.createElement("dt"), document.createElement("dd")];
      [term.textContent, detail.textContent] = [frictionsim.visible(words), frictionsim.visible(value)];
      list.append(term, detail);
    };
    add("outcome", statuses[status[place]]);
    if (reasons[place]) add("reason", reasons[place]);
    if (warnings[place]) add("warnings", warnings[place]);
    for (const key of keys) add(key.name, this.valueText(key, key.codes[place]));
    for (const { name, unit, values } of quantities) add(name, `${frictionsim.shown(values[place], 10)} ${unit === "1" ? "" : unit}`);
    const heading = document.createElement("h3");
    heading.textContent = `Run ${run}`;
    panel.replaceChildren(heading, list);
    frictionsim.mark(frictionsim.rowsOf("runs").find((row) => Number(row.cells[0].dataset.value) === run));
  }
};

frictionsim.startStudy((data) => {
  frictionsim.sweep = new frictionsim.Sweep(data);
  frictionsim.sweep.start();
});
