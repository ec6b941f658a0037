"use strict";
// A motion on a canvas, at any time.

frictionsim.Drawing = class {
  constructor(canvas, motion) {
    [this.canvas, this.motion] = [canvas, motion];
  }

  // The frame before a time, and how far the time is from it to the next one.
  place(time) {
    const times = this.motion.time;
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    if (high <= low) return [0, 0];
    return [low, Math.min(Math.max((time - times[low]) / (times[high] - times[low]), 0), 1)];
  }

  draw(time) {
    this.time = time;
    const context = this.canvas.getContext("2d");
    const [left, right, bottom, top] = this.motion.bounds;
    const scale = Math.min(this.canvas.width / (right - left), this.canvas.height / (top - bottom));
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.setTransform(scale, 0, 0, -scale, -left * scale, top * scale);
    for (const part of this.motion.parts) if (part.type === "Body") this.drawBody(context, part);
  }

  drawBody(context, body) {
    const [frame, fraction] = this.place(this.time);
    const at = (values) => values[frame] + fraction * ((values[frame + 1] ?? values[frame]) - values[frame]);
    const style = getComputedStyle(document.documentElement);
    context.save();
    context.translate(at(body.x), at(body.y));
    context.rotate(at(body.angle));
    for (const shape of body.shapes) {
      context.fillStyle = context.strokeStyle = style.getPropertyValue(`--role-${shape.role}`);
      context.lineWidth = 0.002;
      context.beginPath();
      if (shape.type === "Disc") context.arc(shape.x, shape.y, shape.radius, 0, 2 * Math.PI);
      else for (let i = 0; i < shape.points.length; i += 2) context.lineTo(shape.points[i], shape.points[i + 1]);
      if (shape.type === "Disc") context.fill(); else context.stroke();
    }
    context.restore();
  }
};
