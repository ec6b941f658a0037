"use strict";
// Belts and cords of a drawing, with colours for their tension, and stick and slip on pulleys.

frictionsim.BINS = 64; // colours of a belt; the pieces of one colour are drawn at once

frictionsim.colourAt = (fraction) => {
  const place = Math.min(Math.max(fraction, 0), 1) * (frictionsim.display.tension.length - 1);
  const low = Math.min(Math.floor(place), frictionsim.display.tension.length - 2);
  const [a, b] = [low, low + 1].map((i) => frictionsim.display.tension[i]);
  const mixed = [1, 3, 5].map((i) => {
    const [from, to] = [a, b].map((colour) => parseInt(colour.slice(i, i + 2), 16));
    return Math.round(from + (place - low) * (to - from));
  });
  return `rgb(${mixed.join(", ")})`;
};
frictionsim.BELT = { width: 7, edge: 1.2, strip: 2.6, halo: 1.2, tick: 7, cord: 3 }; // px

frictionsim.DrawnBand = class {
  constructor(band) {
    this.band = band;
    this.count = band.x.shape[1];
    [this.x, this.y] = [new Float64Array(this.count), new Float64Array(this.count)];
    if (band.value) {
      let [low, high] = [Infinity, -Infinity];
      for (const value of band.value) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
      this.range = [low, high];
      this.bins = new Int32Array(this.count);
    }
    this.palette = Array.from({ length: frictionsim.BINS }, (_, i) => frictionsim.colourAt(i / (frictionsim.BINS - 1)));
  }

  // Take the positions and colours at a time.
  move(frame, fraction) {
    const { band, count, x, y } = this;
    const [here, next] = [frame * count, (frame + (fraction > 0)) * count];
    for (let i = 0; i < count; i++) {
      x[i] = band.x[here + i] + fraction * (band.x[next + i] - band.x[here + i]);
      y[i] = band.y[here + i] + fraction * (band.y[next + i] - band.y[here + i]);
    }
    if (!band.value) return;
    const [low, high] = this.range;
    const scale = high > low ? (frictionsim.BINS - 1) / (high - low) : 0;
    for (let i = 0; i < count; i++) {
      const value = band.value[here + i] + fraction * (band.value[next + i] - band.value[here + i]);
      this.bins[i] = Math.round(scale * (value - low));
    }
  }

  line(context) {
    context.beginPath();
    for (let i = 0; i < this.count; i++) context.lineTo(this.x[i], this.y[i]);
    if (this.band.closed) context.closePath();
  }

  draw(pen, frame, at) {
    if (this.band.value || this.band.touching) this.drawBelt(pen, frame);
    else this.drawCord(pen, at);
  }

  drawCord({ context, colours, px }, at) {
    const { travel, spacing, closed, role } = this.band;
    const width = frictionsim.BELT.cord * px;
    context.lineJoin = "round";
    context.lineCap = "butt";
    context.strokeStyle = role ? colours[role] : colours.edge;
    context.lineWidth = width;
    this.line(context);
    context.stroke();
    if (!travel || closed || !(spacing > 0)) return;
    context.lineWidth = 3 * width;
    context.setLineDash([width, spacing - width]);
    context.lineDashOffset = -(at(travel) % spacing);
    context.stroke();
    context.setLineDash([]);
  }

  drawBelt(pen, frame) {
    const { context, colours, px, thick } = pen;
    const { width, edge } = frictionsim.BELT;
    const belt = width * thick * px;
    context.lineJoin = context.lineCap = "round";
    if (this.band.patch) this.drawPatch(pen, belt);
    this.drawMarks(pen);
    context.strokeStyle = colours.edge;
    context.lineWidth = belt + 2 * edge * px;
    this.line(context);
    context.stroke();
    context.lineWidth = belt;
    if (this.bins) this.drawValues(context);
    else {
      context.strokeStyle = colours.moving;
      context.stroke();
    }
    if (this.band.touching) this.drawContact(pen, frame);
  }

  drawValues(context) {
    const { bins, count, x, y } = this;
    if (!this.order) this.order = new Int32Array(count);
    const starts = new Int32Array(frictionsim.BINS + 1);
    for (let i = 0; i < count; i++) starts[bins[i] + 1]++;
    for (let bin = 0; bin < frictionsim.BINS; bin++) starts[bin + 1] += starts[bin];
    const next = starts.slice();
    for (let i = 0; i < count; i++) this.order[next[bins[i]]++] = i;
    for (let bin = 0; bin < frictionsim.BINS; bin++) {
      if (starts[bin] === starts[bin + 1]) continue;
      context.beginPath();
      let last = -2;
      for (let k = starts[bin]; k < starts[bin + 1]; k++) {
        const i = this.order[k];
        if (i === 0 && !this.band.closed) continue;
        const before = i ? i - 1 : count - 1;
        if (last !== before) context.moveTo(x[before], y[before]);
        context.lineTo(x[i], y[i]);
        last = i;
      }
      context.strokeStyle = this.palette[bin];
      context.stroke();
    }
  }

  // Lines from half-way before to half-way behind the points of one kind.
  halves(context, wanted) {
    const { count, x, y } = this;
    context.beginPath();
    for (let i = 0; i < count; i++) {
      if (!wanted(i)) continue;
      const [before, behind] = [i ? i - 1 : count - 1, i + 1 < count ? i + 1 : 0];
      context.moveTo(0.5 * (x[before] + x[i]), 0.5 * (y[before] + y[i]));
      context.lineTo(x[i], y[i]);
      context.lineTo(0.5 * (x[behind] + x[i]), 0.5 * (y[behind] + y[i]));
    }
  }

  // A strip on the belt: black with a white edge where it sticks, white with a black one where not.
  drawContact({ context, px, thick }, frame) {
    const { touching, sticking } = this.band;
    const { strip, halo } = frictionsim.BELT;
    const first = frame * this.count;
    const { sticks, slips } = frictionsim.display.beltContact;
    context.lineCap = "butt";
    for (const [stuck, { core, around }] of [[1, sticks], [0, slips]]) {
      this.halves(context, (i) => touching[first + i] && (sticking ? sticking[first + i] : 0) === stuck);
      for (const [colour, wide] of [[around, strip + halo], [core, strip]]) {
        context.strokeStyle = colour;
        context.lineWidth = wide * thick * px;
        context.stroke();
      }
    }
  }

  drawPatch({ context, colours, px, thick }, belt) {
    context.lineCap = "butt";
    context.strokeStyle = colours.friction;
    context.lineWidth = belt + 9 * thick * px;
    this.halves(context, (i) => this.band.patch[i]);
    context.stroke();
    context.lineCap = "round";
  }

  // Ticks across the belt at marked points, so that the eye sees it run.
  drawMarks({ context, colours, px, thick }) {
    const { count, x, y } = this;
    const reach = frictionsim.BELT.tick * thick * px;
    context.beginPath();
    for (const i of this.band.marks ?? []) {
      const [before, behind] = [i ? i - 1 : count - 1, i + 1 < count ? i + 1 : 0];
      const [dx, dy] = [x[behind] - x[before], y[behind] - y[before]];
      const scale = reach / Math.max(Math.hypot(dx, dy), Number.MIN_VALUE);
      context.moveTo(x[i] - scale * dy, y[i] + scale * dx);
      context.lineTo(x[i] + scale * dy, y[i] - scale * dx);
    }
    context.strokeStyle = colours.edge;
    context.lineWidth = 1.6 * thick * px;
    context.stroke();
  }

  pose(frame) {
    const { band, count } = this;
    const counted = (flags) => {
      if (!flags) return null;
      let found = 0;
      for (let i = 0; i < count; i++) found += flags[frame * count + i];
      return found;
    };
    return {
      name: band.name, x: Array.from(this.x.slice(0, 5)), y: Array.from(this.y.slice(0, 5)),
      touching: counted(band.touching), sticking: counted(band.sticking),
    };
  }
};
