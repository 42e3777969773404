// Which signals a controller sends that has no room for all of them: the same for every page.

function button(text, title, onclick) {
  return Object.assign(document.createElement("button"), { textContent: text, title, onclick });
}

/** Adds to a list of signals those of the Data Base that are not sent, and buttons that choose; nothing where all are sent. */
export function offerSending(list, { layout, unsent }, choose) {
  if (!unsent?.length) return;
  const sent = layout.signals.map(({ name }) => name);
  for (const label of list.querySelectorAll("label[data-signal]")) {
    const name = label.dataset.signal;
    if (sent.length > 1) label.append(button("leave out", `Has ${name} sent no more, to make room for another signal`,
      (event) => { event.preventDefault(); choose(sent.filter((other) => other !== name)); }));
  }
  list.append(...unsent.map((name) => {
    const row = Object.assign(document.createElement("div"), { className: "unsent", textContent: name });
    row.dataset.name = name.toLowerCase();
    row.append(button("send", `Has ${name} sent, too, if the device has room for it`, () => choose([...sent, name])));
    return row;
  }));
}
