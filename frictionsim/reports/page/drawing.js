"use strict";
// A motion on a canvas, at any time, with a key and read-outs beside it.

frictionsim.MAX_HEIGHT = 460; // px, of the whole drawing
frictionsim.MIN_HEIGHT = 110;
frictionsim.DETAIL = 260; // px, at most, of the side of a detail
frictionsim.CAPTION = 20; // px, above a detail

frictionsim.Drawing = class {
  // The canvas is put into `element`, a figure that takes its place in the page. `lineOf` returns
  // the line of a chart that a read-out is of, with its times, or nothing.
  constructor(canvas, motion, lineOf = () => null) {
    [this.canvas, this.motion, this.time, this.lineOf] = [canvas, motion, motion.time[0], lineOf];
    this.context = canvas.getContext("2d");
    this.bands = motion.parts.filter((part) => part.type === "Band").map((part) => new frictionsim.DrawnBand(part));
    this.trails = new Map(motion.parts.filter((part) => part.type === "Trail")
      .map((part) => [part, new frictionsim.DrawnTrail(part)]));
    this.build();
    this.readColours();
    const scheme = () => { this.readColours(); this.draw(this.time); };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", scheme);
    new MutationObserver(scheme).observe(document.documentElement, { attributeFilter: ["data-theme"] });
    new ResizeObserver(() => this.draw(this.time)).observe(this.view);
  }

  build() {
    const { canvas } = this;
    this.element = document.createElement("figure");
    this.element.className = "drawing";
    canvas.replaceWith(this.element);
    this.view = document.createElement("div");
    this.view.className = "drawing-view";
    this.view.append(canvas);
    this.panel = new frictionsim.DrawingPanel(this.motion, this.bands, this.lineOf);
    this.element.append(this.view, this.panel.element);
    const [left, right, bottom, top] = this.motion.bounds;
    this.element.classList.toggle("wide", right - left > 1.6 * (top - bottom));
    canvas.setAttribute("role", "img");
    const names = this.motion.parts.map((part) => part.name).filter((name) => name);
    canvas.setAttribute("aria-label", `Moving drawing of ${names.join(", ")}. Its numbers are beside it as text.`);
  }

  readColours() {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(name).trim();
    this.colours = Object.fromEntries(frictionsim.display.roles.map((role) => [role, read(`--role-${role}`)]));
    for (const name of ["edge", "faint"]) this.colours[name] = read(`--drawing-${name}`);
    this.font = getComputedStyle(document.body).fontFamily;
    this.panel.drawKey(this.colours);
  }

  // Sizes of canvas and views, in CSS pixels: the whole drawing, below it its details.
  layout() {
    const width = Math.max(this.view.clientWidth || this.canvas.clientWidth, 40);
    const ratio = window.devicePixelRatio || 1;
    if (width === this.width && ratio === this.ratio) return;
    [this.width, this.ratio] = [width, ratio];
    const [left, right, bottom, top] = this.motion.bounds;
    const wanted = width * (top - bottom) / (right - left);
    // On a low screen the drawing leaves room for its numbers.
    const highest = Math.min(frictionsim.MAX_HEIGHT, Math.max(0.48 * window.innerHeight, 220));
    const height = Math.min(Math.max(wanted, frictionsim.MIN_HEIGHT), highest);
    this.views = [this.viewOf(this.motion.bounds, 0, 0, width, height)];
    const { details } = this.motion;
    const side = Math.min(frictionsim.DETAIL, width / Math.max(details.length, 1));
    const gap = (width - side * details.length) / (details.length + 1);
    details.forEach(({ name, bounds }, i) => this.views.push({
      ...this.viewOf(bounds, gap + i * (side + gap), height + frictionsim.CAPTION, side, side), name, clipped: true,
    }));
    const whole = height + (details.length ? side + frictionsim.CAPTION : 0);
    this.canvas.style.height = `${whole}px`;
    [this.canvas.width, this.canvas.height] = [Math.round(width * ratio), Math.round(whole * ratio)];
  }

  viewOf([left, right, bottom, top], x, y, width, height) {
    const scale = Math.min(width / (right - left), height / (top - bottom));
    return {
      x, y, width, height, scale,
      originX: x + 0.5 * (width - scale * (left + right)), originY: y + 0.5 * (height + scale * (bottom + top)),
    };
  }

  // The frame before a time, and how far the time is from it to the next one.
  place(time) {
    return frictionsim.placeIn(this.motion.time, time);
  }

  // A function that gives a number per frame at a time: linear in it.
  at(time) {
    const [frame, fraction] = this.place(time);
    return (values) => (fraction ? values[frame] + fraction * (values[frame + 1] - values[frame]) : values[frame]);
  }

  draw(time) {
    this.time = time;
    this.layout();
    const [frame, fraction] = this.place(time);
    const at = this.at(time);
    for (const band of this.bands) band.move(frame, fraction);
    const { context, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.canvas.height / ratio);
    for (const view of this.views) this.drawView(view, frame, at);
    this.panel.show(frame, at, time);
  }

  drawView(view, frame, at) {
    const { context, ratio } = this;
    context.save();
    if (view.clipped) {
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.fillStyle = this.colours.edge;
      context.font = `13px ${this.font}`;
      context.textAlign = "center";
      context.fillText(view.name, view.x + 0.5 * view.width, view.y - 6, view.width);
      context.beginPath();
      context.rect(view.x, view.y, view.width, view.height);
      context.clip();
    }
    const { scale } = view;
    context.setTransform(ratio * scale, 0, 0, -ratio * scale, ratio * view.originX, ratio * view.originY);
    const pen = { context, colours: this.colours, px: 1 / scale, thick: view.clipped ? 1.6 : 1 };
    let band = 0;
    for (const part of this.motion.parts) {
      if (part.type === "Body") frictionsim.drawBody(pen, part, frame, at);
      else if (part.type === "Band") this.bands[band++].draw(pen, frame, at);
      else if (part.type === "Trail") this.trails.get(part).draw(pen, this.time);
      else frictionsim.drawArrow(pen, part, at);
    }
    if (!view.clipped) this.drawLabels(view, at);
    context.restore();
  }

  drawLabels({ originX, originY, scale }, at) {
    const { context, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = `13px ${this.font}`;
    [context.textAlign, context.textBaseline, context.lineJoin] = ["center", "middle", "round"];
    [context.strokeStyle, context.fillStyle, context.lineWidth] = [this.colours.paper, this.colours.edge, 4];
    for (const part of this.motion.parts) {
      if (!part.label) continue;
      const { x, y } = frictionsim.placeOf(part, at);
      const where = [originX + scale * x, originY - scale * y];
      context.strokeText(part.name, ...where);
      context.fillText(part.name, ...where);
    }
  }

  // Where everything is at a time, in m and rad, as numbers for other programs.
  pose(time) {
    const [frame, fraction] = this.place(time);
    const at = this.at(time);
    for (const band of this.bands) band.move(frame, fraction);
    const found = { time, frame, state: this.motion.state ? this.motion.state[frame] : null, bodies: [], arrows: [], trails: [] };
    for (const part of this.motion.parts) {
      if (part.type === "Body") {
        const { x, y, angle } = frictionsim.placeOf(part, at);
        found.bodies.push({ name: part.name, x, y, angle, visible: part.visible ? part.visible[frame] === 1 : true });
      } else if (part.type === "Arrow") {
        found.arrows.push({ name: part.name, x: at(part.x), y: at(part.y), dx: at(part.dx), dy: at(part.dy) });
      } else if (part.type === "Trail") found.trails.push({ name: part.name, tip: this.trails.get(part).tip(time) });
    }
    found.visible = found.bodies.filter((body) => body.visible).length;
    found.bands = this.bands.map((band) => band.pose(frame));
    found.readouts = this.panel.numbers.map((entry) =>
      ({ name: entry.name, unit: entry.unit, value: this.panel.valueOf(entry, frame, at, time) }));
    return found;
  }
};
