"use strict";
// A click on a column's head sorts the table by it, a second click the other way round.
for (const table of document.querySelectorAll("table")) {
  const heads = [...table.tHead.rows[0].cells];
  const body = table.tBodies[0];
  const key = (row, column) => {
    const text = row.cells[column].textContent;
    if (text === "-") return Infinity; // missing values come last
    const number = Number(text.replace(/[\u202f<]/g, "").split(/[ /]/)[0] || NaN); // 10000 for "10 000 calls", with a thin space
    return Number.isNaN(number) ? text : number;
  };
  const compare = (a, b) => {
    if (typeof a === "number" && typeof b === "number") return a === b ? 0 : a < b ? -1 : 1;
    return String(a).localeCompare(String(b), "en", { numeric: true });
  };
  table.classList.add("sortable");
  heads.forEach((head, column) => {
    head.title ||= `Sort by ${head.textContent}`;
    head.addEventListener("click", () => {
      const upwards = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", upwards ? "ascending" : "descending");
      const sign = upwards ? 1 : -1;
      [...body.rows].sort((a, b) => sign * compare(key(a, column), key(b, column))).forEach((row) => body.append(row));
    });
  });
}
