// Ring buffer of received rows, with gaps and restarts of the device, on the time axis of the page.

/** Length of the buffer, unless it would exceed the maximum number of rows. */
export const SECONDS = 60;
const MOST_ROWS = 60000;
/** Rate at which a device's time follows its arrival times: the fastest arrivals count, clocks differ by little. */
const DRIFT = 1e-4;

/** Returns the column name as in CSV files of the command: `POSITION[0] (rad)`. */
const header = (name, { indices = [], unit = "" } = {}) =>
  `${name}${indices.map((index) => `[${index}]`).join("")}${unit && ` (${unit})`}`;

/** Rows of signals in a ring buffer. Row numbers increase without wrapping. */
export class Ring {
  /** `unsent` are the names of signals without rows; `size` is the number of complete rows that follow, if they are known. */
  constructor(layout, period_s, unsent, size = 0) {
    this.unsent = unsent;
    this.columns = layout.signals.flatMap(({ name, unit, words, places }) => Array.from({ length: words },
      (_, place) => ({ signal: name, place, unit, name: words > 1 ? `${name}[${place}]` : name, header: header(name, places?.[place]) })));
    this.numbers = new Map(this.columns.map(({ name }, number) => [name, number]));
    this.layout = layout;
    this.step = layout.every_ticks;
    this.tick_s = period_s;
    this.size = size || Math.max(2, Math.round(Math.min(SECONDS / (period_s * this.step), MOST_ROWS)));
    this.values = size ? [] : this.columns.map(() => new Float32Array(this.size));
    this.ticks = new Uint32Array(this.size);
    this.times = new Float64Array(this.size);
    this.count = 0;
    this.gaps = 0;
    // Time of the first row on the axis that all sources share, s.
    this.start_s = 0;
  }

  /** Creates a ring of complete rows: `values` has one array per column. */
  static loaded(layout, period_s, ticks, values) {
    const ring = new Ring(layout, period_s, [], ticks.length);
    const times = new Float64Array(ticks.length);
    // Of a restart, the duration is unknown: two steps represent it.
    for (let i = 1; i < times.length; i++) times[i] = times[i - 1] + (ticks[i] > ticks[i - 1] ? ticks[i] - ticks[i - 1] : 2 * ring.step);
    return Object.assign(ring, { count: ticks.length, ticks, times, values });
  }

  push(tick, view, at) {
    const place = this.count % this.size;
    if (this.count) {
      // Tick numbers wrap at 2^32.
      const ticks = (tick - this.tick(this.count - 1)) >>> 0;
      if (ticks === 0) return;
      // A large jump is a restart of the device. Its duration is unknown: two steps represent it.
      const isStart = ticks >= this.size * this.step;
      if (!isStart) this.gaps += Math.max(0, Math.round(ticks / this.step) - 1);
      this.times[place] = this.time(this.count - 1) + (isStart ? 2 * this.step : ticks);
    }
    this.ticks[place] = tick;
    for (let i = 0; i < this.values.length; i++) this.values[i][place] = view.getFloat32(at + 4 * i, true);
    this.count++;
  }

  at(column, row) { return this.values[column][row % this.size]; }

  tick(row) { return this.ticks[row % this.size]; }

  /** Returns the time of a row in ticks since the first one; increases also over a restart. */
  time(row) { return this.times[row % this.size]; }

  /** Returns whether a row directly follows the row before it. */
  follows(row) { return row > this.oldest() && this.time(row) - this.time(row - 1) === this.step; }

  oldest() { return Math.max(0, this.count - this.size); }

  /** Returns the time of a row on the common axis, s. */
  seconds(row) { return this.start_s + this.time(row) * this.tick_s; }

  /** Finds the first row at or after a time on the common axis, s. */
  findSeconds(seconds) { return this.find((seconds - this.start_s) / this.tick_s - 1e-6); }

  /** Places the last row on the common axis: by its tick if the clock is shared, otherwise not after its arrival. */
  align(now_s, sharesClock) {
    const last = this.count - 1;
    if (sharesClock) this.start_s = this.tick(last) * this.tick_s - this.time(last) * this.tick_s;
    else if (last === 0 || now_s < this.seconds(last)) this.start_s = now_s - this.time(last) * this.tick_s;
    else this.start_s += DRIFT * (now_s - this.seconds(last));
  }

  /** Finds the first row at or after a time, ticks. */
  find(time) {
    let [low, high] = [this.oldest(), this.count];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Copies the rows from `start` to before `end`. */
  copy(start, end) {
    const size = end - start, first = start % this.size;
    const part = (all) => {
      const copy = new all.constructor(size), head = all.subarray(first, Math.min(first + size, this.size));
      copy.set(head);
      copy.set(all.subarray(0, size - head.length), head.length);
      return copy;
    };
    return Object.assign(Object.create(Ring.prototype), this,
      { size, count: size, ticks: part(this.ticks), times: part(this.times), values: this.values.map(part) });
  }
}
