// The scope: the last minute of every tick's signals, as they go on or held by a trigger, over time, by frequency, or one over
// another.

import { digits } from "/device.js";
import { spectrum } from "/fourier.js";

const by = (id) => document.getElementById(id);
const SECONDS = 60, COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#56b4e9", "#8c564b", "#7f7f7f"];
const dark = matchMedia("(prefers-color-scheme: dark)");
const HEIGHT = 190;

/** The ticks of a station: a ring, from the oldest to the newest. */
class Ring {
  constructor(layout, period_s) {
    this.signals = layout.signals;
    this.columns = layout.signals.flatMap(({ name, unit, words }) => Array.from({ length: words },
      (_, place) => ({ signal: name, place, unit, name: words > 1 ? `${name}[${place}]` : name })));
    this.number = layout.number;
    this.step = layout.every_ticks;
    this.period_s = period_s * this.step;
    this.size = Math.round(Math.min(SECONDS / this.period_s, 60000));
    this.values = this.columns.map(() => new Float32Array(this.size));
    this.ticks = new Float64Array(this.size);
    this.count = 0;
    this.gaps = 0;
  }

  push(tick, view, at) {
    const place = this.count % this.size;
    const last = this.count ? this.ticks[(this.count - 1) % this.size] : tick - this.step;
    // A gap of a minute is another start of the device.
    const missing = (tick - last) / this.step - 1;
    if (missing > 0 && missing < this.size) this.gaps += Math.round(missing);
    this.ticks[place] = tick;
    for (let i = 0; i < this.values.length; i++) this.values[i][place] = view.getFloat32(at + 4 * i, true);
    this.count++;
  }

  at(column, number) { return this.values[column][number % this.size]; }

  oldest() { return Math.max(0, this.count - this.size); }
}

export class Scope {
  constructor() {
    this.rings = [];
    this.chosen = [];
    this.plots = [];
    this.isRunning = true;
    this.held = null;
    this.cursors = [null, null];
    by("run").onclick = () => this.setRunning(!this.isRunning);
    by("fit").onclick = () => { this.zoom = null; this.draw(true); };
    by("export").onclick = () => this.export();
    for (const id of ["window", "view", "trigger-mode", "trigger-source", "trigger-edge", "trigger-level", "trigger-before"]) {
      by(id).onchange = () => { this.held = null; this.armed = this.ring()?.count ?? 0; this.rebuild(); };
    }
    by("signal-filter").oninput = () => this.filter();
    dark.onchange = () => this.rebuild();
    new ResizeObserver(() => this.rebuild()).observe(by("plots"));
    setInterval(() => this.frame(), 50);
  }

  ring() { return this.rings[this.station]; }

  gaps(station) { return this.rings[station]?.gaps ?? 0; }

  layout(station, layout, period_s) {
    this.rings[station] = new Ring(layout, period_s ?? 0.001);
    if (station === this.station) this.list();
  }

  period(station, period_s) {
    const ring = this.rings[station];
    if (ring && Math.abs(ring.period_s - period_s * ring.step) > 1e-9 * period_s) {
      // What came before the period was known goes: its place in the ring is another one.
      const layout = { number: ring.number, every_ticks: ring.step, signals: ring.signals };
      this.rings[station] = new Ring(layout, period_s);
    }
  }

  /** Takes a message of rows; the station that it is of. */
  rows(data) {
    const view = new DataView(data);
    const station = view.getUint8(0), width = view.getUint16(2, true), number = view.getUint32(4, true);
    const ring = this.rings[station];
    if (!ring || ring.number !== number || ring.columns.length !== width) return station;
    for (let at = 8; at + 4 + 4 * width <= data.byteLength; at += 4 + 4 * width) {
      ring.push(view.getUint32(at, true), view, at + 4);
    }
    return station;
  }

  /** What the last tick left: values and unit by the name of a signal. */
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

  show(station) {
    if (station === this.station) return;
    this.station = station;
    this.chosen = [];
    this.list();
  }

