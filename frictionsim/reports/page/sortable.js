"use strict";
// The tables of a study, sorted by a click on a heading.

// Each heading of a table becomes a button that sorts by its column.
frictionsim.makeSortable = (table) => {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    const button = document.createElement("button");
    [button.type, button.textContent] = ["button", heading.textContent];
    heading.replaceChildren(button);
    button.addEventListener("click", () => {
      const descending = heading.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
      frictionsim.sort(table, column, descending);
    });
  });
};

// Numbers by their values, those that are none at the end; texts by their letters.
frictionsim.sort = (table, column, descending) => {
  const sign = descending ? -1 : 1;
  const key = (row) => {
    const cell = row.cells[column];
    return "value" in cell.dataset ? frictionsim.parsed(cell.dataset.value) : cell.textContent;
  };
  const compare = (a, b) => {
    if (typeof a === "string") return sign * a.localeCompare(b);
    if (Number.isNaN(a) || Number.isNaN(b)) return Number.isNaN(a) - Number.isNaN(b);
    return a === b ? 0 : a < b ? -sign : sign;
  };
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => [key(row), row]);
  rows.sort(([a], [b]) => compare(a, b));
  body.append(...rows.map(([, row]) => row));
};

frictionsim.parsed = (text) => ({ inf: Infinity, "-inf": -Infinity })[text] ?? Number(text);

frictionsim.theme = new frictionsim.Theme();
document.getElementById("tools").append(frictionsim.theme.button());
for (const table of document.querySelectorAll("table.study")) frictionsim.makeSortable(table);
frictionsim.ready = true;
