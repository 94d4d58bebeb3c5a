"use strict";
// Tables that sort by a button in each head: numbers by their size, all else by its letters, what is missing last.
const sortable = (table) => {
  const { make } = page;
  const value = (row, k) => row.cells[k]?.textContent.trim() ?? "";
  const numeric = (text) => (text === "" || text === "–" ? NaN : Number(text.replace(/ s$/, "")));
  [...table.tHead.rows[0].cells].forEach((cell, k) => {
    const button = make("button", { type: "button" }, cell.textContent);
    cell.replaceChildren(button);
    button.addEventListener("click", () => {
      const sign = cell.getAttribute("aria-sort") === "ascending" ? -1 : 1, body = table.tBodies[0];
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      cell.setAttribute("aria-sort", sign < 0 ? "descending" : "ascending");
      const keyed = [...body.rows].map((row) => ({ row, text: value(row, k), number: numeric(value(row, k)) }));
      keyed.sort((a, b) => {
        const [p, q] = [Number.isNaN(a.number), Number.isNaN(b.number)];
        if (p !== q) return p - q;
        return sign * (p ? a.text.localeCompare(b.text) : a.number - b.number);
      });
      body.append(...keyed.map((each) => each.row));
    });
  });
};
for (const table of document.querySelectorAll("table.sortable")) sortable(table);