  /** The list of signals to choose from. */
  list() {
    const ring = this.ring();
    this.held = null;
    if (!ring) return;
    const names = ring.columns.map(({ name }) => name);
    this.chosen = this.chosen.filter((name) => names.includes(name));
    if (!this.chosen.length) {
      const liked = ["POSITION", "POSITION[0]", "DES_POSITION", "DES_POSITION[0]", "DES_FORCE", "DES_FORCE[0]"];
      this.chosen = liked.filter((name) => names.includes(name));
      if (!this.chosen.length) this.chosen = names.slice(0, 1);
    }
    by("signals").replaceChildren(...ring.columns.map(({ name, unit }) => {
      const label = document.createElement("label");
      label.dataset.name = name.toLowerCase();
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: this.chosen.includes(name) });
      box.onchange = () => {
        this.chosen = box.checked ? [...this.chosen, name] : this.chosen.filter((other) => other !== name);
        this.rebuild();
      };
      const parts = ["key", "name", "value"].map((kind) => Object.assign(document.createElement("span"), { className: kind }));
      parts[1].textContent = name;
      parts[1].title = name;
      label.append(box, ...parts);
      label.value = parts[2];
      label.unit = unit;
      label.key = parts[0];
      return label;
    }));
    by("trigger-source").replaceChildren(...names.map((name) => Object.assign(document.createElement("option"), { value: name, textContent: name })));
    if (this.chosen.length) by("trigger-source").value = this.chosen[0];
    this.filter();
    this.rebuild();
  }

  filter() {
    const wanted = by("signal-filter").value.trim().toLowerCase();
    for (const label of by("signals").children) label.hidden = !label.dataset.name.includes(wanted);
  }

  setRunning(isRunning) {
    this.isRunning = isRunning;
    by("run").textContent = isRunning ? "Running" : "Held";
    by("run").setAttribute("aria-pressed", isRunning);
    if (isRunning) { this.held = null; this.armed = this.ring()?.count ?? 0; }
    else this.held ??= this.ring()?.count ?? 0;
  }

  ticks() { return Math.max(2, Math.round(Number(by("window").value) / this.ring().period_s)); }

  /** Looks for the trigger in what is new; holds the picture when it is whole. */
  watchTrigger(ring) {
    const mode = by("trigger-mode").value;
    if (mode === "off" || !this.isRunning) return;
    const source = ring.columns.findIndex(({ name }) => name === by("trigger-source").value);
    if (source < 0) return;
    by("trigger-unit").textContent = ring.columns[source].unit;
    const level = Number(by("trigger-level").value), edge = by("trigger-edge").value;
    const ticks = this.ticks(), before = Math.round((ticks * Number(by("trigger-before").value)) / 100);
    if (this.fired === undefined || this.fired === null) {
      for (let i = Math.max(this.armed ?? 0, ring.oldest() + 1); i < ring.count; i++) {
        const [past, now] = [ring.at(source, i - 1), ring.at(source, i)];
        const rises = past < level && now >= level, falls = past > level && now <= level;
        if ((rises && edge !== "fall") || (falls && edge !== "rise")) { this.fired = i; break; }
      }
      this.armed = Math.max(this.armed ?? 0, ring.count);
    }
    if (this.fired != null && ring.count >= this.fired - before + ticks) {
      this.held = this.fired - before + ticks;
      this.shownAt = performance.now();
      by("trigger-state").textContent = `fired at tick ${ring.ticks[this.fired % ring.size]}`;
      this.fired = null;
      if (mode === "single") this.setRunning(false);
    } else if (mode === "auto" && performance.now() - (this.shownAt ?? 0) > 1000 + 1000 * ticks * ring.period_s) {
      this.held = null;
      by("trigger-state").textContent = "waits, and goes on meanwhile";
    } else if (this.held === null) {
      by("trigger-state").textContent = "waits for the trigger";
    }
  }

  frame() {
    const ring = this.ring();
    if (!ring?.count || document.hidden) return;
    this.watchTrigger(ring);
    const colored = new Map(this.chosen.map((name, place) => [name, COLORS[place % COLORS.length]]));
    [...by("signals").children].forEach((label, column) => {
      label.value.textContent = `${digits(ring.at(column, ring.count - 1))} ${label.unit}`;
      label.key.style.background = colored.get(ring.columns[column].name) ?? "transparent";
    });
    if (!(by("trigger-mode").value === "normal" && this.held === null && this.drawn)) this.draw();
  }

  /** The shown part: places of the ring, and times from its end or from the trigger. */
  part(ring) {
    const end = Math.min(this.held ?? ring.count, ring.count), ticks = this.ticks();
    const start = Math.max(end - ticks, ring.oldest());
    const isTriggered = this.held !== null && by("trigger-mode").value !== "off";
    const zero = isTriggered ? end - ticks + Math.round((ticks * Number(by("trigger-before").value)) / 100) : end - 1;
    const times = [];
    for (let i = start; i < end; i++) times.push((i - zero) * ring.period_s);
    return { start, end, times };
  }

  columns(ring) {
    return this.chosen.map((name, place) => ({ column: ring.columns.findIndex((one) => one.name === name), color: COLORS[place % COLORS.length] }))
      .filter(({ column }) => column >= 0)
      .map((one) => ({ ...one, ...ring.columns[one.column] }));
  }

  /** A plot for each unit: values of different units share no axis. */
  rebuild() {
    for (const plot of this.plots) plot.destroy?.();
    by("plots").replaceChildren();
    this.plots = [];
    const ring = this.ring();
    if (!ring) return;
    const view = by("view").value, columns = this.columns(ring);
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
    const ring = this.ring();
    if (!ring?.count || !this.plots.length) return;
    const { start, end, times } = this.part(ring);
    if (!always && this.drawn === `${start} ${end}`) return;
    this.drawn = `${start} ${end}`;
    const view = by("view").value;
    const valuesOf = (column) => Array.from({ length: end - start }, (_, i) => {
      const value = ring.at(column, start + i);
      return Number.isFinite(value) ? value : null;
    });
    if (view === "xy") return this.drawXy(valuesOf);
    for (const plot of this.plots) {
      const data = view === "spectrum" ? this.spectra(plot, valuesOf, ring) : [times, ...plot.shown.map(({ column }) => valuesOf(column))];
      plot.setData(data, !this.zoom);
    }
    this.showCursors(ring);
  }

  spectra(plot, valuesOf, ring) {
    const all = plot.shown.map(({ column }) => spectrum(valuesOf(column).map((value) => value ?? 0), ring.period_s));
    return [all[0]?.frequencies ?? [], ...all.map(({ amplitudes }) => amplitudes)];
  }

  drawXy(valuesOf) {
    const [{ canvas, columns }] = this.plots, context = canvas.getContext("2d");
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.fillStyle = getComputedStyle(document.body).getPropertyValue("--quiet");
    context.font = "13px system-ui";
    if (columns.length < 2) return context.fillText("choose two signals: the second one is drawn over the first", 20, 30);
    const [x, y] = [valuesOf(columns[0].column), valuesOf(columns[1].column)];
    const range = (values) => {
      const [low, high] = [Math.min(...values), Math.max(...values)];
      return high > low ? [low, high] : [low - 1, high + 1];
    };
    const [left, right] = range(x), [low, high] = range(y), [w, h] = [canvas.width - 90, canvas.height - 60];
    context.strokeStyle = columns[1].color;
    context.beginPath();
    x.forEach((value, i) => context.lineTo(70 + (w * (value - left)) / (right - left), 20 + h - (h * (y[i] - low)) / (high - low)));
    context.stroke();
    context.fillText(`${columns[0].name} (${columns[0].unit}): ${digits(left)} to ${digits(right)}`, 70, canvas.height - 12);
    context.fillText(`${columns[1].name} (${columns[1].unit}): ${digits(low)} to ${digits(high)}`, 10, 14);
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
      return plot.shown.map(({ name, unit }, k) => `${name} ${digits(plot.data[k + 1][j] - plot.data[k + 1][i])} ${unit}`);
    });
    const unit = by("view").value === "time" ? `s (${digits(1 / Math.abs(b - a))} Hz)` : "Hz";
    by("cursors").textContent = `B − A: ${digits(b - a)} ${unit}; ${deltas.join(", ")}`;
  }

  export() {
    const ring = this.ring();
    if (!ring?.count) return;
    const { start, end } = this.part(ring), columns = this.columns(ring);
    const head = ["tick", "time (s)", ...columns.map(({ name, unit }) => `${name} (${unit})`)].join(",");
    const rows = Array.from({ length: end - start }, (_, i) => {
      const tick = ring.ticks[(start + i) % ring.size];
      return [tick, (tick * ring.period_s) / ring.step, ...columns.map(({ column }) => ring.at(column, start + i))].join(",");
    });
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([[head, ...rows].join("\n")], { type: "text/csv" }));
    link.download = "scope.csv";
    link.click();
    URL.revokeObjectURL(link.href);
  }
}
