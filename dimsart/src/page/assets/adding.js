// Dialog that adds a module: a searchable list of the controller's kinds.

import { by, node } from "./dom.js";

export class Adding {
  /** `add(kind, before)` adds a module before another one, or as the last one. */
  constructor(add) {
    this.add = add;
    by("adding-filter").oninput = () => this.filter();
    by("adding-form").onsubmit = (event) => {
      event.preventDefault();
      const first = [...by("adding-list").children].find((item) => !item.hidden);
      first?.querySelector("button").click();
    };
    by("adding-close").onclick = () => by("adding").close();
    by("adding").onkeydown = (event) => { if (event.key === "Escape") by("adding").close(); };
  }

  /** Opens the dialog for a place in the order of the modules. */
  open(kinds, plugged, before) {
    const places = plugged.map((name) => node("option", { value: name, textContent: `before ${name}` }));
    by("adding-place").replaceChildren(...places, node("option", { value: "", textContent: "as the last module" }));
    by("adding-place").value = before ?? "";
    by("adding-list").replaceChildren(...kinds.map(({ name, summary }) => {
      const button = node("button", { type: "button", textContent: name });
      button.onclick = () => {
        by("adding").close();
        this.add(name, by("adding-place").value || null);
      };
      const item = node("li", {}, button, node("span", { className: "quiet", textContent: summary }));
      item.dataset.text = `${name} ${summary}`.toLowerCase();
      return item;
    }));
    by("adding-filter").value = "";
    // Not modal: STOP stays within reach.
    by("adding").show();
    by("adding-filter").focus();
  }

  filter() {
    const words = by("adding-filter").value.trim().toLowerCase().split(/\s+/);
    const items = [...by("adding-list").children];
    for (const item of items) item.hidden = !words.every((word) => item.dataset.text.includes(word));
    // Names before summaries.
    const rank = (item) => item.querySelector("button").textContent.toLowerCase().indexOf(words[0].replace(/\W/g, ""));
    const last = (item) => (rank(item) < 0 ? 1e3 : rank(item));
    by("adding-list").append(...items.sort((a, b) => last(a) - last(b)));
  }
}
