// SPDX-License-Identifier: Apache-2.0
// Names of columns for narrow windows, where each row of a table stands as a list (page.css): the heading of a cell is its data-label.

/** Gives the cells of the tables with headings their names; cells that span columns have none. */
function nameCells() {
  for (const table of document.querySelectorAll("table.grid")) {
    const names = [...(table.tHead?.rows[0]?.cells ?? [])].map((cell) => cell.textContent.trim());
    for (const body of table.tBodies)
      for (const row of body.rows)
        for (const [i, cell] of [...row.cells].entries()) {
          const name = cell.tagName === "TD" && cell.colSpan === 1 ? names[i] ?? "" : "";
          if (cell.dataset.label !== name) cell.dataset.label = name;
        }
  }
}

/** Keeps the names right while the window is narrow. */
export function nameCellsWhenNarrow() {
  const narrow = matchMedia("(max-width: 640px)");
  let waits = false;
  const soon = () => {
    if (waits || !narrow.matches) return;
    waits = true;
    requestAnimationFrame(() => { waits = false; nameCells(); });
  };
  new MutationObserver(soon).observe(document.body, {childList: true, subtree: true});
  narrow.addEventListener("change", soon);
  soon();
}
