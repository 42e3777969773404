// The trigger of the scope: finds an edge in new rows, and fires when the window around it is complete.

import { by, node } from "./dom.js";

export class Trigger {
  /** `change` is called after a change of the settings. */
  constructor(change) {
    for (const what of ["mode", "source", "edge", "level", "before"]) by(`trigger-${what}`).onchange = change;
    this.arm();
  }

  /** Off, auto, normal or single. */
  get mode() { return by("trigger-mode").value; }

  /** Arms the trigger for new rows. */
  arm(ring) {
    this.armed = ring?.count ?? 0;
    this.fired = null;
  }

  /** Offers signals as source; the selected one stays while it exists. */
  offer(names, first) {
    const source = by("trigger-source").value;
    by("trigger-source").replaceChildren(...names.map((name) => node("option", { value: name, textContent: name })));
    by("trigger-source").value = names.includes(source) ? source : first;
  }

  /** Returns the part of the window before the edge, in ticks. */
  before(span) { return Math.round((span * Number(by("trigger-before").value)) / 100); }

  /** Returns tick and time of an edge, once, when the window around it is complete; otherwise null. */
  watch(ring, span) {
    const source = ring.numbers.get(by("trigger-source").value);
    if (source === undefined) return null;
    by("trigger-unit").textContent = ring.columns[source].unit;
    this.fired ??= this.edge(ring, source);
    const { fired } = this;
    if (!fired || ring.time(ring.count - 1) + ring.step < fired.time - this.before(span) + span) return null;
    this.fired = null;
    return fired;
  }

  /** Finds the first edge in new rows, ignoring gaps. */
  edge(ring, source) {
    const level = Number(by("trigger-level").value), edge = by("trigger-edge").value;
    const first = Math.max(this.armed, ring.oldest() + 1);
    this.armed = ring.count;
    for (let i = first; i < ring.count; i++) {
      const [past, now] = [ring.at(source, i - 1), ring.at(source, i)];
      const rises = past < level && now >= level, falls = past > level && now <= level;
      const isWanted = (rises && edge !== "fall") || (falls && edge !== "rise");
      if (isWanted && ring.follows(i)) return { time: ring.time(i), tick: ring.tick(i) };
    }
    return null;
  }

  say(text) { by("trigger-state").textContent = text; }
}
