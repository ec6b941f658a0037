"use strict";
// What the pages of costs and of sweeps share: colours, labels, controls and sortable tables.

// Okabe and Ito, safe for colour-blind readers; marks and dashes differ too, for grey print.
frictionsim.LINE_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "", "#aa4499"];
frictionsim.SYMBOLS = ["circle", "square", "triangle-up", "diamond", "triangle-down", "cross", "star", "pentagon", "hexagon", "bowtie"];
frictionsim.DASHES = ["solid", "dash", "dashdot", "dot", "longdash", "longdashdot", "2px,2px"];

frictionsim.colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

frictionsim.lineStyle = (number) => {
  const of = (list) => list[number % list.length];
  return { colour: of(frictionsim.LINE_COLOURS) || frictionsim.colour("text"), symbol: of(frictionsim.SYMBOLS), dash: of(frictionsim.DASHES) };
};

// Plotly takes some markup in texts for its own: what comes from files stays text.
frictionsim.label = (text, limit = 80) => {
  const cut = text.length > limit ? `${text.slice(0, limit)}…` : text;
  return frictionsim.visible(cut).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
};

// Control characters and marks that change the direction of writing, as escapes.
frictionsim.visible = (text) => text.replace(
  /[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/g,
  (found) => `\\u${found.charCodeAt(0).toString(16).padStart(4, "0")}`);

frictionsim.shown = (value, digits = 6) =>
  value === null || Number.isNaN(value) ? "none" : String(Number(value.toPrecision(digits))).replaceAll("-", "\u2212");

frictionsim.withUnit = (words, unit) => (unit && unit !== "1" ? `${words}, ${unit}` : words);

frictionsim.axis = (title, more = {}) => ({
  title: { text: title }, automargin: true, zeroline: false, linecolor: frictionsim.colour("faint"),
  gridcolor: frictionsim.colour("rule"), exponentformat: "e", ...more,
});

// Of a logarithmic axis: powers of ten alone, where its range has several of them.
frictionsim.logTicks = (low, high) => ({ dtick: high - low >= 2 ? 1 : null, exponentformat: "power" });

// A logarithmic axis over values; `followZoom` adapts its labels.
frictionsim.logAxis = (title, values) => {
  const exponents = Array.from(values).filter((value) => value > 0 && value < Infinity).map(Math.log10);
  const [low, high] = exponents.reduce(([least, most], each) => [Math.min(least, each), Math.max(most, each)], [Infinity, -Infinity]);
  return frictionsim.axis(title, { type: "log", ...frictionsim.logTicks(low, high) });
};

frictionsim.numberAxis = (title, log, values) => (log ? frictionsim.logAxis(title, values) : frictionsim.axis(title, { type: "linear" }));

frictionsim.followZoom = (chart) => {
  const changed = {};
  for (const name of ["xaxis", "yaxis"]) {
    const { type, range } = chart._fullLayout[name];
    if (type !== "log") continue;
    const wanted = frictionsim.logTicks(...range).dtick;
    if ((wanted === 1) !== (chart.layout[name].dtick === 1)) changed[`${name}.dtick`] = wanted;
  }
  if (Object.keys(changed).length) frictionsim.plot.then(() => Plotly.relayout(chart, changed));
};

frictionsim.layout = (more) => ({
  paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
  font: { color: frictionsim.colour("text"), family: "system-ui, sans-serif" },
  hoverlabel: { align: "left", bgcolor: frictionsim.colour("panel"), font: { color: frictionsim.colour("text") } },
  margin: { t: 30, r: 20, b: 50 }, hovermode: "closest", ...more,
  legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", ...more.legend },
});

frictionsim.show = (traces, layout) => {
  const chart = document.getElementById("chart");
  const first = !frictionsim.plot;
  chart.classList.add("drawn");
  frictionsim.plot ??= new frictionsim.Plot(chart);
  return frictionsim.plot.draw(traces, frictionsim.layout(layout)).then(() => {
    if (first) chart.on("plotly_relayout", () => frictionsim.followZoom(chart));
  });
};

// A select with its label; options are pairs of a value and a text.
frictionsim.select = (name, label, options, value, change) => {
  const outer = document.createElement("label");
  const select = document.createElement("select");
  select.name = name;
  for (const [key, text] of options) select.append(new Option(frictionsim.visible(text.slice(0, 80)), key, false, String(key) === String(value)));
  select.addEventListener("change", () => change(select.value));
  outer.append(label, select);
  return outer;
};

frictionsim.check = (name, label, value, change) => {
  const outer = document.createElement("label");
  const input = document.createElement("input");
  [input.type, input.name, input.checked] = ["checkbox", name, value];
  input.addEventListener("change", () => change(input.checked));
  outer.append(input, label);
  return outer;
};

// Each heading of a table becomes a button that sorts by its column.
frictionsim.makeSortable = (table) => {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    const button = document.createElement("button");
    [button.type, button.textContent] = ["button", heading.textContent];
    heading.replaceChildren(button);
    button.addEventListener("click", () => {
      const descending = heading.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
      frictionsim.sort(table, column, descending);
    });
  });
};

// Numbers by their values, those that are none at the end; texts by their letters.
frictionsim.sort = (table, column, descending) => {
  const sign = descending ? -1 : 1;
  const key = (row) => {
    const cell = row.cells[column];
    return "value" in cell.dataset ? frictionsim.parsed(cell.dataset.value) : cell.textContent;
  };
  const compare = (a, b) => {
    if (typeof a === "string") return sign * a.localeCompare(b);
    if (Number.isNaN(a) || Number.isNaN(b)) return Number.isNaN(a) - Number.isNaN(b);
    return a === b ? 0 : a < b ? -sign : sign;
  };
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => [key(row), row]);
  rows.sort(([a], [b]) => compare(a, b));
  body.append(...rows.map(([, row]) => row));
};

frictionsim.parsed = (text) => ({ inf: Infinity, "-inf": -Infinity })[text] ?? Number(text);

// Rows of a table in the order in which the file has them.
frictionsim.rowsOf = (id) => [...(document.getElementById(id)?.tBodies[0].rows ?? [])];

frictionsim.mark = (row) => {
  for (const other of document.querySelectorAll("tr[aria-current]")) other.removeAttribute("aria-current");
  if (!row) return;
  row.setAttribute("aria-current", "true");
  row.scrollIntoView({ block: "nearest" });
};

// Draws again where the colours change: of the system, or by the attribute of the page.
frictionsim.followColours = (draw) => {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  new MutationObserver(draw).observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
};

frictionsim.startStudy = async (build) => {
  try {
    frictionsim.data = await frictionsim.load();
    frictionsim.theme = new frictionsim.Theme();
    document.getElementById("tools").append(frictionsim.theme.button());
    await build(frictionsim.data);
    frictionsim.ready = true;
  } catch (error) {
    document.getElementById("message").textContent = `The charts cannot be shown: ${error.message}`;
    throw error;
  }
};
