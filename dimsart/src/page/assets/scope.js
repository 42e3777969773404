// The scope: plots of the sources' signals over a window, running or held.
//
//   rows ──▶ Sources ──▶ window ──▶ curves (signals, math channels, traces) ──▶ Plots, Cursors, step figures
//                          ▲
//                 Trigger, pan, hold

import { by, node } from "./dom.js";
import { decimate, decimateTimes, partLength } from "./decimate.js";
import { Cursors } from "./cursors.js";
import { exportCsv, exportMcap, exportPng } from "./export.js";
import { spectrum } from "./fourier.js";
import { Layouts } from "./layouts.js";
import { parse } from "./math.js";
import { Plots, labelOf } from "./plots.js";
import { post } from "./request.js";
import { SignalList } from "./signal_list.js";
import { Sources, decodeRecording, keyOf, nameOf, sourceOf, startOf } from "./sources.js";
import { stepFigures, stepText } from "./step_figures.js";
import { showTraces } from "./traces.js";
import { Trigger } from "./trigger.js";
import { drawXy } from "./xy.js";

const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#56b4e9", "#8c564b", "#7f7f7f"];
const LIKED = ["POSITION", "POSITION[0]", "DES_POSITION", "DES_POSITION[0]", "DES_FORCE", "DES_FORCE[0]"];
const dark = matchMedia("(prefers-color-scheme: dark)");
const FIGURES_MS = 500;
/** Pause after a drawing, as a multiple of its duration. */
const RESTS = 4;

export class Scope {
  /** `choose` selects the signals that the device sends; `say` shows a text; `token` is that of the address. */
  constructor(choose, say, token) {
    this.say = say;
    this.token = token;
    this.sources = new Sources();
    this.panels = [];
    this.channels = [];
    this.isRunning = true;
    this.held = null;
    this.pan_s = 0;
    this.byStation = [];
    this.restUntil = 0;
    this.list = new SignalList((key, isOn) => this.toggle(key, isOn), choose);
    this.cursors = new Cursors(() => this.draw(true));
    this.plots = new Plots(by("plots"), this.cursors, (key, panel) => this.drop(key, panel));
    const change = () => { this.rearm(); this.rebuild(); };
    this.trigger = new Trigger(change);
    this.layouts = new Layouts(() => ({ panels: this.panels, channels: this.channels.map(({ name, text, unit }) => ({ name, text, unit })) }), (layout) => this.apply(layout));
    by("run").onclick = () => this.setRunning(!this.isRunning);
    by("fit").onclick = () => { this.plots.zoom = false; this.draw(true); };
    by("export").onclick = () => exportCsv(this.table());
    by("export-png").onclick = () => exportPng(this.xy ?? this.plots.picture());
    by("export-mcap").onclick = () => exportMcap(this.table(), token).catch((error) => say(error.message, true));
    by("view").onchange = () => { this.cursors.at = [null, null]; this.rebuild(); };
    by("columns").onchange = () => this.rebuild();
    by("window").onchange = change;
    by("pan").oninput = () => { this.pan_s = Number(by("pan").value); this.draw(true); };
    by("keep").onclick = () => this.keep();
    by("load").onclick = () => by("recording-file").click();
    by("recording-file").onchange = () => this.load(by("recording-file").files[0]).catch((error) => say(error.message, true));
    by("math-form").onsubmit = (event) => { event.preventDefault(); this.addChannel(by("math-name").value.trim(), by("math-text").value, by("math-unit").value.trim()); };
    by("plots").addEventListener("keydown", (event) => this.key(event));
    dark.addEventListener("change", () => this.rebuild());
    new ResizeObserver(() => this.rebuild()).observe(by("plots"));
    setInterval(() => this.frame(), 50);
  }

  ring() { return this.sources.rings[this.station]; }

  /** Rows by source: held, or live. */
  rings() {
    const pair = (name, station) => /** @type {[string, any]} */ ([name, this.sources.rings[station]]);
    return this.held?.rings ?? new Map(this.sources.names.map(pair).filter(([, ring]) => ring));
  }

  gaps(station) { return this.sources.rings[station]?.gaps ?? 0; }

