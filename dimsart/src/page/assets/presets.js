// Presets: stored positions of a simulated device, approached at limited speed.

import { askName, by, node } from "./dom.js";
import { stored } from "./stored.js";

const STORED = "dimsart presets";

export class Presets {
  /** `ask(what)` sends an action for the shown station; `position()` returns its measured positions. */
  constructor(ask, position, say) {
    this.ask = ask;
    this.position = position;
    this.say = say;
    this.device = "";
    by("preset-save").onclick = async () => {
      const positions = position();
      if (!positions?.every(Number.isFinite)) return say("the positions are unknown", true);
      const name = await askName("Name of this position");
      if (name) this.store({ ...this.own(), [name]: positions });
    };
    by("preset-delete").onclick = () => {
      const { [by("preset").value]: _, ...others } = this.own();
      this.store(others);
    };
    by("preset-go").onclick = () => this.hold(this.own()[by("preset").value]);
    by("preset-release").onclick = () => this.hold(position()?.map(() => null));
    by("preset").onchange = () => this.allow(this.why);
  }

  own() { return stored(STORED)[this.device] ?? {}; }

  store(own) {
    localStorage.setItem(STORED, JSON.stringify({ ...stored(STORED), [this.device]: own }));
    this.offer();
  }

  offer() {
    by("preset").replaceChildren(...Object.keys(this.own()).map((name) => node("option", { value: name, textContent: name })));
    this.allow(this.why);
  }

  /** Shows the presets of a station's device; only a simulated device can be moved from the page. */
  show(here) {
    by("presets").hidden = !here?.geometry;
    const identity = here?.overview?.identity;
    const device = identity ? `${identity.device} (${identity.axes.join(", ")})` : "";
    if (device === this.device) return;
    this.device = device;
    this.offer();
  }

  allow(why) {
    this.why = why;
    const isEmpty = by("preset").value === "";
    by("preset-go").disabled = Boolean(why) || isEmpty;
    by("preset-release").disabled = Boolean(why);
    by("preset-delete").disabled = isEmpty;
  }

  /** Moves the references to positions at limited speed, or returns them to the experiment. */
  hold(positions) {
    const all = (positions ?? []).map((value, axis) => this.ask({ do: "hold", signal: "DES_POSITION", axis, ramp: true, value: value === null ? null : String(value) }));
    Promise.all(all).catch((error) => this.say(error.message, true));
  }
}
