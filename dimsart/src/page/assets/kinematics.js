// Kinematics of a device, for its picture: an arm, a PHANToM, or independent joints.
//
// A pose is a 4x4 matrix, column by column, in the base frame: x forward, y left, z up, m. `positions` are the values of
// POSITION, one per axis of the device.

const shift = (x, y, z) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1];
const turnX = (a, c = Math.cos(a), s = Math.sin(a)) => [1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 0, 0, 0, 1];
const turnY = (a, c = Math.cos(a), s = Math.sin(a)) => [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, 0, 0, 0, 1];
const turnZ = (a, c = Math.cos(a), s = Math.sin(a)) => [c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const times = (...all) => all.reduce((a, b) => b.map((_, i) =>
  [0, 1, 2, 3].reduce((sum, k) => sum + a[(i & 3) + 4 * k] * b[(i & ~3) + k], 0)));

/**
 * Converts a point of a body to the base frame.
 * @type {(pose: number[], point: number[]) => number[]}
 */
export const point = (pose, [x, y, z]) => [0, 1, 2].map((i) => pose[i] * x + pose[i + 4] * y + pose[i + 8] * z + pose[i + 12]);

/**
 * @typedef {object} Mechanism
 * @property {(positions: number[]) => number[][]} poses  pose of each body
 * @property {{ body: number, from: number[], to: number[] }[]} rods  straight parts
 * @property {{ body: number, direction: number[], isRotary: boolean }[]} axes  per axis: body that it moves, direction in this body
 * @property {{ body: number, point: number[], axes: number[] }[]} tips  points that can be dragged, and the axes that move them
 * @property {number} reach  size, m
 * @property {boolean} [isCartesian]  whether positions and forces are those of the tip
 * @property {number[]} [origin]  tip at position 0, if the hand and walls act at the tip
 */

/**
 * Returns the mechanism of a geometry.
 * @returns {Mechanism}
 */
export function mechanism(geometry) {
  if (geometry.arm) return chain(geometry.arm);
  if (geometry.phantom) return phantom(geometry.phantom);
  const isGantry = geometry.axis.length > 1 && geometry.axis.length <= 3 && geometry.axis.every(({ unit }) => unit === "m");
  return isGantry ? gantry(geometry.axis.length) : joints(geometry.axis);
}

/** Modified Denavit-Hartenberg parameters, as in rig files. Body 0 is the base. */
function chain({ link, tip_m }) {
  const rods = [], slide = 0.3;
  const isRotary = (one) => one.kind === "revolute";
  link.forEach((one, axis) => {
    const bend = [one.a_m, 0, 0], offset = isRotary(one) ? one.d_m : 0;
    const next = [one.a_m, -offset * Math.sin(one.alpha_rad), offset * Math.cos(one.alpha_rad)];
    rods.push({ body: axis, from: [0, 0, 0], to: bend }, { body: axis, from: bend, to: next });
    if (!isRotary(one)) rods.push({ body: axis + 1, from: [0, 0, -slide], to: [0, 0, 0] });
  });
  rods.push({ body: link.length, from: [0, 0, 0], to: tip_m });
  const length = ({ from, to }) => Math.hypot(...to.map((value, i) => value - from[i]));
  return {
    poses: (positions) => link.reduce((poses, one, axis) => {
      const [turn, move] = isRotary(one) ? [positions[axis], 0] : [0, positions[axis]];
      poses.push(times(poses.at(-1), turnX(one.alpha_rad), shift(one.a_m, 0, 0), turnZ(one.theta_rad + turn), shift(0, 0, one.d_m + move)));
      return poses;
    }, [shift(0, 0, 0)]),
    rods: rods.filter((rod) => length(rod) > 1e-6),
    axes: link.map((one, axis) => ({ body: axis + 1, direction: [0, 0, 1], isRotary: isRotary(one) })),
    tips: [{ body: link.length, point: tip_m, axes: link.map((_, axis) => axis) }],
    reach: rods.reduce((sum, rod) => sum + length(rod), 0),
  };
}

/** Bodies: base (rotates about the vertical), inner link, outer link. Positions: angles, or the tip relative to its start. */
function phantom({ port, linkage: { inner_m, outer_m }, start_position_rad }) {
  const bodies = ([base, inner, outer]) => {
    const turned = turnZ(base);
    const elbow = shift(inner_m * Math.cos(inner), 0, inner_m * Math.sin(inner));
    return [turned, times(turned, turnY(-inner)), times(turned, elbow, turnY(-outer))];
  };
  const tip = { body: 2, point: [0, 0, -outer_m], axes: [0, 1, 2] };
  const origin = point(bodies(start_position_rad)[2], tip.point);
  const isCartesian = port === "cartesian";
  /** @param {number[]} tip */
  const angles = ([x, y, z]) => {
    const reach = Math.hypot(x, y);
    const cosine = (reach ** 2 + z ** 2 - inner_m ** 2 - outer_m ** 2) / (2 * inner_m * outer_m);
    const bend = -Math.acos(Math.max(-1, Math.min(1, cosine)));
    const inner = Math.atan2(z, reach) - Math.atan2(outer_m * Math.sin(bend), inner_m + outer_m * Math.cos(bend));
    return [Math.atan2(y, x), inner, inner + bend + Math.PI / 2];
  };
  return {
    poses: (positions) => bodies(isCartesian ? angles(positions.map((value, i) => value + origin[i])) : positions),
    rods: [{ body: 0, from: [0, 0, -0.15], to: [0, 0, 0] }, { body: 1, from: [0, 0, 0], to: [inner_m, 0, 0] },
      { body: 2, from: [0, 0, 0], to: tip.point }],
    axes: [[0, 0, 1], [0, -1, 0], [0, -1, 0]].map((direction, body) => ({ body, direction, isRotary: true })),
    tips: [tip],
    reach: inner_m + outer_m,
    isCartesian,
    origin: port === "joint" ? undefined : origin,
  };
}

/** Two or three linear axes: x, y and z of one tip. Body n + 1 moves with axis n. */
function gantry(count) {
  const half = 0.12;
  const directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].slice(0, count);
  return {
    poses: (positions) => directions.reduce((poses, direction, axis) => {
      poses.push(times(poses.at(-1), shift(...direction.map((value) => value * positions[axis]))));
      return poses;
    }, [shift(0, 0, 0)]),
    rods: [{ body: 0, from: [-half, 0, 0], to: [half, 0, 0] },
      ...directions.slice(1).map((direction, n) => ({ body: n + 1, from: direction.map((value) => -half * value), to: direction.map((value) => half * value) }))],
    axes: directions.map((direction, axis) => ({ body: axis + 1, direction, isRotary: false })),
    tips: [{ body: count, point: [0, 0, 0], axes: directions.map((_, axis) => axis) }],
    reach: 1.5 * half,
    isCartesian: true,
    origin: [0, 0, 0],
  };
}

