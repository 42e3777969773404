// The list of signals of the scope: each can be shown, or dragged to a plot. Other sources are folded.

import { digits } from "./device.js";
import { by, node } from "./dom.js";
import { DRAGGED } from "./plots.js";
import { offerSending } from "./sending.js";
import { keyOf } from "./sources.js";

export class SignalList {
  /** `toggle(key, isOn)` shows or hides a signal; `choose(names)` selects the signals that the device sends. */
  constructor(toggle, choose) {
    this.toggle = toggle;
    this.choose = choose;
    this.rows = [];
    by("signal-filter").oninput = () => this.filter();
  }

  /** Lists the signals of the shown source, then those of the other sources. `channels` are math channels: name, unit. */
  show(shown, rings, channels, isLive) {
    this.rows = [];
    const list = by("signals"), own = rings.get(shown);
    list.replaceChildren(...this.signals(shown, own, channels));
    if (own && isLive) offerSending(list, own, this.choose);
    for (const [name, ring] of rings) {
      if (name === shown) continue;
      list.append(node("details", { className: "other" }, node("summary", { textContent: name }), node("div", {}, ...this.signals(name, ring, channels))));
    }
    this.filter();
  }

  signals(source, ring, channels) {
    const all = [...(ring?.columns ?? []).map(({ name, unit, signal, place }) => ({ name, unit, sent: place === 0 ? signal : undefined })), ...channels];
    return all.map(({ name, unit, sent }) => {
      const key = keyOf(name, source);
      const box = node("input", { type: "checkbox", onchange: () => this.toggle(key, box.checked) });
      const value = node("span", { className: "value" }), color = node("span", { className: "key" });
      const label = node("label", { draggable: true }, box, color, node("span", { className: "name", textContent: name, title: `${name}: drag it to a plot` }), value);
      label.dataset.name = name.toLowerCase();
      if (sent) label.dataset.signal = sent;
      label.addEventListener("dragstart", (event) => {
        event.dataTransfer.setData(DRAGGED, key);
        event.dataTransfer.effectAllowed = "copy";
      });
      this.rows.push({ key, box, color, value, unit });
      return label;
    });
  }

  /** Shows the colors of the plotted signals, by key, and the last values. */
  mark(colors, last) {
    for (const { key, box, color, value, unit } of this.rows) {
      box.checked = colors.has(key);
      color.style.background = colors.get(key) ?? "transparent";
      const now = last(key);
      value.textContent = now === undefined ? "" : `${digits(now)} ${unit}`;
    }
  }

  filter() {
    const wanted = by("signal-filter").value.trim().toLowerCase();
    for (const row of by("signals").querySelectorAll("[data-name]")) row.hidden = !row.dataset.name.includes(wanted);
    if (wanted) for (const other of by("signals").querySelectorAll("details")) other.open = true;
  }
}
