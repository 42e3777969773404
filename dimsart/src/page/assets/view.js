// Recordings in place of controllers, as `dimsart view` serves them.

import { by, node } from "./dom.js";
import { decodeRecording } from "./sources.js";

const AGAIN_MS = 500;

/** Loads the recordings of the server into the scope, and marks the first difference that a replay finds. */
export async function viewRecordings(names, scope, token) {
  document.body.classList.add("view");
  const get = (path, number) => fetch(`/${path}?token=${token}&number=${number}`);
  // The folder distinguishes recordings with the same file name.
  const short = (path) => path.split(/[/\\]/).slice(-2).join("/");
  const load = async (name, number) => ({ name: short(name), rings: decodeRecording(await (await get("recorded", number)).arrayBuffer()) });
  const recordings = await Promise.all(names.map(load));
  scope.open(recordings);
  const sources = scope.sources.names;
  document.title = `DIMSART: ${short(names[0])}`;
  by("stations").replaceChildren(...sources.map((name, station) => node("button", { textContent: name, onclick: () => scope.choose(station) })));
  by("state-text").textContent = names.length === 1 ? names[0] : `${names[0]}, compared with ${names.slice(1).join(", ")}`;
  const replayed = async (number) => {
    for (;;) {
      const response = await get("replayed", number);
      if (response.status === 200) return response.json();
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
  };
  by("scope-note").textContent = "replaying …";
  const results = await Promise.all(names.map((_, number) => replayed(number)));
  by("replay").hidden = false;
  by("replay").replaceChildren(...results.map(({ text }, number) => node("li", { textContent: `${short(names[number])}: ${text}` })));
  scope.mark(results[0].differences);
}
