"use strict";
// Colours and dashes of lines, from the data of the page.

frictionsim.display.dash = (lengths) =>
  (lengths.length ? lengths.map((length) => `${1.5 * length}px`).join() : "solid");

// Of a line: in a comparison the colour is that of the result, else that of the column.
frictionsim.lineStyle = (line, comparison, dark) => {
  const { dash: shown, dashes, [dark ? "dark" : "light"]: { lines: palette } } = frictionsim.display;
  const number = comparison ? line.result : line.column;
  const dash = comparison ? line.result + line.column : line.column + Math.floor(line.column / palette.length);
  return { color: palette[number % palette.length], dash: shown(dashes[dash % dashes.length]), width: 1.6 };
};

// The colours of a chart beside its lines.
frictionsim.chartColours = (dark) => frictionsim.display[dark ? "dark" : "light"].chart;

// A text of a file for Plotly, which reads some markup and placeholders in texts.
frictionsim.plain = (text) =>
  text.replace(/[&<>%$]/g, (sign) => `&#${sign.codePointAt(0)};`);

// A unit as it is read: kg m² for kg m^2.
frictionsim.unit = (unit) => unit.replaceAll("^2", "\u00b2").replaceAll("^3", "\u00b3");
