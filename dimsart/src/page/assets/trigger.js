// The trigger of the scope: finds an edge in what is new, and says when the picture around it is whole.

const by = (id) => document.getElementById(id);

export class Trigger {
  /** `change` is called when it is set otherwise. */
  constructor(change) {
    for (const what of ["mode", "source", "edge", "level", "before"]) by(`trigger-${what}`).onchange = change;
    this.arm();
  }

  /** Off, auto, normal or single. */
  get mode() { return by("trigger-mode").value; }

  /** It looks at what comes from now on. */
  arm(ring) {
    this.armed = ring?.count ?? 0;
    this.fired = null;
  }

  /** Signals that it can look at. The one that is chosen stays as long as it is there. */
  offer(names, first) {
    const source = by("trigger-source").value;
    by("trigger-source").replaceChildren(...names.map((name) => Object.assign(document.createElement("option"), { value: name, textContent: name })));
    by("trigger-source").value = names.includes(source) ? source : first;
  }

  /** What of a picture is before the edge, in ticks. */
  before(span) { return Math.round((span * Number(by("trigger-before").value)) / 100); }

  /** The tick and the time of an edge, once when all of the picture around it is there; else null. */
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

  /** The first edge in what is new. Over a gap it is not known whether there was one. */
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
