// The page of controllers: what they say comes in over one WebSocket, what is to be done goes out over it.
//
//   news ──▶ stations[n] ──▶ showState, Scheme, Modules, Scope, Device
//   buttons, edits ──▶ ask(n, what) ──▶ answer

import { DevicePicture } from "/device.js";
import { Modules } from "/modules.js";
import { drawScheme } from "/scheme.js";
import { Scope } from "/scope.js";

export const by = (id) => document.getElementById(id);

const token = new URLSearchParams(location.search).get("token") ?? "";

// How often a page that moves a device says that it is there: the server waits for half a second.
const HERE_MS = 100;
const PAUSE_MS = 500;

const stations = [];
let shown = 0, socket = null, next = 1, missed = 0;
const waiting = new Map();

const scope = new Scope();
// However fast the pointer is, a reference goes out at most every 20 ms; the last one always does.
let waits = null, sent = 0;
const device = new DevicePicture(by("device"), (axis, value) => {
  const go = () => ask({ do: "hold", signal: "DES_POSITION", axis, value: value === null ? null : String(value) }).catch((error) => say(error.message, true));
  clearTimeout(waits);
  waits = setTimeout(() => { sent = performance.now(); go(); }, Math.max(0, sent + 20 - performance.now()));
});
const modules = new Modules(ask, say);

export function ask(what, station = shown) {
  return new Promise((resolve, reject) => {
    if (socket?.readyState !== WebSocket.OPEN) return reject(new Error("no line to the server"));
    const id = next++;
    waiting.set(id, { resolve, reject });
    socket.send(JSON.stringify({ say: "do", ...what, id, station }));
  });
}

