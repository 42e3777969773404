// The scope: signals of the last minute, running or held by a trigger, as time plot, spectrum or XY plot.

import { digits } from "/device.js";
import { by } from "/dom.js";
import { spectrum } from "/fourier.js";
import { Ring } from "/ring.js";
import { offerSending } from "/sending.js";
import { Trigger } from "/trigger.js";
import { drawXy } from "/xy.js";

const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#56b4e9", "#8c564b", "#7f7f7f"];
const dark = matchMedia("(prefers-color-scheme: dark)");
const HEIGHT = 190;

export class Scope {
  /** `choose` selects the signals that the device sends. */
  constructor(choose) {
    this.choose = choose;
    this.rings = [];
    // Held pictures of stations that are not shown.
    this.kept = [];
    this.chosen = [];
    this.plots = [];
    this.isRunning = true;
    this.cursors = [null, null];
    const change = () => { this.rearm(); this.rebuild(); };
    this.trigger = new Trigger(change);
    this.rearm();
    by("run").onclick = () => this.setRunning(!this.isRunning);
    by("fit").onclick = () => { this.zoom = null; this.draw(true); };
    by("export").onclick = () => this.export();
    by("view").onchange = () => this.rebuild();
    by("window").onchange = change;
    by("signal-filter").oninput = () => this.filter();
    dark.onchange = () => this.rebuild();
    new ResizeObserver(() => this.rebuild()).observe(by("plots"));
    setInterval(() => this.frame(), 50);
  }

  ring() { return this.rings[this.station]; }

  gaps(station) { return this.rings[station]?.gaps ?? 0; }

  /** Sets the layout of a station's rows; an unchanged layout has no effect. */
  layout(station, { unsent, ...layout }, period_s) {
    const ring = this.rings[station];
    if (!ring || JSON.stringify(ring.layout) !== JSON.stringify(layout)) {
      this.replace(station, new Ring(layout, period_s ?? ring?.tick_s ?? 0.001, unsent));
    } else if (String(ring.unsent) !== String(unsent)) {
      ring.unsent = unsent;
      if (station === this.station && this.isRunning) this.list();
    }
  }

  period(station, period_s) {
    const ring = this.rings[station];
    // Drop earlier rows: their times are wrong.
    if (ring && Math.abs(ring.tick_s - period_s) > 1e-9 * period_s) this.replace(station, new Ring(ring.layout, period_s, ring.unsent));
  }

  /** Forgets a replaced station. */
  forget(station) {
    delete this.kept[station];
    if (station === this.station) this.setRunning(true);
    this.replace(station, undefined);
  }

  replace(station, ring) {
    this.rings[station] = ring;
    if (station !== this.station) return;
    this.rearm();
    if (this.isRunning) this.list();
  }

  /** Handles a message of rows and returns its station. */
  rows(data) {
    const view = new DataView(data);
    const station = view.getUint8(0), width = view.getUint16(2, true), number = view.getUint32(4, true);
    const ring = this.rings[station];
    if (!ring || ring.layout.number !== number || ring.columns.length !== width) return station;
    for (let at = 8; at + 4 + 4 * width <= data.byteLength; at += 4 + 4 * width) {
      ring.push(view.getUint32(at, true), view, at + 4);
    }
    return station;
  }

  /** Returns values and units of the last tick by signal name. */
  last(station) {
    const ring = this.rings[station];
    if (!ring?.count) return null;
    const signals = new Map();
    ring.columns.forEach(({ signal, unit }, column) => {
      if (!signals.has(signal)) signals.set(signal, { unit, values: [] });
      signals.get(signal).values.push(ring.at(column, ring.count - 1));
    });
    return signals;
  }

  show(station, name) {
    this.name = name;
    if (station === this.station) return;
    this.kept[this.station ?? station] = this.isRunning ? null : this.held;
    this.station = station;
    this.chosen = [];
    this.held = this.kept[station] ?? null;
    this.setRunning(!this.held);
    if (!this.held) return;
    this.rearm();
    this.list();
  }

