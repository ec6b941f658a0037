"use strict";
// A value along a belt at the time of the clock, as its tension.

frictionsim.BeltChart = class {
  constructor(container, motion, label, clock, theme) {
    [this.motion, this.band, this.last, this.seen] = [motion, frictionsim.BeltChart.bandOf(motion), -1, false];
    const { element } = frictionsim;
    const { quantity, name, unit } = this.band;
    this.words = quantity || name;
    this.unit = unit ? `, ${frictionsim.unit(unit)}` : "";
    this.plot = element("div", { class: "plot", role: "img", "aria-label": `${this.words} along the belt at the time of the clock` });
    this.chart = new frictionsim.Plot(this.plot);
    const heading = `${this.words} along the belt${label ? `, ${label}` : ""}${this.unit}, at the time of the clock`;
    this.details = element("details", { class: "chart along-belt", open: true, ontoggle: () => this.show(true) }, element("summary", {}, heading),
      element("p", { class: "note" }, "Bars at the bottom: the belt touches a pulley (thin), and sticks to it (thick)."), this.plot);
    container.insertBefore(this.details, container.querySelector(".chart:not([open])"));
    // Outside of the window it is not drawn.
    new IntersectionObserver(([{ isIntersecting }]) => { this.seen = isIntersecting; this.show(true); }).observe(this.plot);
    addEventListener("beforeprint", () => { this.seen = true; this.show(true); });
    theme.follow((dark) => { this.dark = dark; this.draw(); });
    clock.follow((time) => { this.time = time; this.show(false); });
    clock.followState(() => this.show(true));
  }

  static bandOf(motion) {
    return motion?.parts.find((part) => part.type === "Band" && part.value);
  }

  draw() {
    const colours = frictionsim.chartColours(this.dark);
    const axis = { color: colours.text, gridcolor: colours.grid, linecolor: colours.axis, zerolinecolor: colours.axis, showline: true };
    const [low, high] = frictionsim.extent(this.band.value);
    const room = 0.08 * (high - low || Math.abs(high) || 1);
    const layout = {
      height: 200, separators: ".", margin: { l: 72, r: 12, t: 8, b: 38 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: 12, color: colours.text }, showlegend: false, hovermode: "closest",
      hoverlabel: { bgcolor: colours.hover, bordercolor: colours.axis, font: { color: colours.text } },
      xaxis: { ...axis, title: { text: "distance along the belt from where body 0 is at first, m", standoff: 4 } },
      yaxis: { ...axis, title: { text: frictionsim.plain(this.words + this.unit), standoff: 6 }, range: [low - 2 * room, high + room], automargin: true },
    };
    const [line, touch, stick] = [0, 5, 1].map((number) => frictionsim.display[this.dark ? "dark" : "light"].lines[number]);
    const trace = (color, width) => ({ type: "scatter", mode: "lines", x: [], y: [], line: { color, width } });
    this.floor = low - 1.5 * room;
    this.chart.draw([trace(line, 1.6), { ...trace(touch, 1.5), hoverinfo: "skip" }, { ...trace(stick, 5), hoverinfo: "skip" }], layout);
    this.show(true);
  }

  // A few times a second while the clock runs: a chart takes longer than a drawing.
  show(now) {
    if (this.time === undefined || !this.seen || !this.details.open) return;
    const at = performance.now();
    clearTimeout(this.later);
    if (this.chart.pending || (!now && at - this.last < frictionsim.BeltChart.MILLISECONDS)) {
      this.later = setTimeout(() => this.show(true), frictionsim.BeltChart.MILLISECONDS);
      return;
    }
    this.last = at;
    const { x, y, touching, sticking } = this.along();
    this.chart.restyle({ x: [x, x, x], y: [y, touching, sticking] });
  }

  // Values by distance from where point 0 is at the start: a place that stays where it is.
  along() {
    const { x, y, value, touching, sticking } = this.band;
    const count = x.shape[1];
    const first = Math.max(frictionsim.lastUpTo(this.motion.time, this.time), 0) * count;
    let nearest = 0;
    const away = (i) => (x[first + i] - x[0]) ** 2 + (y[first + i] - y[0]) ** 2;
    for (let i = 1; i < count; i++) if (away(i) < away(nearest)) nearest = i;
    const found = { x: [], y: [], touching: [], sticking: [] };
    let distance = 0;
    for (let k = 0; k < count; k++) {
      const i = first + (nearest + k) % count;
      const before = first + (nearest + k + count - 1) % count;
      if (k) distance += Math.hypot(x[i] - x[before], y[i] - y[before]);
      found.x.push(distance);
      found.y.push(value[i]);
      found.touching.push(touching?.[i] ? this.floor : NaN);
      found.sticking.push(sticking?.[i] ? this.floor : NaN);
    }
    return found;
  }
};
frictionsim.BeltChart.MILLISECONDS = 150;

frictionsim.extent = (values) => {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return low <= high ? [low, high] : [0, 1];
};
