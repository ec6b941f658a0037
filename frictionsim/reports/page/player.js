"use strict";
// The motion of the drawings, one clock for them and for the charts, and tables that sort.

const byId = (id) => document.getElementById(id);
const charts = [];
const CHART = { // no button sends data anywhere, whatever the version of Plotly calls it
  displaylogo: false, responsive: true, displayModeBar: "hover",
  plotlyServerURL: "", showSendToCloud: false, showEditInChartStudio: false,
  modeBarButtonsToRemove: ["select2d", "lasso2d", "sendChartToCloud", "sendDataToCloud", "editInChartStudio"],
};
const frictionsim = { ready: false, time: 0 };

// The number of the last of increasing times that is not after t.
const lastUpTo = (times, t) => {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1; else high = middle;
  }
  return Math.max(low - 1, 0);
};

const unpacked = async (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return JSON.parse(await new Response(stream).text());
};

// A function that shows a drawing at a time: it sets what changes from frame to frame.
const drawing = ({ time, tracks }) => {
  const moves = tracks.map(([ids, name, values]) => {
    const elements = ids.map(byId);
    if (name === "text") return (i) => { elements[0].textContent = values[i]; };
    return (i) => { for (const element of elements) element.setAttribute(name, values[i]); };
  });
  let frame = -1;
  return (t) => {
    const next = lastUpTo(time, t);
    if (next !== frame) for (const move of moves) move(frame = next);
  };
};

const withClock = ({ steps, events, drawings }) => {
  const [start, end] = [steps[0], steps.at(-1)];
  const shows = drawings.map(drawing);
  const [slider, play, shown, speed] = ["time", "play", "shown", "speed"].map(byId);
  const decimals = Math.max(0, 3 - Math.floor(Math.log10(end - start || 1)));
  const rows = [...document.querySelectorAll("#events tr:has(button)")];
  const timed = []; // the charts over time
  let last = null, moved = -Infinity;

  const moveCursors = (t) => timed.forEach((chart) => { // Plotly takes longer than a frame
    const shape = `shapes[${chart.layout.shapes.length - 1}]`; // the last one is the cursor
    if (chart.offsetParent && chart.layout.shapes.at(-1).x0 !== t) Plotly.relayout(chart, { [`${shape}.x0`]: t, [`${shape}.x1`]: t });
  });
  const show = (t, now = Infinity) => {
    frictionsim.time = slider.value = t = Math.min(Math.max(t, start), end);
    shown.textContent = `${t.toFixed(decimals)} of ${Number(end.toPrecision(6))} s`;
    for (const draw of shows) draw(t);
    if (now - moved > 150) {
      moveCursors(t);
      moved = now === Infinity ? -Infinity : now;
    }
    for (const row of rows) row.toggleAttribute("aria-current", Number(row.querySelector("button").dataset.time) === t);
  };
  const stop = () => { last = null; play.textContent = "play"; };
  const tick = (now) => {
    if (last === null) return;
    const t = frictionsim.time + Number(speed.value) * Math.max(now - last, 0) / 1000;
    last = now;
    if (t >= end) { stop(); show(end); } else { show(t, now); requestAnimationFrame(tick); }
  };
  const toggle = () => {
    if (last !== null) { stop(); show(frictionsim.time); return; }
    if (frictionsim.time >= end) show(start);
    last = performance.now();
    play.textContent = "pause";
    requestAnimationFrame(tick);
  };
  const jump = (t) => { if (t !== undefined) { stop(); show(t); } };
  const along = (times, way) => way > 0 ? times.find((t) => t > frictionsim.time) : times.findLast((t) => t < frictionsim.time);

  for (const factor of [100, 10, 5, 2, 1, 0.5, 0.2, 0.1, 0.01, 0.001]) speed.add(new Option(`${factor} ×`, factor));
  const wanted = (end - start) / 12; // of a run of which nobody has chosen the speed
  speed.value = [...speed.options].map((one) => one.value).find((factor) => factor <= wanted) ?? 0.001;
  [slider.min, slider.max] = [start, end];
  play.addEventListener("click", toggle);
  slider.addEventListener("input", () => jump(Number(slider.value)));
  byId("back").addEventListener("click", () => jump(along(events, -1)));
  byId("ahead").addEventListener("click", () => jump(along(events, 1)));
  for (const row of rows) row.querySelector("button").addEventListener("click", (event) => jump(Number(event.target.dataset.time)));
  document.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.target.matches("input, select, summary") || !(way || event.key === " ")) return;
    event.preventDefault();
    if (way) jump(along(event.shiftKey ? events : steps, way)); else toggle();
  });
  frictionsim.follow = (chart) => {
    if (chart.layout.shapes?.at(-1)?.name !== "cursor") return;
    timed.push(chart);
    chart.on("plotly_click", ({ points }) => jump(points[0].x));
    chart.on("plotly_relayout", (change) => { // they share one time
      const range = change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]];
      if (range[0] === undefined) return;
      for (const other of timed) {
        const now = other.layout.xaxis.range;
        if (other !== chart && (now[0] !== range[0] || now[1] !== range[1])) Plotly.relayout(other, { "xaxis.range": [...range] });
      }
    });
    moveCursors(frictionsim.time);
  };
  Object.assign(frictionsim, { show: jump, start, end });
  show(start);
};

// Each heading of a table of a study becomes a button that sorts by its column: numbers by their
// values, those that are none at the end, texts by their letters.
const makeSortable = (table) => [...table.tHead.rows[0].cells].forEach((heading, column) => {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: heading.textContent });
  heading.replaceChildren(button);
  const key = ({ cells }) => {
    const text = cells[column].dataset.value;
    return text === undefined ? cells[column].textContent : ({ inf: Infinity, "-inf": -Infinity })[text] ?? Number(text);
  };
  button.addEventListener("click", () => {
    const way = heading.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
    for (const other of heading.parentNode.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", way);
    const compare = (a, b) => {
      if (typeof a === "string" || typeof b === "string") return String(a).localeCompare(String(b));
      return a === b ? 0 : a < b ? -1 : 1;
    };
    const sign = way === "ascending" ? 1 : -1;
    const rows = [...table.tBodies[0].rows].map((row) => [key(row), row]);
    rows.sort(([a], [b]) => Number.isNaN(a) - Number.isNaN(b) || sign * compare(a, b) || 0);
    table.tBodies[0].append(...rows.map(([, row]) => row));
  });
});

// A chart that is folded away is drawn when it is seen first; one that is printed has its own width.
const draw = async (id, { data, layout }) => {
  const chart = await Plotly.newPlot(id, data, layout, CHART);
  charts.push(chart);
  frictionsim.follow?.(chart);
};
const resized = (width) => charts.forEach((chart) => Plotly.relayout(chart, { width, autosize: !width }));
window.addEventListener("beforeprint", () => resized(680));
window.addEventListener("afterprint", () => resized(undefined));
document.querySelectorAll("table.study").forEach(makeSortable);
unpacked(byId("data").textContent).then(async (data) => {
  if (data.steps) withClock(data);
  for (const [id, figure] of Object.entries(data.charts ?? {})) {
    const folded = byId(id).closest("details");
    if (folded) folded.addEventListener("toggle", () => draw(id, figure), { once: true });
    else await draw(id, figure);
  }
  frictionsim.ready = true;
});