  /** Builds the list of signals. */
  list() {
    const rows = this.held?.rows ?? this.ring();
    if (!rows) {
      by("signals").replaceChildren();
      return this.rebuild();
    }
    const names = rows.columns.map(({ name }) => name);
    this.chosen = this.chosen.filter((name) => names.includes(name));
    if (!this.chosen.length) {
      const liked = ["POSITION", "POSITION[0]", "DES_POSITION", "DES_POSITION[0]", "DES_FORCE", "DES_FORCE[0]"];
      this.chosen = liked.filter((name) => names.includes(name));
      if (!this.chosen.length) this.chosen = names.slice(0, 1);
    }
    by("signals").replaceChildren(...rows.columns.map(({ name, unit, signal, place }) => {
      const label = document.createElement("label");
      label.dataset.name = name.toLowerCase();
      if (place === 0) label.dataset.signal = signal;
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: this.chosen.includes(name) });
      box.onchange = () => {
        this.chosen = box.checked ? [...this.chosen, name] : this.chosen.filter((other) => other !== name);
        this.rebuild();
      };
      const parts = ["key", "name", "value"].map((kind) => Object.assign(document.createElement("span"), { className: kind }));
      parts[1].textContent = name;
      parts[1].title = name;
      label.append(box, ...parts);
      Object.assign(label, { key: parts[0], value: parts[2], name, unit });
      return label;
    }));
    if (rows === this.ring()) offerSending(by("signals"), rows, this.choose);
    this.trigger.offer(names, this.chosen[0]);
    this.filter();
    this.rebuild();
  }

  filter() {
    const wanted = by("signal-filter").value.trim().toLowerCase();
    for (const row of by("signals").children) row.hidden = !row.dataset.name.includes(wanted);
  }

  setRunning(isRunning) {
    const ring = this.ring();
    if (!isRunning && !this.held) {
      if (!ring?.count) return;
      this.held = { rows: ring.copy(ring.oldest(), ring.count), zero: null };
    }
    this.isRunning = isRunning;
    by("run").textContent = isRunning ? "Running" : "Held";
    by("run").setAttribute("aria-pressed", isRunning);
    if (!isRunning) return;
    this.rearm();
    this.list();
  }

  /** Rearms the trigger for new rows; a picture held by the user stays. */
  rearm() {
    this.trigger.arm(this.ring());
    if (this.isRunning) this.held = null;
  }

  /** Returns the window in ticks. */
  span(rows) { return Math.max(2 * rows.step, Math.round(Number(by("window").value) / rows.tick_s)); }

  /** Holds the picture when the trigger fired and the window is complete. */
  watchTrigger(ring) {
    const { mode } = this.trigger, span = this.span(ring);
    if (mode === "off" || !this.isRunning) return;
    const fired = this.trigger.watch(ring, span);
    if (fired) {
      // A copy, as the ring continues. A single shot keeps all rows, for other windows.
      const first = mode === "single" ? ring.oldest() : ring.find(fired.time - this.trigger.before(span));
      this.held = { rows: ring.copy(first, ring.count), zero: fired.time };
      this.shownAt = performance.now();
      this.trigger.say(`fired at tick ${fired.tick}`);
      if (mode === "single") this.setRunning(false);
    } else if (mode === "auto" && performance.now() - (this.shownAt ?? 0) > 1000 + 1000 * span * ring.tick_s) {
      this.held = null;
      this.trigger.say("no trigger, running free");
    } else if (this.held === null) {
      this.trigger.say("waiting for the trigger");
    }
  }

  frame() {
    const ring = this.ring();
    if (!ring?.count || document.hidden) return;
    this.watchTrigger(ring);
    const colored = new Map(this.chosen.map((name, place) => [name, COLORS[place % COLORS.length]]));
    for (const { key, value, name, unit } of by("signals").querySelectorAll("label")) {
      value.textContent = `${digits(ring.numbers.has(name) ? ring.at(ring.numbers.get(name), ring.count - 1) : undefined)} ${unit}`;
      key.style.background = colored.get(name) ?? "transparent";
    }
    if (!(this.trigger.mode === "normal" && this.held === null && this.drawn)) this.draw();
  }

  /** Returns the shown rows and the time of zero, in ticks. */
  part() {
    const rows = this.held?.rows ?? this.ring();
    if (!rows?.count) return null;
    const span = this.span(rows), last = rows.time(rows.count - 1), zero = this.held?.zero ?? last;
    const from = this.held?.zero == null ? last - span + 1 : zero - this.trigger.before(span);
    return { rows, start: rows.find(from), end: rows.find(from + span), zero };
  }

  /** Returns row numbers and times in seconds. A null row interrupts the line at a gap. */
  line({ rows, start, end, zero }) {
    const numbers = [], times = [];
    for (let i = start; i < end; i++) {
      if (i > start && !rows.follows(i)) {
        numbers.push(null);
        times.push(((rows.time(i - 1) + rows.time(i)) / 2 - zero) * rows.tick_s);
      }
      numbers.push(i);
      times.push((rows.time(i) - zero) * rows.tick_s);
    }
    return { numbers, times };
  }

  columns(rows) {
    return this.chosen.map((name, place) => ({ column: rows.numbers.get(name), color: COLORS[place % COLORS.length] }))
      .filter(({ column }) => column !== undefined)
      .map((one) => ({ ...one, ...rows.columns[one.column] }));
  }

  /** Creates one plot per unit. */
  rebuild() {
    for (const plot of this.plots) plot.destroy?.();
    by("plots").replaceChildren();
    this.plots = [];
    this.zoom = null;
    by("scope-note").textContent = "";
    const rows = this.held?.rows ?? this.ring();
    if (!rows) return;
    const view = by("view").value, columns = this.columns(rows);
    if (view === "xy") {
      const canvas = Object.assign(document.createElement("canvas"), { className: "xy", height: 420 });
      canvas.width = by("plots").clientWidth;
      by("plots").append(canvas);
      this.plots = [{ canvas, columns, destroy() {} }];
      return this.draw(true);
    }
    const units = [...new Set(columns.map(({ unit }) => unit))];
    const quiet = getComputedStyle(document.body).getPropertyValue("--quiet"), rule = getComputedStyle(document.body).getPropertyValue("--rule");
    const axis = { stroke: quiet, grid: { stroke: rule, width: 1 }, ticks: { stroke: rule, width: 1 } };
    units.forEach((unit) => {
      const shown = columns.filter((column) => column.unit === unit);
      const time = view === "time" ? "time (s)" : "frequency (Hz)";
      const value = (_, number) => (number == null ? "–" : `${digits(number)} ${unit}`);
      const plot = new window.uPlot({
        width: by("plots").clientWidth, height: HEIGHT,
        scales: { x: { time: false, distr: view === "spectrum" ? 3 : 1 } },
        cursor: { sync: { key: "scope" }, drag: { x: true, y: false } },
        series: [{ label: time, value: (_, number) => (number == null ? "–" : digits(number)) },
          ...shown.map(({ name, color }) => ({ label: name, stroke: color, width: 1.5, value, spanGaps: false }))],
        axes: [axis, { ...axis, size: 70, label: unit || "1", labelSize: 18, values: (_, numbers) => numbers.map(digits) }],
        hooks: {
          setSelect: [(self) => { this.zoom = self.select.width > 0; }],
          draw: [(self) => this.drawCursors(self)],
          ready: [(self) => {
            self.over.addEventListener("click", (event) => this.setCursor(self, event));
            self.over.addEventListener("dblclick", () => { this.zoom = null; });
          }],
        },
      }, [[], ...shown.map(() => [])], by("plots"));
      this.plots.push(Object.assign(plot, { shown }));
    });
    this.draw(true);
  }

  draw(always = false) {
    const part = this.part();
    if (!part || !this.plots.length) return;
    const { rows, start, end } = part, drawn = this.drawn;
    if (!always && drawn?.rows === rows && drawn.start === start && drawn.end === end) return;
    this.drawn = part;
    const view = by("view").value, { numbers, times } = this.line(part);
    const valuesOf = (column) => numbers.map((row) => {
      const value = row === null ? NaN : rows.at(column, row);
      return Number.isFinite(value) ? value : null;
    });
    if (view === "xy") {
      const [{ canvas, columns }] = this.plots;
      return drawXy(canvas, columns, ...columns.slice(0, 2).map(({ column }) => valuesOf(column)));
    }
    if (view === "spectrum") this.drawSpectra(valuesOf, rows, numbers.includes(null));
    else for (const plot of this.plots) plot.setData([times, ...plot.shown.map(({ column }) => valuesOf(column))], !this.zoom);
    this.showCursors();
  }

  /** Draws spectra, which require windows without missing values. */
  drawSpectra(valuesOf, rows, hasGap) {
    const wrong = [];
    for (const plot of this.plots) {
      const all = plot.shown.map(({ name, column }) => {
        const values = valuesOf(column);
        if (!hasGap && !values.includes(null)) return spectrum(values, rows.step * rows.tick_s);
        if (!hasGap) wrong.push(name);
        return null;
      });
      const frequencies = all.find((one) => one)?.frequencies ?? [];
      plot.setData([frequencies, ...all.map((one) => one?.amplitudes ?? frequencies.map(() => null))], !this.zoom);
    }
    by("scope-note").textContent = hasGap ? "No spectrum: ticks are missing in this window. Choose a window without gaps."
      : wrong.length ? `No spectrum of ${wrong.join(", ")}: this window contains NaN or infinite values.` : "";
  }

  setCursor(plot, event) {
    this.cursors[event.shiftKey ? 1 : 0] = plot.posToVal(event.offsetX, "x");
    this.draw(true);
  }

  drawCursors(plot) {
    this.cursors.forEach((at, number) => {
      if (at === null) return;
      const x = plot.valToPos(at, "x", true), { top, height } = plot.bbox;
      plot.ctx.save();
      plot.ctx.strokeStyle = plot.ctx.fillStyle = number ? "#d55e00" : "#009e73";
      plot.ctx.textAlign = "left";
      plot.ctx.setLineDash([6, 4]);
      plot.ctx.beginPath();
      plot.ctx.moveTo(x, top);
      plot.ctx.lineTo(x, top + height);
      plot.ctx.stroke();
      plot.ctx.fillText(number ? "B" : "A", x + 4, top + 14);
      plot.ctx.restore();
    });
  }

  showCursors() {
    const [a, b] = this.cursors;
    if (a === null || b === null) return;
    const nearest = (plot, at) => plot.data[0].reduce((best, x, i) => (Math.abs(x - at) < Math.abs(plot.data[0][best] - at) ? i : best), 0);
    const deltas = this.plots.flatMap((plot) => {
      const [i, j] = [nearest(plot, a), nearest(plot, b)];
      // Null values give no difference.
      return plot.shown.map(({ name, unit }, k) => `${name} ${digits((plot.data[k + 1][j] ?? NaN) - (plot.data[k + 1][i] ?? NaN))} ${unit}`);
    });
    const unit = by("view").value === "time" ? `s (${digits(1 / Math.abs(b - a))} Hz)` : "Hz";
    by("cursors").textContent = `B − A: ${digits(b - a)} ${unit}; ${deltas.join(", ")}`;
  }

  export() {
    const part = this.part();
    if (!part) return;
    const { rows, start, end } = part, columns = this.columns(rows);
    const head = ["tick", "time_s (s)", ...columns.map(({ header }) => `${this.name}.${header}`)].join(",");
    const lines = Array.from({ length: end - start }, (_, i) => {
      const row = start + i, tick = rows.tick(row);
      return [tick, Number((tick * rows.tick_s).toPrecision(12)), ...columns.map(({ column }) => rows.at(column, row))].join(",");
    });
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([[head, ...lines].join("\n")], { type: "text/csv" }));
    link.download = "scope.csv";
    link.click();
    URL.revokeObjectURL(link.href);
  }
}
