"use strict";
// Colours and dashes of lines; dashes for grey print.

frictionsim.DASHES = ["solid", "9px,3px", "9px,3px,2px,3px", "2px,2px"];

// Of a line: in a comparison the colour is that of the result, else that of the column.
frictionsim.lineStyle = (line, comparison, dark) => {
  const { display, DASHES } = frictionsim;
  const palette = display[dark ? "dark" : "light"];
  const number = comparison ? line.result : line.column;
  const dash = comparison ? line.result + line.column : line.column + Math.floor(line.column / palette.length);
  return { color: palette[number % palette.length], dash: DASHES[dash % DASHES.length], width: 1.6 };
};

// The colours of a chart beside its lines.
frictionsim.chartColours = (dark) => (dark
  ? { text: "#d8d8d8", grid: "#34383e", axis: "#6b7076", stick: "rgba(255,255,255,0.11)", event: "#E69F00", hover: "#26292e" }
  : { text: "#333333", grid: "#e4e4e4", axis: "#9a9a9a", stick: "rgba(0,0,0,0.10)", event: "#D55E00", hover: "#ffffff" });

// A text of a file for Plotly, which reads some markup and placeholders in texts.
frictionsim.plain = (text) =>
  text.replace(/[&<>%$]/g, (sign) => `&#${sign.codePointAt(0)};`);

// A unit as it is read: kg m² for kg m^2.
frictionsim.unit = (unit) => unit.replaceAll("^2", "\u00b2").replaceAll("^3", "\u00b3");
