// Fewer points for a plot: the minimum and maximum of each of equal parts of the rows.

/** Number of rows above which a plot is decimated, per pixel of its width. */
const ROWS_PER_PX = 4;

/** Returns the length of a part; 1 if all rows are drawn. */
export const partLength = (rows, width) => Math.max(1, Math.floor(rows / (ROWS_PER_PX * Math.max(100, width))) * 2);

/** Times of the first and last row of each part. */
export function decimateTimes(times, length) {
  if (length === 1) return times;
  const out = [];
  for (let start = 0; start < times.length; start += length) out.push(times[start], times[Math.min(times.length, start + length) - 1]);
  return out;
}

/** Minimum and maximum of each part, in the order in which they occur; null for a part without finite values. */
export function decimate(values, length) {
  const out = [];
  for (let start = 0; start < values.length; start += length) {
    let [least, most, hasGap] = [-1, -1, false];
    for (let i = start; i < Math.min(values.length, start + length); i++) {
      if (!Number.isFinite(values[i])) hasGap = true;
      else {
        if (least < 0 || values[i] < values[least]) least = i;
        if (most < 0 || values[i] > values[most]) most = i;
      }
    }
    const [first, second] = least < 0 ? [null, null] : least < most ? [values[least], values[most]] : [values[most], values[least]];
    if (length === 1) out.push(first);
    else out.push(first, hasGap ? null : second);
  }
  return out;
}