  last(station) { return this.sources.last(station); }

  rows(data) { return this.sources.rows(data); }

  /** Shows another source of a recording. */
  choose(station) {
    [this.station, this.name, this.panels] = [station, this.sources.names[station], []];
    this.choosePanels(this.sources.rings[station]);
    this.relist();
  }

  /** Sets the names of the stations, and whether each has the clock of a simulation. */
  setNames(names) { this.sources.names = names; }

  shareClock(station, isShared) { this.sources.shared[station] = isShared; }

  layout(station, content, period_s) { if (this.sources.layout(station, content, period_s)) this.changed(station); }

  period(station, period_s) { if (this.sources.period(station, period_s)) this.changed(station); }

  changed(station) {
    if (station === this.station) this.rearm();
    if (this.isRunning) this.relist();
  }

  /** Forgets a replaced station. */
  forget(station) {
    delete this.byStation[station];
    delete this.sources.rings[station];
    if (station === this.station) this.setRunning(true);
  }

  /** Shows the signals of a station; each station keeps its plots and its held picture. */
  show(station, name) {
    this.name = name;
    if (station === this.station) return;
    if (this.station !== undefined) this.byStation[this.station] = { panels: this.panels, held: this.isRunning ? null : this.held };
    const known = this.byStation[station];
    this.station = station;
    this.panels = known?.panels ?? [];
    this.held = known?.held ?? null;
    if (!this.isOpened) {
      this.isOpened = true;
      const layout = this.layouts.read();
      if (layout) return this.layouts.show(layout);
    }
    this.setRunning(!this.held);
    if (this.held) { this.rearm(); this.relist(); }
  }

  /** Shows a layout; signals that no source has are dropped later, when all layouts are known. */
  apply({ panels, channels }) {
    this.panels = Array.isArray(panels) ? panels : [];
    this.channels = [];
    for (const { name, text, unit } of channels ?? []) this.define(name, text, unit);
    this.setRunning(!this.held);
    this.relist();
  }

  has(key) {
    const ring = this.rings().get(sourceOf(key));
    const channel = this.channels.find(({ name }) => name === nameOf(key));
    return ring && (channel ? channel.names.every((name) => ring.numbers.has(name)) : ring.numbers.has(nameOf(key)));
  }

  unit(key) {
    const ring = this.rings().get(sourceOf(key)), column = ring?.numbers.get(nameOf(key));
    return this.channels.find(({ name }) => name === nameOf(key))?.unit ?? ring?.columns[column]?.unit ?? "";
  }

  /** Builds the list of signals. */
  relist() {
    const rings = this.rings(), own = rings.get(this.name);
    this.list.show(this.name, rings, this.channels, this.isRunning);
    const names = [...(own?.numbers.keys() ?? [])];
    this.trigger.offer(names, this.keys().length ? nameOf(this.keys()[0]) : names[0]);
    this.showTraces();
    this.rebuild();
  }

  keys() { return this.panels.flat(); }

  toggle(key, isOn) {
    if (isOn) this.place(key);
    else this.panels = this.panels.map((panel) => panel.filter((other) => other !== key)).filter(({ length }) => length);
    this.rebuild();
  }

  /** Adds a signal to the first plot with its unit, or to a new plot. */
  place(key) {
    const panel = this.panels.find((keys) => keys.every((other) => this.unit(other) === this.unit(key)));
    if (panel) panel.push(key);
    else this.panels.push([key]);
  }

  drop(key, panel) {
    const target = this.panels[panel];
    if (target) {
      const units = new Set([...target, key].map((one) => this.unit(one)));
      if (units.size > 2) return this.say(`a plot has at most two units: ${[...units].join(", ")}`, true);
      if (!target.includes(key)) target.push(key);
    } else {
      this.panels.push([key]);
    }
    this.rebuild();
  }

  define(name, text, unit) {
    const { names, evaluate } = parse(text);
    this.channels = [...this.channels.filter((known) => known.name !== name), { name, text, unit, names, evaluate }];
  }

