// One status row per controller, for pages with several.

import { by, node } from "./dom.js";

/** Shows the rows; `health(here)` is a class of the dot. */
export function showFleet(stations, health) {
  const fleet = by("fleet");
  fleet.hidden = stations.length < 2;
  const rows = stations.map((here) => [health(here), here.name, here.gone ? `no connection: ${here.gone}` : here.status?.live.state ?? "…", here.overview?.status.first_fault?.reason ?? ""]);
  const key = JSON.stringify(rows);
  if (fleet.dataset.key === key) return;
  fleet.dataset.key = key;
  by("fleet-rows").replaceChildren(...rows.map(([dot, name, state, fault]) => node("tr", {},
    node("th", { scope: "row" }, node("span", { className: `dot ${dot}` }), name),
    node("td", { textContent: state }), node("td", { className: "fault", textContent: fault }))));
}