const SPACING_M = 0.3, BAR_M = 0.12;

/** Independent joints next to each other: body 2n is the base of axis n, body 2n + 1 moves. */
function joints(axis) {
  const isRotary = ({ unit }) => unit === "rad";
  return {
    poses: (positions) => axis.flatMap((one, n) => {
      const base = shift(0, -SPACING_M * n, 0), value = positions[n];
      return [base, times(base, isRotary(one) ? turnY(-value) : shift(value, 0, 0))];
    }),
    rods: axis.flatMap((one, n) => (isRotary(one)
      ? [{ body: 2 * n + 1, from: [0, 0, 0], to: [BAR_M, 0, 0] }]
      : [{ body: 2 * n, from: [-BAR_M, 0, 0], to: [BAR_M, 0, 0] }, { body: 2 * n + 1, from: [0, 0, 0], to: [0, 0, BAR_M / 3] }])),
    axes: axis.map((one, n) => ({ body: 2 * n + 1, direction: isRotary(one) ? [0, -1, 0] : [1, 0, 0], isRotary: isRotary(one) })),
    tips: axis.map((one, n) => ({ body: 2 * n + 1, point: isRotary(one) ? [BAR_M, 0, 0] : [0, 0, BAR_M / 3], axes: [n] })),
    reach: BAR_M,
  };
}

const STEP = 1e-5, DAMPING = 1e-3, MAX_STEP = 0.2;

/** Moves `axes` until a point of a body is as close as possible to a target; returns the positions (damped least squares). */
export function follow(mechanism, positions, axes, { body, point: own }, target) {
  const place = (all) => point(mechanism.poses(all)[body], own);
  const all = [...positions];
  for (let round = 0; round < 12; round++) {
    const now = place(all), error = target.map((value, i) => value - now[i]);
    const columns = axes.map((axis) => {
      const moved = [...all];
      moved[axis] += STEP;
      return place(moved).map((value, i) => (value - now[i]) / STEP);
    });
    const matrix = [0, 1, 2].map((i) => [0, 1, 2].map((j) =>
      columns.reduce((sum, column) => sum + column[i] * column[j], i === j ? DAMPING ** 2 : 0)));
    const pull = solve(matrix, error);
    axes.forEach((axis, n) => {
      const step = columns[n].reduce((sum, value, i) => sum + value * pull[i], 0);
      all[axis] += Math.max(-MAX_STEP, Math.min(MAX_STEP, step));
    });
  }
  return all;
}

/**
 * Solves a symmetric positive definite 3x3 system by Cramer's rule.
 * @param {number[][]} rows
 * @param {number[]} right
 */
function solve([a, b, c], right) {
  /** @type {(one: number[], other: number[]) => number[]} */
  const cross = ([x, y, z], [u, v, w]) => [y * w - z * v, z * u - x * w, x * v - y * u];
  const dot = (one, other) => one.reduce((sum, value, i) => sum + value * other[i], 0);
  const determinant = dot(a, cross(b, c));
  return [dot(right, cross(b, c)), dot(a, cross(right, c)), dot(a, cross(b, right))].map((value) => value / determinant);
}
