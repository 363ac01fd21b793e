// Tables: long ones are folded, a head sorts, a button copies the table as CSV.

const KEPT = 5; // rows that a folded table shows

const valueOf = (text) => {
  const number = Number(text.replace(/\u2212/g, "-"));
  return text !== "" && Number.isFinite(number) ? number : null;
};
function csv(table) {
  const quoted = (cell) => {
    const text = cell.textContent.trim().replace(/\u2212/g, "-");
    return /[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  };
  return [...table.rows].map((row) => [...row.cells].map(quoted).join(",")).join("\n") + "\n";
}
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const field = document.createElement("textarea");
    field.value = text;
    document.body.append(field);
    field.select();
    document.execCommand("copy");
    field.remove();
  }
}
function fold(frame, table) {
  const rows = [...table.tBodies[0].rows];
  if (rows.length <= KEPT + 2) return;
  const button = document.createElement("button");
  button.type = "button";
  button.className = "fold";
  const put = (open) => {
    [...table.tBodies[0].rows].forEach((row, k) => row.classList.toggle("more", !open && k >= KEPT));
    button.setAttribute("aria-expanded", String(open));
    button.textContent = open ? `Show the first ${KEPT} rows` : `Show all ${rows.length} rows`;
  };
  put(false);
  button.addEventListener("click", () => put(button.getAttribute("aria-expanded") === "false"));
  frame.querySelector(".table-tools").prepend(button);
  table.refold = () => put(button.getAttribute("aria-expanded") === "true");
}
function sortable(table) {
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sort";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending", body = table.tBodies[0];
      [...table.tHead.rows[0].cells].forEach((one) => one.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const cell = (row) => row.cells[column].textContent.trim();
      const rows = [...body.rows].sort((a, b) => {
        const [x, y] = [valueOf(cell(a)), valueOf(cell(b))];
        const order = x !== null && y !== null ? x - y : (x === null) - (y === null) || cell(a).localeCompare(cell(b));
        return down ? -order : order;
      });
      body.append(...rows);
      if (table.refold) table.refold();
    });
  });
}
function setTables() {
  for (const frame of document.querySelectorAll(".table")) {
    const table = frame.querySelector("table"), tools = document.createElement("div");
    tools.className = "table-tools screen-only";
    frame.append(tools);
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "Copy as CSV";
    button.addEventListener("click", async () => {
      await copy(csv(table));
      button.textContent = "Copied";
      setTimeout(() => { button.textContent = "Copy as CSV"; }, 1500);
    });
    tools.append(button);
    fold(frame, table);
    if (table.tBodies[0].rows.length > 1) sortable(table);
  }
  // the tab key stops at a table to scroll it, so not at one that fits
  const stops = () => document.querySelectorAll(".scroll").forEach((one) => {
    if (one.scrollWidth > one.clientWidth) one.tabIndex = 0;
    else one.removeAttribute("tabindex");
  });
  stops();
  window.addEventListener("resize", stops);
  document.addEventListener("toggle", stops, true);
}
