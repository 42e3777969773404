// The ticks of a controller as they came: where some are missing, and where the device was started anew, is kept.

/** So long is what is kept, unless its rows are too many. */
export const SECONDS = 60;
const MOST_ROWS = 60000;

/** The name of a column in a table, as the command has it: `POSITION[0] (rad)`. */
const header = (name, { indices = [], unit = "" } = {}) =>
  `${name}${indices.map((index) => `[${index}]`).join("")}${unit && ` (${unit})`}`;

/** Rows of signals in a ring. A row has a number, from the oldest one that is there to the newest; it goes on rising. */
export class Ring {
  /** `unsent` are names of signals that are not in its rows. */
  constructor(layout, period_s, unsent) {
    this.unsent = unsent;
    this.columns = layout.signals.flatMap(({ name, unit, words, places }) => Array.from({ length: words },
      (_, place) => ({ signal: name, place, unit, name: words > 1 ? `${name}[${place}]` : name, header: header(name, places?.[place]) })));
    this.numbers = new Map(this.columns.map(({ name }, number) => [name, number]));
    this.layout = layout;
    this.step = layout.every_ticks;
    this.tick_s = period_s;
    this.size = Math.max(2, Math.round(Math.min(SECONDS / (period_s * this.step), MOST_ROWS)));
    this.values = this.columns.map(() => new Float32Array(this.size));
    this.ticks = new Uint32Array(this.size);
    this.times = new Float64Array(this.size);
    this.count = 0;
    this.gaps = 0;
  }

  push(tick, view, at) {
    const place = this.count % this.size;
    if (this.count) {
      // The number of a tick wraps after 2^32.
      const ticks = (tick - this.tick(this.count - 1)) >>> 0;
      if (ticks === 0) return;
      // From so far away it is another start of the device. How long that took is not known: two steps stand for it.
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

  /** When a row was, in ticks since the first one. It always rises, also where the number of the tick does not. */
  time(row) { return this.times[row % this.size]; }

  /** Whether nothing is missing between a row and the one before it. */
  follows(row) { return row > this.oldest() && this.time(row) - this.time(row - 1) === this.step; }

  oldest() { return Math.max(0, this.count - this.size); }

  /** The first row at a time or after it. */
  find(time) {
    let [low, high] = [this.oldest(), this.count];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Rows of it, from one to before another one, that stay as they are. */
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
