// XY plot of two signals.

import { digits } from "./device.js";

/** Draws `y` over `x`; a null value interrupts the line. */
export function drawXy(canvas, columns, x, y) {
  const context = canvas.getContext("2d");
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = getComputedStyle(document.body).getPropertyValue("--quiet");
  context.font = "13px system-ui";
  if (columns.length < 2) return context.fillText("select two signals: the second is plotted over the first", 20, 30);
  const [left, right] = range(x), [low, high] = range(y), [w, h] = [canvas.width - 90, canvas.height - 60];
  context.strokeStyle = columns[1].color;
  context.beginPath();
  let isDown = false;
  x.forEach((value, i) => {
    const isThere = value !== null && y[i] !== null;
    if (isThere) {
      const at = [70 + (w * (value - left)) / (right - left), 20 + h - (h * (y[i] - low)) / (high - low)];
      if (isDown) context.lineTo(...at);
      else context.moveTo(...at);
    }
    isDown = isThere;
  });
  context.stroke();
  context.fillText(`${columns[0].name} (${columns[0].unit}): ${digits(left)} to ${digits(right)}`, 70, canvas.height - 12);
  context.fillText(`${columns[1].name} (${columns[1].unit}): ${digits(low)} to ${digits(high)}`, 10, 14);
}

function range(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value === null) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low < high) return [low, high];
  return low === high ? [low - 1, high + 1] : [-1, 1];
}
