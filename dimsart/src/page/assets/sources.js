// Sources of the scope: the rows of live controllers or of a recording, by name, and stored traces to compare with.

import { Ring } from "./ring.js";

/** Key of a signal of a source. Signal names contain no @. */
export const keyOf = (name, source) => `${name}@${source}`;
export const nameOf = (key) => key.slice(0, key.indexOf("@"));
export const sourceOf = (key) => key.slice(key.indexOf("@") + 1);

export class Sources {
  constructor() {
    this.names = [];
    this.rings = [];
    this.shared = [];
    this.traces = [];
    this.counter = 0;
  }

  ring(name) { return this.rings[this.names.indexOf(name)]; }

  /** Sets the layout of a station's rows; returns whether its signals have changed. An unchanged layout keeps the rows. */
  layout(station, { unsent, ...layout }, period_s) {
    const ring = this.rings[station];
    if (!ring || JSON.stringify(ring.layout) !== JSON.stringify(layout)) {
      this.rings[station] = new Ring(layout, period_s ?? ring?.tick_s ?? 0.001, unsent);
      return true;
    }
    if (String(ring.unsent) === String(unsent)) return false;
    ring.unsent = unsent;
    return true;
  }

  /** Sets the sample period; returns whether earlier rows were dropped because their times are wrong. */
  period(station, period_s) {
    const ring = this.rings[station];
    if (!ring || Math.abs(ring.tick_s - period_s) <= 1e-9 * period_s) return false;
    this.rings[station] = new Ring(ring.layout, period_s, ring.unsent);
    return true;
  }

  /** Handles a message of rows and returns its station. */
  rows(data) {
    const view = new DataView(data);
    const station = view.getUint8(0), width = view.getUint16(2, true), number = view.getUint32(4, true);
    const ring = this.rings[station];
    if (!ring || ring.layout.number !== number || ring.columns.length !== width) return station;
    for (let at = 8; at + 4 + 4 * width <= data.byteLength; at += 4 + 4 * width) ring.push(view.getUint32(at, true), view, at + 4);
    if (ring.count) ring.align(performance.now() / 1000, this.shared[station]);
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

  /** Copies the rows of all sources in an interval of the common axis, s, because the rings continue. */
  copy(from_s, to_s) {
    const copies = new Map();
    this.names.forEach((name, station) => {
      const ring = this.rings[station];
      if (ring?.count) copies.set(name, ring.copy(ring.findSeconds(from_s), ring.findSeconds(to_s)));
    });
    return copies;
  }

  /** Stores rows by source as a trace; `zero_s` is its time that is aligned with the zero of the plots. */
  keep(rings, zero_s, name = `trace ${++this.counter}`) {
    this.traces.push({ name, rings, zero_s, shift_s: 0, isShown: true });
  }

  /** Returns the rows of a trace that correspond to a source. */
  ofTrace(trace, source) {
    return trace.rings.get(source) ?? (trace.rings.size === 1 ? [...trace.rings.values()][0] : undefined);
  }
}

/** Time of the first row of all sources, s. */
export const startOf = (rings) => Math.min(...[...rings.values()].map(({ start_s }) => start_s));

/** Reads rows as sent by the server: length of the header, header (JSON), then per source ticks (u32) and columns (f32). */
export function decodeRecording(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const { sources } = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length + ((4 - (length % 4)) % 4);
  const take = (kind, count) => {
    const part = new kind(buffer, at, count);
    at += 4 * count;
    return part;
  };
  return new Map(sources.map(({ name, layout, period_s, start_s, rows }) => {
    const ticks = take(Uint32Array, rows);
    const width = layout.signals.reduce((sum, { words }) => sum + words, 0);
    const ring = Ring.loaded(layout, period_s, ticks, Array.from({ length: width }, () => take(Float32Array, rows)));
    ring.start_s = start_s;
    return [name, ring];
  }));
}
