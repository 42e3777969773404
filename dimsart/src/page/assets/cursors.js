// Cursors A and B of the scope: lines in all plots, and a table of values and differences.

import { digits } from "./device.js";
import { by, node } from "./dom.js";
import { line } from "./plots.js";

const COLORS = ["#009e73", "#d55e00"];

export class Cursors {
  /** `change` is called after a cursor was moved. */
  constructor(change) {
    this.change = change;
    this.at = [null, null];
    by("cursors-clear").onclick = () => { this.at = [null, null]; change(); };
  }

  set(number, at) {
    this.at[number] = at;
    this.change();
  }

  /** Moves a cursor by rows; without a cursor, sets it to the middle. */
  move(number, rows, x) {
    if (!x.length) return;
    const now = this.at[number] === null ? x.length >> 1 : nearest(x, this.at[number]) + rows;
    this.set(number, x[Math.max(0, Math.min(x.length - 1, now))]);
  }

  draw(plot) {
    this.at.forEach((at, number) => { if (at !== null) line(plot, at, "AB"[number], COLORS[number]); });
  }

  /** Shows the values of all plots at the cursors; `unit` is the unit of x. */
  show(plots, unit) {
    const [a, b] = this.at;
    by("cursors").hidden = a === null && b === null;
    if (by("cursors").hidden) return;
    const difference = (one, other, suffix) => (a === null || b === null ? "" : `${digits(other - one)} ${suffix}`);
    const row = (name, values, suffix) => node("tr", {}, node("th", { textContent: name }),
      ...values.map((value) => node("td", { textContent: value === null ? "" : `${digits(value)} ${suffix}` })),
      node("td", { textContent: difference(...values, suffix) }));
    const rows = plots.flatMap(({ plot, curves }) => {
      const at = [a, b].map((value) => (value === null ? null : nearest(plot.data[0], value)));
      return curves.map(({ label, unit: of }, n) => row(label, at.map((i) => (i === null ? null : plot.data[n + 1][i] ?? NaN)), of));
    });
    const inverse = a !== null && b !== null && unit === "s" ? ` (${digits(1 / Math.abs(b - a))} Hz)` : "";
    const first = row(unit === "s" ? "time" : "frequency", this.at, unit);
    first.lastChild.textContent += inverse;
    by("cursor-values").replaceChildren(first, ...rows);
  }
}

/** Index of the value that is nearest, in ascending values. */
function nearest(x, at) {
  let [low, high] = [0, x.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x[middle] < at) low = middle;
    else high = middle;
  }
  return Math.abs(x[low] - at) <= Math.abs(x[high] - at) ? low : high;
}
