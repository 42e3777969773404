// The list of stored traces: each can be hidden, shifted in time and removed.

import { by, node } from "./dom.js";

/** Shows the traces of the sources; `change(isRebuilt)` is called after a change, with true if curves were added or removed. */
export function showTraces(sources, change) {
  by("traces").replaceChildren(...sources.traces.map((trace) => {
    const isShown = node("input", { type: "checkbox", checked: trace.isShown });
    isShown.onchange = () => { trace.isShown = isShown.checked; change(true); };
    const shift = node("input", { type: "number", step: "any", value: trace.shift_s });
    shift.onchange = () => { trace.shift_s = Number(shift.value) || 0; change(false); };
    const remove = node("button", { textContent: "Remove" });
    remove.onclick = () => {
      sources.traces = sources.traces.filter((other) => other !== trace);
      showTraces(sources, change);
      change(true);
    };
    return node("li", {}, node("label", {}, isShown, trace.name), node("label", {}, "shift ", shift, " s"), remove);
  }));
}
