// Tables sort by a click on a heading, and save themselves as CSV.
const saved = (cell) => cell.dataset.name ?? cell.dataset.value ?? cell.textContent;
for (const table of document.querySelectorAll("table")) {
  const body = table.tBodies[0];
  const value = (row, column) => {
    const text = saved(row.cells[column]);
    const number = Number(text.replace(/[()<>%\s]/g, ""));
    return text === "" ? null : Number.isNaN(number) ? text : number;
  };
  for (const heading of table.tHead.rows[0].cells) {
    heading.tabIndex = 0;
    heading.setAttribute("aria-sort", "none");
    const sort = () => {
      const down = heading.getAttribute("aria-sort") === "ascending";
      for (const other of heading.parentNode.cells) other.setAttribute("aria-sort", "none");
      heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      const rows = [...body.rows].sort((one, other) => {
        const [a, b] = [value(one, heading.cellIndex), value(other, heading.cellIndex)];
        if (a === null || b === null) return (a === null) - (b === null);
        const order = typeof a === typeof b ? (a > b) - (a < b) : String(a) < String(b) ? -1 : 1;
        return down ? -order : order;
      });
      body.append(...rows);
    };
    heading.addEventListener("click", sort);
    heading.addEventListener("keydown", (event) => { if (event.key === "Enter") sort(); });
  }
  const button = document.createElement("button");
  button.textContent = "Save as CSV";
  button.addEventListener("click", () => {
    const quoted = (cell) => `"${saved(cell).replaceAll('"', '""')}"`;
    const lines = [...table.rows].map((row) => [...row.cells].map(quoted).join(","));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
    link.download = `${table.dataset.name || "table"}.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
  });
  table.parentNode.after(button);
}
