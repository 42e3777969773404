// Selection of the signals that a controller sends if it cannot send all; it applies to every page.

import { node } from "./dom.js";

const button = (textContent, title, onclick) => node("button", { textContent, title, onclick });

/** Adds the unsent signals of the Data Base to a list, with buttons to select signals. */
export function offerSending(list, { layout, unsent }, choose) {
  if (!unsent?.length) return;
  const sent = layout.signals.map(({ name }) => name);
  for (const label of list.querySelectorAll("label[data-signal]")) {
    const name = label.dataset.signal;
    if (sent.length > 1) label.append(button("remove", `Stop sending ${name}, to free space for another signal`,
      (event) => { event.preventDefault(); choose(sent.filter((other) => other !== name)); }));
  }
  list.append(...unsent.map((name) => {
    const row = node("div", { className: "unsent", textContent: name });
    row.dataset.name = name.toLowerCase();
    row.append(button("send", `Send ${name} too, if the device has space for it`, () => choose([...sent, name])));
    return row;
  }));
}
