"use strict";
// Elements of the page; texts of files become text nodes and nothing else.

// element("p", { class: "note" }, "text", child, ...)
frictionsim.element = (name, attributes = {}, ...children) => {
  const found = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) found.addEventListener(key.slice(2), value);
    else if (value !== null && value !== false) found.setAttribute(key, value === true ? "" : value);
  }
  found.append(...children);
  return found;
};

frictionsim.button = (label, title, click) =>
  frictionsim.element("button", { type: "button", title, "aria-label": title, onclick: click }, label);

// A number as a reader wants it: seven digits, no zeros at the end.
frictionsim.number = (value) =>
  (Number.isFinite(value) ? String(Number(value.toPrecision(7))).replace("-", "\u2212") : "\u2013");

// The number of the last value that is not above another one, in increasing values; -1 if none.
frictionsim.lastUpTo = (values, wanted) => {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= wanted) low = middle + 1; else high = middle;
  }
  return low - 1;
};

// That number, and how far a time is from there to the next of increasing times: 0 at the end.
frictionsim.placeIn = (times, time) => {
  const before = Math.max(frictionsim.lastUpTo(times, time), 0);
  if (before + 1 >= times.length) return [before, 0];
  return [before, Math.min(Math.max((time - times[before]) / (times[before + 1] - times[before]), 0), 1)];
};
