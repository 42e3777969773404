// Gains of a position loop by pole placement, and the margins that they give.
//
//   joint    J x'' + b x' = F            law    F = K e + I ∫ e dt + D e'
//   closed   J s³ + (b + D) s² + K s + I = J (s² + 2 ζ ω s + ω²) (s + ω / 5), without the last factor if I = 0

/** Distance of the real pole of the integral, as a share of ω. */
const REAL_POLE = 0.2;

/** Complex number: real and imaginary part. @typedef {number[]} Complex */

/** @type {(one: Complex, other: Complex) => Complex} */
const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
/** @type {(one: Complex, other: Complex) => Complex} */
const over = ([a, b], [c, d]) => [(a * c + b * d) / (c * c + d * d), (b * c - a * d) / (c * c + d * d)];
/** @type {(one: Complex) => number} */
const size = ([a, b]) => Math.hypot(a, b);

/** Gains for a natural frequency, rad/s. */
export function place({ inertia, viscous }, natural, damping, hasIntegral) {
  const real = hasIntegral ? REAL_POLE * natural : 0;
  return {
    K: inertia * (natural ** 2 + 2 * damping * natural * real),
    I: inertia * natural ** 2 * real,
    D: Math.max(0, inertia * (2 * damping * natural + real) - viscous),
  };
}

/** Response from reference to position at a frequency, rad/s. */
export function closedLoop({ inertia, viscous }, { K, I, D }, w) {
  const top = [I - D * w ** 2, K * w], bottom = [I - (viscous + D) * w ** 2, K * w - inertia * w ** 3];
  return over(top, bottom);
}

/** Returns gains for a bandwidth (-3 dB from reference to position), Hz, and a damping ratio. */
export function gainsFor(joint, { bandwidth_hz, damping, hasIntegral }) {
  const w = 2 * Math.PI * bandwidth_hz;
  let [low, high] = [w / 100, 10 * w];
  for (let round = 0; round < 100; round++) {
    const middle = Math.sqrt(low * high);
    if (size(closedLoop(joint, place(joint, middle, damping, hasIntegral), w)) < Math.SQRT1_2) low = middle;
    else high = middle;
  }
  return place(joint, high, damping, hasIntegral);
}

/** Returns crossover, phase margin and gain margin with a dead time and a filter of the derivative; null where not crossed. */
export function marginsOf({ inertia, viscous }, { K, I, D }, { delay_s, filter_s = 0 }) {
  const loop = (w) => {
    const derivative = over([0, D * w], [1, filter_s * w]);
    const law = [K + derivative[0], derivative[1] - I / w];
    const gain = over(law, [-inertia * w ** 2, viscous * w]);
    return times(gain, [Math.cos(w * delay_s), -Math.sin(w * delay_s)]);
  };
  const found = { crossover_hz: null, phase_margin_deg: null, gain_margin: null };
  // Of a double integrator with an integral, the phase starts at -270 degrees.
  let [last, phase] = [null, -Math.PI * (I > 0 ? 1.5 : 1)];
  for (let i = 0; i <= 4000; i++) {
    const w = 10 ** (-2 + (7 * i) / 4000), now = loop(w), angle = Math.atan2(now[1], now[0]);
    const next = phase + Math.atan2(Math.sin(angle - phase), Math.cos(angle - phase));
    if (last && size(last) > 1 && size(now) <= 1) {
      found.crossover_hz = w / (2 * Math.PI);
      found.phase_margin_deg = 180 + (next * 180) / Math.PI;
    }
    if (last && phase > -Math.PI && next <= -Math.PI && size(now) < 1 && found.gain_margin === null) found.gain_margin = 1 / size(now);
    [last, phase] = [now, next];
  }
  return found;
}