  addChannel(name, text, unit) {
    try {
      if (!/^[A-Za-z_]\w*$/.test(name)) throw new Error("the name of a math channel has letters, digits and _");
      if (this.rings().get(this.name)?.numbers.has(name)) throw new Error(`${name} is a signal: choose another name`);
      this.define(name, text, unit);
      const key = keyOf(name, this.name);
      const missing = this.channels.at(-1).names.filter((signal) => !this.rings().get(this.name)?.numbers.has(signal));
      if (missing.length) throw new Error(`${this.name} has no signal ${missing.join(", ")}`);
      if (!this.keys().includes(key)) this.place(key);
      this.relist();
    } catch (error) {
      this.channels = this.channels.filter((known) => known.names.every((signal) => this.rings().get(this.name)?.numbers.has(signal)));
      this.say(error.message, true);
    }
  }

  setRunning(isRunning) {
    if (!isRunning && !this.held) {
      if (!this.ring()?.count) return;
      const to_s = this.end_s();
      this.held = { rings: this.sources.copy(-Infinity, Infinity), to_s, zero_s: to_s, isTriggered: false };
    }
    this.isRunning = isRunning;
    by("run").textContent = isRunning ? "Running" : "Held";
    by("run").setAttribute("aria-pressed", isRunning);
    this.pan_s = 0;
    if (isRunning) {
      this.rearm();
      this.relist();
    }
    this.offerPan();
  }

  /** Rearms the trigger for new rows; a picture held by the user stays. */
  rearm() {
    this.trigger.arm(this.ring());
    if (this.isRunning) this.held = null;
  }

  /** End of the rows of the shown station, s. */
  end_s() {
    const ring = this.ring();
    return ring.seconds(ring.count - 1) + ring.step * ring.tick_s;
  }

  span_s() {
    const ring = this.rings().get(this.name);
    if (by("window").value === "all" && ring?.count) {
      // From the first row of all sources to the end of the window.
      const starts = [...this.rings().values()].filter(({ count }) => count).map((one) => one.seconds(one.oldest()));
      return (this.held?.to_s ?? this.end_s()) - Math.min(...starts);
    }
    return Math.max(Number(by("window").value) || 2, 2 * (ring ? ring.step * ring.tick_s : 0));
  }

  /** Offers to move a held window over the stored rows. */
  offerPan() {
    const ring = this.held?.rings.get(this.name);
    by("pan").hidden = this.isRunning || !ring?.count;
    if (by("pan").hidden) return;
    const span = this.span_s(), to_s = this.held.isTriggered ? this.held.to_s : ring.seconds(ring.count - 1);
    const least = Math.min(0, ring.seconds(ring.oldest()) + span - to_s), most = Math.max(0, ring.seconds(ring.count - 1) - to_s);
    by("pan").hidden = least === most;
    Object.assign(by("pan"), { min: least, max: most, step: "any", value: this.pan_s });
  }

  /** Holds the picture when the trigger fired and the window is complete. */
  watchTrigger(ring) {
    const { mode } = this.trigger, span_s = this.span_s(), span = Math.round(span_s / ring.tick_s);
    if (mode === "off" || !this.isRunning) return;
    const fired = this.trigger.watch(ring, span);
    if (fired) {
      const zero_s = ring.start_s + fired.time * ring.tick_s, from_s = zero_s - this.trigger.before(span) * ring.tick_s;
      // A single shot keeps all rows, for other windows.
      const rings = this.sources.copy(mode === "single" ? -Infinity : from_s, mode === "single" ? Infinity : from_s + span_s);
      this.held = { rings, to_s: from_s + span_s, zero_s, isTriggered: true };
      this.shownAt = performance.now();
      this.trigger.say(`fired at tick ${fired.tick}`);
      if (mode === "single") this.setRunning(false);
    } else if (mode === "auto" && performance.now() - (this.shownAt ?? 0) > 1000 + 1000 * span_s) {
      this.held = null;
      this.trigger.say("no trigger, running free");
    } else if (this.held === null) {
      this.trigger.say("waiting for the trigger");
    }
  }

