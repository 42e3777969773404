// Figures of the last step of a reference: rise time, overshoot, settling time, error.

import { digits } from "./device.js";

/** A step is a change within one row of at least this share of the range of the reference. */
const MIN_SHARE = 0.2;
/** Settling band, as a share of the step. */
const BAND = 0.02;

/**
 * Returns the figures of the last step in `reference`; `times` in s. Null without a step, or with less than three rows after the
 * step. Times that are not reached within the window are null.
 */
export function stepFigures(times, reference, values) {
  const [least, most] = limits(reference);
  const range = most - least;
  if (!(range > 0)) return null;
  const at = reference.findLastIndex((value, i) => i > 0 && Math.abs(value - reference[i - 1]) >= MIN_SHARE * range);
  if (at < 1 || reference.length - at < 3) return null;
  const [from, to] = [values[at - 1], reference[at]], size = to - from;
  if (!(Math.abs(size) > 0)) return null;
  // 0 before the step, 1 at the reference.
  const shares = values.slice(at).map((value) => (value - from) / size), start_s = times[at];
  const crossing = (level) => {
    const i = shares.findIndex((share) => share >= level);
    if (i < 0) return null;
    if (i === 0) return start_s;
    const part = (level - shares[i - 1]) / (shares[i] - shares[i - 1]);
    return times[at + i - 1] + part * (times[at + i] - times[at + i - 1]);
  };
  const [ten, ninety] = [crossing(0.1), crossing(0.9)];
  const outside = shares.findLastIndex((share) => Math.abs(share - 1) > BAND);
  return {
    start_s,
    size,
    rise_s: ten === null || ninety === null ? null : ninety - ten,
    overshoot: Math.max(0, limits(shares)[1] - 1),
    settling_s: outside === shares.length - 1 ? null : times[at + outside + 1] - start_s,
    error: values.at(-1) - to,
  };
}

/** Returns the figures of a signal as text; empty without a step. */
export function stepText(name, unit, found) {
  if (!found) return "";
  const ms = (value) => (value === null ? "not reached in this window" : `${digits(1000 * value)} ms`);
  return `${name}: step of ${digits(found.size)} ${unit} at ${digits(found.start_s)} s: rise time (10 to 90 %) ${ms(found.rise_s)}, overshoot ${digits(100 * found.overshoot)} %, settling time (2 %) ${ms(found.settling_s)}, error at the end ${digits(found.error)} ${unit}`;
}

/** Minimum and maximum of the finite values; without any, the range is negative. */
function limits(values) {
  let [least, most] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  return [least, most];
}
