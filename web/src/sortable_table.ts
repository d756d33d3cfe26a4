// A click on the heading of a column sorts the table's rows; a second click reverses their order.

function value_of(row: HTMLTableSectionElement, column: number): string {
  return row.rows[0].cells[column]?.textContent?.trim() ?? "";
}

/** Numbers by their value, before texts; what is not measured comes last in both directions. */
export function compare_cells(a: string, b: string, direction: number): number {
  const [x, y] = [parseFloat(a.replace("<", "")), parseFloat(b.replace("<", ""))];
  if (!Number.isNaN(x) && !Number.isNaN(y)) return direction * (x - y);
  if (Number.isNaN(x) !== Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1;
  return direction * a.localeCompare(b);
}

function sort(table: HTMLTableElement, column: number, heading: HTMLTableCellElement): void {
  const direction = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  for (const other of table.tHead?.rows[0].cells ?? []) other.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending");
  const rows = [...table.tBodies];
  rows.sort((a, b) => compare_cells(value_of(a, column), value_of(b, column), direction));
  table.append(...rows);
}

export function make_sortable(table: HTMLTableElement): void {
  [...(table.tHead?.rows[0].cells ?? [])].forEach((heading, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = heading.textContent;
    button.addEventListener("click", () => sort(table, column, heading));
    heading.replaceChildren(button);
  });
}

/** A row with details has a button that opens them: a body of two rows, the second hidden. */
export function make_rows_open(table: HTMLTableElement): void {
  for (const body of table.tBodies) {
    if (body.rows.length < 2) continue;
    const details = body.rows[1];
    const first = body.rows[0].cells[0];
    const button = document.createElement("button");
    button.type = "button";
    button.className = "open-row";
    button.textContent = first.textContent;
    const show = (open: boolean) => {
      details.hidden = !open;
      button.setAttribute("aria-expanded", String(open));
    };
    button.addEventListener("click", () => show(details.hidden));
    first.replaceChildren(button);
    show(false);
    addEventListener("beforeprint", () => show(true));
  }
}