  frame() {
    const ring = this.rings().get(this.name);
    if (!ring?.count || document.hidden) return;
    if (this.ring()?.count) this.watchTrigger(this.ring());
    if (!this.keys().length && this.isRunning) this.choosePanels(ring);
    const live = new Map(this.sources.names.map((name, station) => [name, this.sources.rings[station]]));
    this.list.mark(this.colors(), (key) => {
      const rows = live.get(sourceOf(key)), column = rows?.numbers.get(nameOf(key));
      return column === undefined || !rows.count ? undefined : rows.at(column, rows.count - 1);
    });
    if (this.trigger.mode === "normal" && this.held === null && this.drawn) return;
    // A large window must leave time for the presence messages of the page.
    const start = performance.now();
    if (start < this.restUntil) return;
    this.draw();
    // uPlot draws in a microtask, which runs before this one.
    queueMicrotask(() => {
      const now = performance.now();
      this.restUntil = now + RESTS * (now - start);
    });
  }

  choosePanels(ring) {
    const liked = LIKED.filter((name) => ring.numbers.has(name));
    for (const name of liked.length ? liked : [...ring.numbers.keys()].slice(0, 1)) this.place(keyOf(name, this.name));
    this.rebuild();
  }

  colors() { return new Map([...new Set(this.keys())].map((key, place) => [key, COLORS[place % COLORS.length]])); }

  /** The window on the common axis and the time of zero, s. */
  window() {
    const span_s = this.span_s();
    const to_s = (this.held?.to_s ?? this.end_s()) + this.pan_s;
    return { from_s: to_s - span_s, to_s, zero_s: this.held?.zero_s ?? to_s };
  }

  /** Row numbers and times of a source in the window. A null row interrupts the lines at a gap. */
  part(ring, { from_s, to_s, zero_s }) {
    const numbers = [], times = [], start = ring.findSeconds(from_s), end = ring.findSeconds(to_s);
    for (let i = start; i < end; i++) {
      if (i > start && !ring.follows(i)) {
        numbers.push(null);
        times.push((ring.seconds(i - 1) + ring.seconds(i)) / 2 - zero_s);
      }
      numbers.push(i);
      times.push(ring.seconds(i) - zero_s);
    }
    return { ring, numbers, times, hasGap: numbers.includes(null) };
  }

  /** Values of a signal or math channel by name; NaN in gaps. */
  values({ ring, numbers }, name) {
    const of = (column) => {
      const values = new Float64Array(numbers.length);
      for (let i = 0; i < values.length; i++) values[i] = numbers[i] === null ? NaN : ring.at(column, numbers[i]);
      return values;
    };
    const channel = this.channels.find((known) => known.name === name);
    if (!channel) return of(ring.numbers.get(name));
    return Float64Array.from(channel.evaluate((signal) => Array.from(of(ring.numbers.get(signal))), numbers.length, ring.step * ring.tick_s));
  }

  /** Creates the plots of the present panels. */
  rebuild() {
    by("scope-note").textContent = "";
    const rings = this.rings();
    if (rings.size) this.panels = this.panels.map((panel) => panel.filter((key) => this.has(key) || !rings.has(sourceOf(key)))).filter(({ length }) => length);
    this.offerPan();
    const view = by("view").value, colors = this.colors(), isAlone = new Set(this.keys().map(sourceOf)).size < 2;
    const curves = (key) => {
      const own = { key, label: labelOf(key, isAlone), unit: this.unit(key), color: colors.get(key) };
      const traces = this.sources.traces.filter((trace) => trace.isShown && this.sources.ofTrace(trace, sourceOf(key))?.numbers.has(nameOf(key)));
      return [own, ...traces.map((trace) => ({ ...own, label: `${own.label} (${trace.name})`, trace, dash: [4, 3] }))];
    };
    const panels = this.panels.map((panel) => ({ curves: panel.filter((key) => this.has(key)).flatMap(curves) })).filter((panel) => panel.curves.length);
    // Before a source is shown, the layout of the address is not yet read.
    if (this.isOpened) this.layouts.write();
    this.xy = null;
    if (view === "xy") {
      this.plots.build([], "time", 1);
      this.xy = node("canvas", { className: "xy", height: 420, width: by("plots").clientWidth });
      by("plots").replaceChildren(this.xy);
    } else {
      this.plots.build(panels, view, Number(by("columns").value));
    }
    this.draw(true);
  }

