"use strict";
// Bodies, paths and arrows of a drawing. A pen has a context in metres, its colours, and the length
// of a pixel; `thick` is above 1 where the drawing is larger.

// Where the origin of a body is, and its angle.
frictionsim.placeOf = (body, at) => {
  const [x, y, angle] = [at(body.x), at(body.y), at(body.angle)];
  if (!body.carrier) return { x, y, angle };
  const turned = at(body.carrier);
  const [cosine, sine] = [Math.cos(turned), Math.sin(turned)];
  return { x: cosine * x - sine * y, y: sine * x + cosine * y, angle };
};

frictionsim.drawBody = (pen, body, frame, at) => {
  if (body.visible && !body.visible[frame]) return;
  const { context } = pen;
  const { x, y, angle } = frictionsim.placeOf(body, at);
  context.save();
  context.translate(x, y);
  context.rotate(angle);
  for (const shape of body.shapes) frictionsim.drawShape(pen, shape);
  context.restore();
};

frictionsim.drawShape = ({ context, colours, px, thick = 1 }, shape) => {
  const colour = colours[shape.role];
  context.beginPath();
  if (shape.type === "Disc") context.arc(shape.x, shape.y, shape.radius, 0, 2 * Math.PI);
  else {
    for (let i = 0; i < shape.points.length; i += 2) context.lineTo(shape.points[i], shape.points[i + 1]);
    if (shape.closed) context.closePath();
  }
  context.lineJoin = "round";
  context.lineCap = "round";
  if (shape.type === "Disc" ? shape.open : !shape.closed) {
    context.strokeStyle = colour;
    context.lineWidth = (shape.role === "marked" ? 3 : 1.6) * thick * px;
    context.stroke();
  } else if (shape.role === "cut") {
    context.strokeStyle = colour;
    context.lineWidth = 1.5 * px;
    context.setLineDash([5 * px, 4 * px]);
    context.stroke();
    context.setLineDash([]);
  } else {
    context.fillStyle = colour;
    context.fill();
    context.strokeStyle = colours.edge;
    context.lineWidth = (shape.role === "fixed" || shape.role === "marked" ? 0 : 1) * px;
    if (context.lineWidth && shape.role !== "fixed" && shape.role !== "marked") context.stroke();
  }
};

frictionsim.drawArrow = (pen, arrow, at) => {
  const { context, colours, px, thick = 1 } = pen;
  const [x, y, dx, dy] = [at(arrow.x), at(arrow.y), at(arrow.dx), at(arrow.dy)];
  const length = Math.hypot(dx, dy);
  if (!(length > px)) return;
  const head = Math.min(13 * px * thick, 0.6 * length);
  const [ux, uy] = [dx / length, dy / length];
  const [baseX, baseY] = [x + dx - head * ux, y + dy - head * uy];
  const half = 0.38 * head;
  context.lineCap = "butt";
  for (const [colour, wider] of [[colours.paper, 2.4], [colours[arrow.role], 0]]) { // a halo, then the arrow
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = (3 * thick + wider) * px;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(baseX + 0.2 * head * ux, baseY + 0.2 * head * uy);
    context.stroke();
    context.beginPath();
    context.moveTo(x + dx, y + dy);
    context.lineTo(baseX - half * uy, baseY + half * ux);
    context.lineTo(baseX + half * uy, baseY - half * ux);
    context.closePath();
    context.lineWidth = wider * px;
    if (wider) context.stroke();
    context.fill();
  }
};

frictionsim.CHUNK = 256; // points of a path that are drawn as one, without going through them again

// The path of a point: strong behind it, faint ahead.
frictionsim.DrawnTrail = class {
  constructor(trail) {
    this.trail = trail;
    this.chunks = [];
    for (let first = 0; first < trail.time.length; first += frictionsim.CHUNK) {
      const chunk = new Path2D();
      const end = Math.min(first + frictionsim.CHUNK, trail.time.length - 1);
      for (let i = first; i <= end; i++) chunk.lineTo(trail.x[i], trail.y[i]);
      this.chunks.push(chunk);
    }
  }

  // The last point that is behind, and how far it is from there to the next.
  place(time) {
    return frictionsim.placeIn(this.trail.time, time);
  }

  tip(time) {
    const { x, y } = this.trail;
    const [i, fraction] = this.place(time);
    if (!fraction) return [x[i], y[i]];
    return [x[i] + fraction * (x[i + 1] - x[i]), y[i] + fraction * (y[i + 1] - y[i])];
  }

  draw({ context, colours, px }, time) {
    const { x, y } = this.trail;
    const [last] = this.place(time);
    context.lineJoin = "round";
    context.strokeStyle = colours.faint;
    context.lineWidth = px;
    for (const chunk of this.chunks) context.stroke(chunk);
    context.strokeStyle = colours.path;
    context.lineWidth = 2 * px;
    const whole = Math.floor(last / frictionsim.CHUNK);
    for (const chunk of this.chunks.slice(0, whole)) context.stroke(chunk);
    context.beginPath();
    for (let i = whole * frictionsim.CHUNK; i <= last; i++) context.lineTo(x[i], y[i]);
    context.lineTo(...this.tip(time));
    context.stroke();
  }
};
