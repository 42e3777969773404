// Animation of the device: a dial for each rotary axis, a slide for each linear axis, with reference and force.

import { svgNode } from "./dom.js";

/** Formats a number with four digits. */
export function digits(value) {
  if (value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(2) : String(Number(value.toPrecision(4)));
}

const SIZE = 120, TEXTS = 46;
const HINT = "drag to hold the reference of this axis until you release it; arrow keys jog it until the focus leaves";
// Step of a jog key, rad or m; Shift makes it ten times as large.
const JOG = { rotary: 0.02, linear: 0.002 };

export class DevicePicture {
  /** `hold(station, axis, value)` is called while the user drags an axis, with null on release. */
  constructor(place, hold) {
    this.place = place;
    this.hold = hold;
    this.axes = [];
    this.largest = [];
    this.references = [];
    this.why = "";
  }

  /** Enables dragging, or shows why it is disabled. */
  allow(why) {
    if (this.why === why) return;
    this.why = why;
    this.place.classList.toggle("still", Boolean(why));
    for (const { hint } of this.axes) hint.textContent = why || HINT;
  }

  /** Handles dragging of an axis reference, around a dial or along a slide, and jogging by keys. */
  drag(group, axis, isTurning) {
    // The station at the start of the drag.
    let last = null, station = null, isDragged = false, scale = 1;
    const at = (event) => {
      const box = group.firstChild.getBoundingClientRect();
      const [x, y] = [event.clientX - (box.left + box.right) / 2, (box.top + box.bottom) / 2 - event.clientY];
      // The drawn scale at the start of the drag: the reference itself changes the scale.
      if (!isTurning) return Math.max(-1, Math.min(1, x / (0.45 * box.width))) * scale;
      const angle = Math.atan2(y, x);
      // Continuous angle, for more than one turn.
      return last === null ? angle : last + Math.atan2(Math.sin(angle - last), Math.cos(angle - last));
    };
    const go = (event) => { last = at(event); this.hold(station, axis, last); };
    const end = () => {
      isDragged = false;
      if (last === null) return;
      last = null;
      this.hold(station, axis, null);
    };
    group.addEventListener("pointerdown", (event) => {
      if (this.why || event.button || !event.isPrimary) return;
      group.setPointerCapture(event.pointerId);
      [last, station, isDragged, scale] = [null, this.station, true, this.largest[axis].position];
      go(event);
    });
    group.addEventListener("pointermove", (event) => {
      if (!isDragged) return;
      if (this.why || !event.buttons) end();
      else go(event);
    });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) group.addEventListener(kind, end);
    group.addEventListener("keydown", (event) => {
      const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (this.why || !sign) return;
      event.preventDefault();
      if (last === null) [last, station] = [this.references[axis], this.station];
      if (!Number.isFinite(last)) return;
      last += sign * JOG[isTurning ? "rotary" : "linear"] * (event.shiftKey ? 10 : 1);
      this.hold(station, axis, last);
    });
    return end;
  }

  /** Draws the axes of a station's device, if they have changed. */
  show(station, identity) {
    const key = identity && `${station} ${identity.device} ${identity.axes.join()}`;
    if (this.key === key) return;
    // Release the axes before the picture is replaced.
    for (const { end } of this.axes) end();
    this.key = key;
    this.station = station;
    this.axes = [];
    if (!identity) return this.place.replaceChildren();
    this.largest = identity.axes.map(() => ({ position: 1e-3, force: 1e-6 }));
    const columns = Math.min(3, identity.axes.length);
    const rows = Math.ceil(identity.axes.length / columns);
    const svg = svgNode("svg", { viewBox: `0 0 ${SIZE * columns} ${(SIZE + TEXTS) * rows}`, role: "group", "aria-label": "axes of the device" });
    this.axes = identity.axes.map((kind, axis) => {
      const group = svgNode("g", {
        transform: `translate(${SIZE * (axis % columns)} ${(SIZE + TEXTS) * Math.floor(axis / columns)})`,
      });
      const isTurning = kind === "rotary";
      group.append(isTurning
        ? svgNode("circle", { cx: 60, cy: 60, r: 50, fill: "transparent", stroke: "var(--rule)", "stroke-width": 2 })
        : svgNode("line", { x1: 10, x2: 110, y1: 60, y2: 60, stroke: "var(--rule)", "stroke-width": 4, "pointer-events": "all" }));
      const hand = (color, width) => (isTurning
        ? svgNode("line", { x1: 60, y1: 60, x2: 108, y2: 60, stroke: color, "stroke-width": width, "stroke-linecap": "round" })
        : svgNode("rect", { x: 55, y: 42, width: 10, height: 36, rx: 3, fill: color }));
      const wanted = hand("var(--warn)", 3), is = hand("var(--link)", 6);
      const force = svgNode("path", { class: "force", fill: "none", stroke: "var(--good)", "stroke-width": 4 });
      const text = svgNode("text", { x: 60, y: SIZE + 8, "text-anchor": "middle", "font-size": 11, fill: "var(--text)" });
      const strength = svgNode("text", { x: 60, y: SIZE + 22, "text-anchor": "middle", "font-size": 11, fill: "var(--good)", class: "force" });
      const note = svgNode("text", { x: 60, y: SIZE + 36, "text-anchor": "middle", "font-size": 11, fill: "var(--quiet)" });
      group.append(wanted, is, force, text, strength, note);
      const attributes = { tabindex: 0, role: "slider", "aria-label": `reference of axis ${axis}`, "aria-valuenow": 0 };
      for (const [name, value] of Object.entries(attributes)) group.setAttribute(name, value);
      const hint = svgNode("title", {}, this.why || HINT);
      group.append(hint);
      svg.append(group);
      return { end: this.drag(group, axis, isTurning), group, hint, isTurning, wanted, is, force, text, strength, note };
    });
    this.place.replaceChildren(svg);
  }

  /** Shows the last tick: values and units by signal name. A force that the device does not receive is drawn faintly. */
  move(signals, isCommanded) {
    if (!signals) return;
    this.place.classList.toggle("idle", !isCommanded);
    const is = signals.get("POSITION"), wanted = signals.get("DES_POSITION"), force = signals.get("DES_FORCE");
    this.axes.forEach((drawn, axis) => {
      const position = is?.values[axis], goal = wanted?.values[axis], strength = force?.values[axis];
      this.references[axis] = goal ?? position;
      drawn.group.setAttribute("aria-valuenow", digits(goal ?? position));
      const largest = this.largest[axis];
      largest.position = Math.max(largest.position, Math.abs(position ?? 0), Math.abs(goal ?? 0));
      largest.force = Math.max(largest.force, Math.abs(strength ?? 0));
      const turn = (hand, value) => {
        hand.setAttribute("visibility", Number.isFinite(value) ? "visible" : "hidden");
        if (!Number.isFinite(value)) return;
        hand.setAttribute("transform", drawn.isTurning
          ? `rotate(${(-value * 180) / Math.PI} 60 60)` : `translate(${(45 * value) / largest.position} 0)`);
      };
      turn(drawn.is, position);
      turn(drawn.wanted, goal);
      const share = (strength ?? 0) / largest.force;
      const start = Number.isFinite(position) ? position : 0;
      drawn.force.setAttribute("d", drawn.isTurning ? arc(start, start + 1.6 * share)
        : `M ${60 + (45 * start) / largest.position} 34 h ${40 * share}`);
      drawn.text.textContent = `${digits(position)} ${is?.unit ?? ""}`;
      drawn.strength.textContent = force ? `${digits(strength)} ${force.unit}` : "";
      drawn.note.textContent = force && !isCommanded ? "not applied" : "";
    });
  }
}

/** Returns the path of an arc around a dial between two angles, rad. */
function arc(from, to) {
  const at = (angle) => `${60 + 36 * Math.cos(angle)} ${60 - 36 * Math.sin(angle)}`;
  return `M ${at(from)} A 36 36 0 ${Math.abs(to - from) > Math.PI ? 1 : 0} ${to > from ? 0 : 1} ${at(to)}`;
}