  draw(always = false) {
    const rings = this.rings(), ring = rings.get(this.name);
    if (!ring?.count || (!this.held && !this.ring()?.count)) return;
    const span = this.window(), drawn = `${span.from_s} ${span.to_s} ${ring.count}`;
    if (!always && this.drawn === drawn) return;
    this.drawn = drawn;
    const parts = new Map();
    const partOf = (rows, at) => {
      if (!parts.has(rows)) parts.set(rows, this.part(rows, at));
      return parts.get(rows);
    };
    /** @param {{ key: string, trace?: any }} one */
    const curve = ({ key, trace }) => {
      const offset_s = trace && trace.zero_s - trace.shift_s - span.zero_s;
      const at = trace && { from_s: span.from_s + offset_s, to_s: span.to_s + offset_s, zero_s: span.zero_s + offset_s };
      const part = trace ? partOf(this.sources.ofTrace(trace, sourceOf(key)), at) : partOf(rings.get(sourceOf(key)), span);
      return { part, values: this.values(part, nameOf(key)) };
    };
    const finite = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));
    const width = by("plots").clientWidth / Number(by("columns").value);
    const shortTimes = new Map();
    const view = by("view").value;
    if (view === "xy") {
      const two = this.keys().filter((key) => this.has(key)).slice(0, 2).map((key) => ({ name: nameOf(key), unit: this.unit(key), color: this.colors().get(key), ...curve({ key }) }));
      return drawXy(this.xy, two, ...two.map(({ values }) => finite(values)));
    }
    const wrong = [];
    const tables = this.plots.all.map(({ curves }) => curves.map((one) => {
      const { part, values } = curve(one);
      if (view === "time") {
        const length = partLength(values.length, width);
        if (!shortTimes.has(part)) shortTimes.set(part, decimateTimes(part.times, length));
        return [shortTimes.get(part), decimate(values, length)];
      }
      if (part.hasGap || !values.every(Number.isFinite) || values.length < 4) {
        wrong.push(`${one.label} (${part.hasGap ? "ticks are missing" : "NaN or infinite values"})`);
        return [[], []];
      }
      const { frequencies, amplitudes } = spectrum(values, part.ring.step * part.ring.tick_s);
      return [frequencies, view === "db" ? amplitudes.map((value) => 20 * Math.log10(Math.max(value, 1e-12))) : amplitudes];
    }));
    by("scope-note").textContent = wrong.length ? `No spectrum of ${[...new Set(wrong)].join(", ")} in this window.` : "";
    this.plots.draw(tables);
    this.cursors.show(this.plots.all, view === "time" ? "s" : "Hz");
    this.showSteps(rings, (rows) => partOf(rows, span), view);
  }

  /** Shows the figures of the last step of each reference with a plotted measurement. */
  showSteps(rings, partOf, view) {
    const now = performance.now();
    if (view !== "time" || (this.isRunning && now - (this.figuresAt ?? 0) < FIGURES_MS)) return;
    this.figuresAt = now;
    const texts = [...new Set(this.keys())].map((key) => {
      const ring = rings.get(sourceOf(key)), reference = `DES_${nameOf(key)}`;
      if (!ring?.numbers.has(nameOf(key)) || !ring.numbers.has(reference)) return "";
      const part = partOf(ring), values = (name) => Array.from(this.values(part, name));
      return stepText(nameOf(key), this.unit(key), stepFigures(part.times, values(reference), values(nameOf(key))));
    });
    by("step-figures").replaceChildren(...texts.filter(Boolean).map((textContent) => node("li", { textContent })));
  }

  key(event) {
    const rows = { ArrowLeft: -1, ArrowRight: 1 }[event.key], x = this.plots.all[0]?.plot.data[0];
    if (!rows || !x) return;
    event.preventDefault();
    this.cursors.move(event.shiftKey ? 1 : 0, rows * (event.ctrlKey ? 20 : 1), x);
  }

  /** Stores the window as a trace to compare with. */
  keep() {
    if (!this.ring()?.count && !this.held) return;
    const { from_s, to_s, zero_s } = this.window();
    const copies = new Map([...this.rings()].map(([name, ring]) => [name, ring.copy(ring.findSeconds(from_s), ring.findSeconds(to_s))]));
    this.addTrace(copies, zero_s);
  }

  /** Loads a recording (MCAP) as a trace. */
  async load(file) {
    if (!file) return;
    const response = await post("recording", file, this.token).catch((error) => { throw new Error(`${file.name}: ${error.message}`); });
    const rings = decodeRecording(await response.arrayBuffer());
    this.align(rings, startOf(rings), file.name);
  }

  /** Shows recordings in place of live controllers: the first as source, further ones as traces. */
  open(recordings) {
    const [{ rings }, ...others] = recordings;
    this.sources.names = [...rings.keys()];
    this.sources.rings = [...rings.values()];
    [this.station, this.name, this.isRunning] = [0, this.sources.names[0], false];
    const zero_s = startOf(rings);
    const to_s = Math.max(...this.sources.rings.map((ring) => ring.seconds(ring.count - 1) + ring.step * ring.tick_s));
    this.held = { rings, to_s, zero_s, isTriggered: false };
    this.isRecorded = true;
    for (const other of others) this.sources.keep(other.rings, startOf(other.rings), other.name);
    by("window").value = "all";
    this.choosePanels(this.sources.rings[0]);
    const layout = this.layouts.read();
    this.isOpened = true;
    if (layout) this.layouts.show(layout);
    this.relist();
  }

  /** Marks times of a recording with texts. */
  mark(marks) {
    this.plots.marks = marks.map(({ time_s, text }) => ({ at: time_s - this.held.zero_s, text }));
    this.draw(true);
  }

  /** Adds rows as a trace; `zero_s` is its time at a trigger. Without a trigger, it ends where the plots end. */
  align(rings, zero_s, name) {
    const end_s = Math.max(...[...rings.values()].map((ring) => ring.seconds(ring.count - 1)));
    const isAtEnd = !this.held?.isTriggered && !this.isRecorded;
    this.addTrace(rings, isAtEnd ? end_s : zero_s, name);
  }

  /** Adds rows as a trace; `zero_s` is its time at the zero of the plots. */
  addTrace(rings, zero_s, name) {
    this.sources.keep(rings, zero_s, name);
    this.showTraces();
    this.rebuild();
  }

  /**
   * Returns the last seconds of signals of the shown source, of the held picture if there is one: sample period of the rows and of
   * the ticks, and the values of the first known name of each entry of `wanted`.
   */
  series(wanted, seconds) {
    const ring = this.rings().get(this.name);
    if (!ring?.count) throw new Error("the scope has no rows yet");
    const to_s = ring.seconds(ring.count - 1) + ring.step * ring.tick_s;
    const part = this.part(ring, { from_s: to_s - seconds, to_s, zero_s: to_s });
    if (part.hasGap) throw new Error("ticks are missing in these rows: repeat the excitation");
    const values = wanted.map((names) => names.find((name) => ring.numbers.has(name))).map((name) => (name === undefined ? null : Array.from(this.values(part, name))));
    return { period_s: ring.step * ring.tick_s, tick_s: ring.tick_s, values };
  }

  showTraces() {
    showTraces(this.sources, (isRebuilt) => (isRebuilt ? this.rebuild() : this.draw(true)));
  }

  /** Rows of the shown signals of the shown source in the window, for exports. */
  table() {
    const ring = this.rings().get(this.name), part = this.part(ring, this.window());
    const names = [...new Set(this.keys().filter((key) => sourceOf(key) === this.name && this.has(key)).map(nameOf))];
    const columns = names.map((name) => {
      const known = ring.columns[ring.numbers.get(name)];
      return { name, header: `${this.name}.${known?.header ?? name}`, signal: known?.signal ?? name, unit: this.unit(keyOf(name, this.name)), values: this.values(part, name) };
    });
    const rows = part.numbers.map((row, i) => ({ row, i })).filter(({ row }) => row !== null);
    return { source: this.name, columns, period_s: ring.step * ring.tick_s, rows: rows.map(({ row, i }) => ({ tick: ring.tick(row), time_s: ring.tick(row) * ring.tick_s, values: columns.map(({ values }) => values[i]) })) };
  }
}
