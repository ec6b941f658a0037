"use strict";
// What stands beside a drawing, as text: its state, its numbers and the key to its parts.

frictionsim.made = (tag, className, text = "") => {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  return element;
};

// A function that writes numbers of one read-out with as many decimals as four digits of the largest have.
frictionsim.formatOf = (values, unit) => {
  let largest = 0;
  for (const value of values) largest = Math.max(largest, Math.abs(value));
  const shown = unit === "1" ? "" : `\u00a0${unit.replace("^2", "²")}`;
  const exponent = largest > 0 ? Math.floor(Math.log10(largest)) : 0;
  if (exponent > 6 || exponent < -4) return (value) => value.toExponential(3).replace("-", "\u2212") + shown;
  const decimals = unit === "1" ? 0 : Math.max(0, 3 - exponent);
  return (value) => {
    const text = value.toFixed(decimals);
    return (Number(text) === 0 ? text.replace("-", "") : text.replace("-", "\u2212")) + shown;
  };
};

frictionsim.DrawingPanel = class {
  constructor(motion, bands, lineOf) {
    [this.motion, this.lineOf] = [motion, lineOf];
    this.element = frictionsim.made("figcaption", "drawing-panel");
    if (motion.state) this.element.append(this.state = frictionsim.made("p", "drawing-state"));
    this.numbers = [];
    if (motion.readouts.length) this.element.append(this.readouts());
    for (const { band, range } of bands) if (range) this.element.append(this.scale(band, range));
    this.key = frictionsim.made("ul", "drawing-key");
    this.element.append(this.key);
    this.entries = this.entriesOf(motion.parts);
  }

  readouts() {
    const list = frictionsim.made("dl", "drawing-readouts");
    for (const readout of this.motion.readouts) {
      const number = frictionsim.made("dd", "");
      list.append(frictionsim.made("dt", "", readout.name), number);
      const { value, unit, words } = readout;
      const named = Object.keys(words).length > 0;
      const write = named ? (found) => words[found] ?? "" : frictionsim.formatOf(value, unit);
      this.numbers.push({ ...readout, number, line: this.lineOf(readout), write });
    }
    return list;
  }

  // Its value at a time: that of the line of a chart, which has all samples, or between frames.
  valueOf({ line, unit, value }, frame, at, time) {
    if (line) return frictionsim.valueAt(line.times, line, time);
    return unit === "1" ? value[frame] : at(value);
  }

  scale(band, range) {
    const scale = frictionsim.made("div", "drawing-scale", `${band.quantity}, ${band.unit}`);
    const bar = frictionsim.made("div", "drawing-scale-bar");
    bar.style.background = `linear-gradient(to right, ${frictionsim.display.tension.join(", ")})`;
    const ends = frictionsim.made("div", "drawing-scale-ends");
    const write = frictionsim.formatOf(range, band.unit);
    ends.append(...range.map((value) => frictionsim.made("span", "", write(value))));
    scale.append(bar, ends);
    return scale;
  }

  // Name and sample of each part that has a name; parts of one name once.
  entriesOf(parts) {
    const entries = new Map();
    for (const part of parts) {
      if (part.type !== "Band") {
        if (part.name && !part.label && !entries.has(part.name)) entries.set(part.name, { part });
        continue;
      }
      if (part.value || part.touching) {
        const modes = part.touching ? part.sticking ? ["sticks", "slips"] : ["touches"] : [];
        for (const contact of modes.map((mode) => frictionsim.display.beltContact[mode])) {
          entries.set(contact.words, contact);
        }
        if (part.patch) entries.set("patch with other friction", { patch: true });
        if (part.marks) entries.set("marks on the belt", { marks: true });
      } else if (part.name) entries.set(part.name, { cord: true });
    }
    return entries;
  }

  drawKey(colours) {
    const ratio = window.devicePixelRatio || 1;
    this.key.replaceChildren(...Array.from(this.entries, ([name, entry]) => {
      const item = frictionsim.made("li", "");
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [26 * ratio, 16 * ratio];
      canvas.setAttribute("aria-hidden", "true");
      const context = canvas.getContext("2d");
      context.setTransform(ratio, 0, 0, -ratio, 13 * ratio, 8 * ratio);
      frictionsim.drawSample({ context, colours, px: 1 }, entry);
      item.append(canvas, name);
      return item;
    }));
  }

  show(frame, at, time) {
    if (this.state) {
      const state = String(this.motion.state[frame]);
      if (this.state.dataset.state !== state) {
        this.state.dataset.state = state;
        this.state.textContent = frictionsim.display.contactWords[state] ?? state;
      }
    }
    for (const entry of this.numbers) {
      const text = entry.write(this.valueOf(entry, frame, at, time));
      if (text !== entry.shown) entry.number.textContent = entry.shown = text;
    }
  }
};

// A sample of a part for the key, on 26 by 16 pixels about the origin.
frictionsim.drawSample = (pen, { part, core, around, patch, marks, cord }) => {
  const { context, colours } = pen;
  const stroke = (colour, width, points = [[-11, 0], [11, 0]]) => {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    for (const [x, y] of points) context.lineTo(x, y);
    context.stroke();
  };
  const belt = () => { stroke(colours.edge, 9); stroke(frictionsim.colourAt(0.5), 7); };
  if (core) { belt(); stroke(around, 4.2); stroke(core, 2.8); }
  else if (patch) { stroke(colours.friction, 14); belt(); }
  else if (marks) { for (const x of [-6, 6]) stroke(colours.edge, 1.6, [[x, -7], [x, 7]]); belt(); }
  else if (cord) { stroke(colours.edge, 3); for (const x of [-6, 6]) stroke(colours.edge, 2.5, [[x, -4], [x, 4]]); }
  else if (part.type === "Trail") stroke(colours.path, 2);
  else if (part.type === "Arrow") {
    const numbers = { x: [-11], y: [0], dx: [22], dy: [0], role: part.role };
    frictionsim.drawArrow(pen, numbers, (values) => values[0]);
  } else frictionsim.drawBodySample(pen, part.shapes[0]);
};

frictionsim.drawBodySample = (pen, shape) => {
  const { context, colours } = pen;
  if (shape.role === "paper") { // a line on something dark
    context.fillStyle = colours.fixed;
    context.fillRect(-11, -8, 22, 16);
  }
  const round = shape.type === "Disc";
  const box = new Float64Array([-10, -6, 10, -6, 10, 6, -10, 6]);
  frictionsim.drawShape(pen, round ? { ...shape, x: 0, y: 0, radius: 6.5 } : { ...shape, points: box, closed: true });
};
