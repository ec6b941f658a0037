"use strict";
// What the page holds, as the scripts need it: compressed base64 becomes text, arrays, functions.

frictionsim.bytesOf = (base64) => {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
};

// The text that the element with an id holds in compressed form.
frictionsim.unpacked = (id) => {
  const bytes = frictionsim.bytesOf(document.getElementById(id).textContent);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
};

frictionsim.ARRAYS = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u1: Uint8Array };

// Objects as of `encoding.array` become typed arrays with a shape.
frictionsim.revive = (key, value) => {
  if (value === null || typeof value !== "object" || !("array" in value)) return value;
  const found = new frictionsim.ARRAYS[value.of](frictionsim.bytesOf(value.array).buffer);
  found.shape = value.shape;
  return found;
};

frictionsim.load = async () => {
  const [data, plotly] = await Promise.all(["packed-data", "packed-plotly"].map(frictionsim.unpacked));
  const script = document.createElement("script");
  script.textContent = plotly;
  document.head.append(script);
  return JSON.parse(data, frictionsim.revive);
};