function say(text, isBad = false) {
  const toast = by("toast");
  toast.textContent = text;
  toast.classList.toggle("bad", isBad);
  toast.hidden = false;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => { toast.hidden = true; }, isBad ? 8000 : 3000);
}

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket?token=${token}`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : takeRows(data));
  socket.onopen = () => showLine("connected");
  socket.onclose = () => {
    for (const { reject } of waiting.values()) reject(new Error("the line to the server has ended"));
    waiting.clear();
    showLine("no line to `dimsart serve`: is it running?", true);
    setTimeout(connect, PAUSE_MS);
  };
}

function showLine(text, isBad = false) {
  by("line").textContent = text;
  by("line").classList.toggle("bad", isBad);
}

function hear({ kind, station, content, ...message }) {
  switch (kind) {
    case "hello":
      message.stations.forEach((name, number) => { stations[number] ??= { name, faults: null, events: [] }; });
      stations.length = message.stations.length;
      shown = Math.min(shown, stations.length - 1);
      show();
      break;
    case "answer": {
      if (message.id === 0) say(message.refused, true);
      const { resolve, reject } = waiting.get(message.id) ?? {};
      waiting.delete(message.id);
      if (message.refused === undefined) resolve?.(message.done);
      else reject?.(new Error(message.refused));
      break;
    }
    case "missed":
      missed += content;
      break;
    case "lost":
      // What is told of the time before this page was there is old.
      if (stations[station].status) say(`${stations[station].name}: ${content.reason}`, true);
      break;
    case "layout":
      stations[station].layout = content;
      scope.layout(station, content, stations[station].overview?.identity.sample_period_s);
      break;
    default:
      stations[station][kind] = content;
      if (kind === "overview") scope.period(station, content.identity.sample_period_s);
      show(kind, station);
  }
}

function takeRows(data) {
  const station = scope.rows(data);
  if (station === shown) device.move(scope.last(station), stations[station].status?.live.is_commanded);
}

function show(kind, station = shown) {
  showStations();
  if (station !== shown || !stations[shown]) return;
  const here = stations[shown];
  scope.show(shown, here.name);
  if (!kind || kind === "status" || kind === "gone" || kind === "overview") showState(here);
  if (!kind || kind === "overview" || kind === "faults") {
    if (here.overview) {
      drawScheme(by("scheme"), here.overview, here.faults);
      modules.show(here.overview, here.faults, here.kinds ?? []);
      device.show(here.overview);
    }
    showFindings(here.faults);
  }
  if (!kind || kind === "events") showEvents(here.events);
}

function health(here) {
  if (here.gone) return "bad";
  if (!here.status) return "";
  if (here.status.live.is_commanded) return "good";
  return here.status.live.state.includes("lease") || here.status.live.state.includes("stopped") ? "warn" : "bad";
}

function showStations() {
  const buttons = stations.map((here, number) => {
    const button = document.createElement("button");
    const dot = document.createElement("span");
    dot.className = `dot ${health(here)}`;
    button.append(dot, here.name);
    button.setAttribute("aria-current", number === shown);
    button.title = here.gone ?? here.status?.live.state ?? "";
    button.onclick = () => { shown = number; show(); };
    return button;
  });
  const nav = by("stations");
  const key = buttons.map((button) => button.outerHTML).join();
  if (nav.dataset.key !== key) {
    nav.dataset.key = key;
    nav.replaceChildren(...buttons);
  }
}

function showState(here) {
  const { live, is_held_here } = here.status ?? {};
  const text = by("state-text");
  text.className = `verdict ${health(here)}`;
  text.textContent = here.gone ? `no line: ${here.gone}` : (live?.state ?? "…");
  const isOther = live?.holder != null && !is_held_here;
  by("arm").disabled = !live || isOther || is_held_here;
  by("arm").classList.toggle("on", Boolean(is_held_here));
  by("arm").textContent = is_held_here ? "Armed by this page" : "Arm";
  by("arm-all").hidden = stations.length < 2;
  by("disarm").disabled = !stations.some((station) => station.status?.is_held_here);
  by("start").disabled = !live || isOther || Boolean(here.overview?.status.is_running && !live.state.includes("stopped"));
  const status = here.overview?.status, identity = here.overview?.identity;
  const cycles = (count) => (count == null ? null : `${count} cycles`);
  const facts = [
    ["device", identity && `${identity.device}, ${identity.axes.length === 1 ? "1 axis" : `${identity.axes.length} axes`} (${identity.axes.join(", ")})`],
    ["image", identity?.image],
    ["tick", live && `${live.ticks}, every ${1000 * (identity?.sample_period_s ?? 0)} ms`],
    ["drive", status?.drive],
    ["lease", live && (live.holder == null ? "nobody" : is_held_here ? "this page" : `client ${live.holder}`)],
    ["first fault", status?.first_fault && `tick ${status.first_fault.tick}: ${status.first_fault.reason}`],
    ["cut out", status?.cut_out],
    ["last tick", cycles(status?.timing?.last_cycles)],
    ["mean, most", status?.timing?.mean_cycles != null ? `${status.timing.mean_cycles}, ${status.timing.max_cycles} cycles` : null],
    ["late, overrun", status?.timing && `${status.timing.late}, ${status.timing.overruns} of ${status.timing.ticks} ticks`],
    ["scheme", status?.schemes && `started with: ${status.schemes.origin}; on trial: ${status.schemes.trial}`],
    ["missed", missed ? `${missed} pieces of news: this browser is too slow` : null],
    ["ticks lost", scope.gaps(shown) ? `${scope.gaps(shown)} on the way here` : null],
  ].filter(([, value]) => value);
  by("facts").replaceChildren(...facts.flatMap(([name, value]) => {
    const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
    dt.textContent = name;
    dd.textContent = value;
    return [dt, dd];
  }));
}

function showFindings(faults) {
  by("findings").replaceChildren(...(faults?.findings ?? []).map((finding) => {
    const item = document.createElement("li");
    item.className = finding.is_fault ? "fault" : "quiet";
    item.textContent = `${finding.is_fault ? "fault" : "delay"}: ${finding.text}`;
    return item;
  }));
}

function showEvents(events) {
  by("events").replaceChildren(...[...(events ?? [])].reverse().map((event) => {
    const item = document.createElement("li");
    item.textContent = `tick ${event.tick}: ${event.what} ${event.name}${event.text ? `: ${event.text}` : ""}`;
    return item;
  }));
}

const told = (promise) => promise.then((done) => say(String(done)), (error) => say(error.message, true));

function stopAll() {
  stations.forEach((_, station) => {
    const id = next++;
    waiting.set(id, { resolve: (done) => say(String(done)), reject: (error) => say(error.message, true) });
    socket.send(JSON.stringify({ say: "stop", id, station }));
  });
}

by("stop").onclick = stopAll;
addEventListener("keydown", (event) => { if (event.key === "Escape") stopAll(); });
by("arm").onclick = () => told(ask({ do: "arm" }));
by("arm-all").onclick = () => stations.forEach((_, station) => told(ask({ do: "arm" }, station)));
by("disarm").onclick = () => stations.forEach((here, station) => {
  if (here.status?.is_held_here) told(ask({ do: "disarm" }, station));
});
by("start").onclick = () => told(ask({ do: "check" }).then(({ state }) => state));
by("reset").onclick = () => told(ask({ do: "reset" }));
by("save").onclick = () => told(ask({ do: "save" }));
// A page that is hidden is throttled by its browser to a beat a second: a device does not move unseen.
setInterval(() => {
  const isHeld = stations.some((here) => here.status?.is_held_here);
  if (isHeld && socket?.readyState === WebSocket.OPEN && !document.hidden) socket.send('{"say":"here"}');
}, HERE_MS);

connect();
