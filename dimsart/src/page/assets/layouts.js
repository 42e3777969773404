// Layout of the scope: in the address, so that a reload or a link shows the same, and by name in this browser.

import { askName, by, node } from "./dom.js";
import { stored } from "./stored.js";

const STORED = "dimsart layouts";
/** Fields that a layout consists of. */
const FIELDS = ["window", "view", "columns", "trigger-mode", "trigger-source", "trigger-edge", "trigger-level", "trigger-before"];

export class Layouts {
  /** `get` returns panels and math channels; `set` shows them. */
  constructor(get, set) {
    this.get = get;
    this.set = set;
    by("layout-save").onclick = async () => {
      const name = await askName("Name of the layout");
      if (!name) return;
      localStorage.setItem(STORED, JSON.stringify({ ...stored(STORED), [name]: this.now() }));
      this.offer(name);
    };
    by("layout-delete").onclick = () => {
      const { [by("layout").value]: _, ...others } = stored(STORED);
      localStorage.setItem(STORED, JSON.stringify(others));
      this.offer("");
    };
    by("layout").onchange = () => {
      const layout = stored(STORED)[by("layout").value];
      by("layout-delete").disabled = !layout;
      if (layout) this.show(layout);
    };
    this.offer("");
  }

  offer(name) {
    by("layout").replaceChildren(node("option", { value: "", textContent: "–" }),
      ...Object.keys(stored(STORED)).map((known) => node("option", { value: known, textContent: known })));
    by("layout").value = name;
    by("layout-delete").disabled = !name;
  }

  now() { return { fields: Object.fromEntries(FIELDS.map((id) => [id, by(id).value])), ...this.get() }; }

  show({ fields, ...content }) {
    for (const id of FIELDS) if (fields?.[id] !== undefined) by(id).value = fields[id];
    this.set(content);
  }

  /** Writes the layout to the address, without a new entry in the history. */
  write() {
    const hash = `#${encodeURIComponent(JSON.stringify(this.now()))}`;
    if (hash !== location.hash) history.replaceState(null, "", location.pathname + location.search + hash);
  }

  /** Returns the layout of the address; null if it has none. */
  read() {
    try {
      return JSON.parse(decodeURIComponent(location.hash.slice(1)));
    } catch {
      return null;
    }
  }
}
