// The grid of plots: each shows signals of up to two units, over time or frequency. Signals are dropped on a plot.

import { digits } from "./device.js";
import { node } from "./dom.js";
import { nameOf, sourceOf } from "./sources.js";

// Global of a classic script, which is loaded before the modules.
const { uPlot } = /** @type {any} */ (window);
const HEIGHT = 190;
export const DRAGGED = "text/x-dimsart-signal";

export class Plots {
  /** `drop(key, panel)` is called when a signal is dropped on a plot, or with panel -1 on the space for a new plot; null disables it. */
  constructor(place, cursors, drop) {
    this.place = place;
    this.cursors = cursors;
    this.drop = drop;
    this.all = [];
    this.marks = [];
    this.zoom = false;
    this.space = node("div", { className: "new-plot", textContent: "drop a signal here for a new plot" });
    this.space.hidden = !drop;
    this.accept(this.space, -1);
  }

  accept(element, panel) {
    element.addEventListener("dragover", (event) => {
      if (!event.dataTransfer.types.includes(DRAGGED)) return;
      event.preventDefault();
      element.classList.add("over");
    });
    element.addEventListener("dragleave", () => element.classList.remove("over"));
    element.addEventListener("drop", (event) => {
      event.preventDefault();
      element.classList.remove("over");
      this.drop(event.dataTransfer.getData(DRAGGED), panel);
    });
  }

  /**
   * Creates the plots. `panels` have `curves`: key, label, unit, color, and dash of a stored trace.
   * `view` is time, spectrum or db; `columns` is the number of plots in a row.
   */
  build(panels, view, columns) {
    for (const { plot } of this.all) plot.destroy();
    this.zoom = false;
    this.view = view;
    this.place.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    const style = getComputedStyle(document.body), quiet = style.getPropertyValue("--quiet"), rule = style.getPropertyValue("--rule");
    const axis = { stroke: quiet, grid: { stroke: rule, width: 1 }, ticks: { stroke: rule, width: 1 } };
    const width = Math.floor((this.place.clientWidth - 8 * (columns - 1)) / columns);
    const figures = [];
    this.all = panels.map(({ curves }, panel) => {
      const figure = node("figure", { className: "plot" });
      this.accept(figure, panel);
      const units = [...new Set(curves.map(({ unit }) => unit))].slice(0, 2);
      const text = (unit) => `${unit || "1"}${view === "db" ? ", dB" : ""}`;
      const series = curves.map(({ label, unit, color, dash }) => ({
        label, stroke: color, width: dash ? 1 : 1.5, dash, scale: units.indexOf(unit) === 1 ? "right" : "y", spanGaps: false,
        value: (_, number) => (number == null ? "–" : `${digits(number)} ${view === "db" ? "dB" : unit}`),
      }));
      const right = { ...axis, scale: "right", side: 1, size: 70, label: text(units[1]), labelSize: 18, grid: { show: false }, values: (_, numbers) => numbers.map(digits) };
      const plot = new uPlot({
        width, height: HEIGHT,
        scales: { x: { time: false, distr: view === "time" ? 1 : 3 } },
        cursor: { sync: { key: "scope" }, drag: { x: true, y: false } },
        series: [{ label: view === "time" ? "time (s)" : "frequency (Hz)", value: (_, number) => (number == null ? "–" : digits(number)) }, ...series],
        axes: [axis, { ...axis, size: 70, label: text(units[0]), labelSize: 18, values: (_, numbers) => numbers.map(digits) }, ...(units[1] === undefined ? [] : [right])],
        hooks: {
          setSelect: [(self) => { this.zoom = self.select.width > 0; }],
          draw: [(self) => this.cursors.draw(self), (self) => this.drawMarks(self)],
          ready: [(self) => {
            self.over.addEventListener("click", (event) => this.cursors.set(event.shiftKey ? 1 : 0, self.posToVal(event.offsetX, "x")));
            self.over.addEventListener("dblclick", () => { this.zoom = false; });
          }],
        },
      }, [[], ...curves.map(() => [])], figure);
      figures.push(figure);
      return { plot, curves };
    });
    this.place.replaceChildren(...figures, this.space);
  }

  /** Draws the tables of each panel: one per curve, x and y. Curves with the same x share the array. */
  draw(tables) {
    this.all.forEach(({ plot }, panel) => {
      const own = tables[panel];
      const isOne = own.every(([x]) => x === own[0][0]);
      plot.setData(isOne ? [own[0]?.[0] ?? [], ...own.map(([, y]) => y)] : uPlot.join(own), !this.zoom);
    });
  }

  /** Vertical lines with a text, on the time axis. */
  drawMarks(plot) {
    for (const { at, text } of this.view === "time" ? this.marks : []) line(plot, at, text, "#a3142e");
  }

  /** Returns a picture of all plots with their legends, as a canvas. */
  picture() {
    const canvases = this.all.map(({ plot }) => plot.ctx.canvas), ratio = devicePixelRatio, text = 18 * ratio;
    const style = getComputedStyle(document.body);
    const picture = node("canvas", { width: Math.max(...canvases.map(({ width }) => width)), height: canvases.reduce((sum, { height }) => sum + height + text, 0) });
    const context = picture.getContext("2d");
    context.fillStyle = style.getPropertyValue("--card");
    context.fillRect(0, 0, picture.width, picture.height);
    context.font = `${12 * ratio}px system-ui, sans-serif`;
    let y = 0;
    this.all.forEach(({ curves }, panel) => {
      let x = 70 * ratio;
      for (const { label, unit, color } of curves) {
        context.fillStyle = color;
        const words = `${label}${unit && ` (${unit})`}   `;
        context.fillText(words, x, y + 13 * ratio);
        x += context.measureText(words).width;
      }
      context.drawImage(canvases[panel], 0, y + text);
      y += canvases[panel].height + text;
    });
    return picture;
  }
}

/** Draws a vertical line with a text. */
export function line(plot, at, text, color) {
  const x = plot.valToPos(at, "x", true), { left, top, width, height } = plot.bbox;
  if (x < left || x > left + width) return;
  plot.ctx.save();
  plot.ctx.strokeStyle = plot.ctx.fillStyle = color;
  plot.ctx.textAlign = "left";
  plot.ctx.setLineDash([6, 4]);
  plot.ctx.beginPath();
  plot.ctx.moveTo(x, top);
  plot.ctx.lineTo(x, top + height);
  plot.ctx.stroke();
  plot.ctx.fillText(text, x + 4, top + 14);
  plot.ctx.restore();
}

/** Label of a signal: with its source if several sources are shown. */
export const labelOf = (key, isAlone) => (isAlone ? nameOf(key) : `${sourceOf(key)} ${nameOf(key)}`);
