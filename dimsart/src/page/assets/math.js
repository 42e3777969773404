// Math channels: expressions of the signals of a source, such as `POSITION[0] - DES_POSITION[0]` or `rate(POSITION)`.
//
//   expression = term { (+|-) term }      term = factor { (*|/) factor }
//   factor = number | signal | name(expression, …) | (expression) | -factor

const PI2 = 2 * Math.PI;
const each = (f) => (period_s, ...all) => all[0].map((_, i) => f(...all.map((values) => values[i])));

/** Functions by name; arguments and result have one value per row. */
const FUNCTIONS = {
  abs: each(Math.abs), sqrt: each(Math.sqrt), sin: each(Math.sin), cos: each(Math.cos), min: each(Math.min), max: each(Math.max),
  /** Derivative, per s. */
  rate: (period_s, x) => x.map((value, i) => (i ? (value - x[i - 1]) / period_s : NaN)),
  /** Integral since the start of the window. */
  integral: (period_s, x) => {
    let sum = 0;
    return x.map((value) => (sum += Number.isFinite(value) ? value * period_s : 0));
  },
  /** First-order low-pass with its corner frequency, Hz. */
  lowpass: (period_s, x, corner) => {
    let last = NaN;
    return x.map((value, i) => {
      const share = 1 - Math.exp(-PI2 * corner[i] * period_s);
      last = Number.isFinite(last) ? last + share * (value - last) : value;
      return last;
    });
  },
};
const ARGUMENTS = { min: 2, max: 2, lowpass: 2 };

/**
 * Parses an expression; returns the names of its signals, and `evaluate(values, count, period_s)`, where `values(name)` gives the
 * rows of a signal. Throws an error that names the position.
 */
export function parse(text) {
  const tokens = [...text.matchAll(/\s*(?:(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+)|([A-Za-z_]\w*(?:\[\d+\])*)|(\S))/gy)];
  const names = new Set();
  let at = 0;
  const peek = () => tokens[at]?.[3];
  const fail = (what, token = tokens[at]) => {
    const place = token ? token.index + token[0].length - token[0].trimStart().length : text.length;
    throw new Error(`${what} at character ${place + 1}`);
  };
  const expect = (sign) => (peek() === sign ? at++ : fail(`expected ${sign}`));
  const binary = (next, operations) => {
    let left = next();
    while (operations[peek()]) {
      const operation = operations[tokens[at++][3]], [one, other] = [left, next()];
      left = (...all) => each(operation)(0, one(...all), other(...all));
    }
    return left;
  };
  const sum = () => binary(product, { "+": (a, b) => a + b, "-": (a, b) => a - b });
  const product = () => binary(factor, { "*": (a, b) => a * b, "/": (a, b) => a / b });
  const factor = () => {
    const token = tokens[at];
    if (!token) fail("expected a number, a signal or (");
    const [, number, name, sign] = token;
    if (sign === "-") {
      at++;
      const inner = factor();
      return (...all) => inner(...all).map((value) => -value);
    }
    if (sign === "(") {
      at++;
      const inner = sum();
      expect(")");
      return inner;
    }
    if (sign) fail(`unexpected ${sign}`);
    at++;
    if (number) return (_, count) => new Array(count).fill(Number(number));
    if (peek() !== "(") {
      names.add(name);
      return (values) => values(name);
    }
    const call = FUNCTIONS[name];
    if (!call) fail(`unknown function ${name} (known: ${Object.keys(FUNCTIONS).join(", ")})`, token);
    at++;
    const inner = [sum()];
    while (peek() === ",") { at++; inner.push(sum()); }
    if (inner.length !== (ARGUMENTS[name] ?? 1)) fail(`${name} has ${ARGUMENTS[name] ?? 1} argument(s)`, token);
    expect(")");
    return (values, count, period_s) => call(period_s, ...inner.map((one) => one(values, count, period_s)));
  };
  const evaluate = sum();
  if (at < tokens.length) fail(`unexpected ${tokens[at][0].trim()}`);
  return { names: [...names], evaluate };
}
