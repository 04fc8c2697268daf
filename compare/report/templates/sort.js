"use strict";
// A click on a column's head sorts the table by it, a second click the other way round.
for (const table of document.querySelectorAll("table")) {
  const heads = [...table.tHead.rows[0].cells];
  const body = table.tBodies[0];
  const key = (row, column) => {
    const cell = row.cells[column];
    return cell.dataset.key === undefined ? cell.textContent : Number(cell.dataset.key.replace("inf", "Infinity"));
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
