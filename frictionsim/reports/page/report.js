"use strict";
// Puts the page together.

frictionsim.start = async () => {
  frictionsim.data = await frictionsim.load();
  const [start, end] = [Math.min, Math.max].map((of) =>
    of(...frictionsim.data.results.flatMap(({ motion }) => (motion ? [motion.time[0], motion.time.at(-1)] : []))));
  frictionsim.clock = new frictionsim.Clock(start, end);
  for (const { motion } of frictionsim.data.results) {
    if (!motion) continue;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [500, 500];
    document.body.append(canvas);
    const drawing = new frictionsim.Drawing(canvas, motion);
    frictionsim.clock.follow((time) => drawing.draw(time));
  }
  frictionsim.ready = true;
};
frictionsim.start().catch((error) => {
  document.getElementById("message").textContent = `The charts cannot be shown: ${error.message}`;
  throw error;
});
