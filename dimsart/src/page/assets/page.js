// The page of controllers: one WebSocket receives news and sends actions.
//
//   news ──▶ stations[n] ──▶ showState, Modules, Scheme, Scope, Device
//   buttons, edits ──▶ ask(n, what) ──▶ answer

import { DevicePicture } from "./device.js";
import { by, node } from "./dom.js";
import { showFleet } from "./fleet.js";
import { Modules } from "./modules.js";
import { drawScheme, enableZoom } from "./scheme.js";
import { Presets } from "./presets.js";
import { Recording } from "./recording.js";
import { Scope } from "./scope.js";
import { Tuning } from "./tuning.js";
import { viewRecordings } from "./view.js";

const token = new URLSearchParams(location.search).get("token") ?? "";

// Interval of presence messages while this page moves a device; the server's timeout is 0.5 s.
const HERE_MS = 100;
const PAUSE_MS = 500;

const stations = [];
// `client` is the server's id of this page while connected.
let shown = 0, socket = null, client = null, next = 1, missed = 0, toastTimer = 0;
const waiting = new Map();

const scope = new Scope((names) => told(ask(shown, { do: "stream", names })), say, token);
const recording = new Recording((on) => record(on), say);
const device = new DevicePicture(by("device"), hold);
let robots = null;
const modules = new Modules(ask, say, () => showScheme());
const presets = new Presets((what) => ask(shown, what), () => scope.last(shown)?.get("POSITION")?.values, say);
const tuning = new Tuning((what) => ask(shown, what), scope, modules, say, token);

const isOpen = () => socket?.readyState === WebSocket.OPEN;
const isMine = (here) => isOpen() && !here.gone && client !== null && here.status?.holder === client;

function ask(station, what) {
  return new Promise((resolve, reject) => {
    if (!isOpen()) return reject(new Error("no connection to the server"));
    const id = next++;
    waiting.set(id, { resolve, reject });
    socket.send(JSON.stringify({ ...what, say: what.say ?? "do", id, station }));
  });
}

// The reference or hand of an axis is sent at most every 20 ms; the last value is always sent.
const HOLD_MS = 20;
const holds = new Map();

function hold(station, axis, value, signal = "DES_POSITION") {
  const key = `${station} ${axis} ${signal}`, last = holds.get(key);
  const go = () => ask(station, { do: "hold", signal, axis, value: value === null ? null : String(value) })
    .catch((error) => say(error.message, true));
  clearTimeout(last?.timer);
  const now = performance.now(), at = value === null ? now : Math.max(now, (last?.at ?? 0) + HOLD_MS);
  holds.set(key, { at, timer: setTimeout(go, at - now) });
}

function say(text, isBad = false) {
  const toast = by("toast");
  toast.textContent = text;
  toast.classList.toggle("bad", isBad);
  toast.hidden = false;
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => { toast.hidden = true; }, isBad ? 8000 : 3000);
}

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket?token=${token}`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : takeRows(data));
  socket.onopen = () => showLine("connected");
  socket.onclose = () => {
    for (const { reject } of waiting.values()) reject(new Error("the connection to the server was closed"));
    waiting.clear();
    // The state of the devices is unknown now.
    client = null;
    for (const here of stations) here.status = null;
    show();
    showLine("no connection to `dimsart serve`: check that it runs", true);
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
      client = message.client;
      for (let number = 0; number < Math.max(stations.length, message.stations.length); number++) {
        const name = message.stations[number];
        if (stations[number]?.name === name) continue;
        // The station was removed or replaced.
        scope.forget(number);
        modules.forget(number);
        stations[number] = { name, faults: null, events: [] };
      }
      stations.length = message.stations.length;
      // After a reconnection, the recordings are loaded already.
      if (scope.isRecorded) return;
      if (message.recordings.length) return viewRecordings(message.recordings, scope, token).catch((error) => say(error.message, true));
      scope.setNames(message.stations);
      shown = Math.max(0, Math.min(shown, stations.length - 1));
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
      say(`${stations[station].name}: ${content.reason}`, true);
      break;
    case "layout":
      stations[station].layout = content;
      scope.layout(station, content, stations[station].overview?.identity.sample_period_s);
      break;
    case "recording":
      recording.hear(stations[station].name, stations[station].recording, content);
      // falls through
    default:
      // The overview of a dry run of this page is not the running scheme.
      if (kind === "overview" && content.status.is_in_transaction && modules.isBusy(station)) break;
      stations[station][kind] = content;
      // The controllers of a simulation share a clock.
      if (kind === "simulated") scope.shareClock(station, content);
      if (kind === "geometry") showRobots();
      if (kind === "overview") scope.period(station, content.identity.sample_period_s);
      show(kind, station);
  }
}

function takeRows(data) {
  const station = scope.rows(data);
  const isCommanded = stations[station].status?.live.is_commanded;
  if (station === shown || robots) {
    const signals = scope.last(station);
    if (station === shown) device.move(signals, isCommanded);
    robots?.move(station, signals, isCommanded);
  }
}

function show(kind, station = shown) {
  showStations();
  showFleet(stations, health);
  if (station !== shown || !stations[shown]) return;
  const here = stations[shown];
  scope.show(shown, here.name);
  recording.show(here.recording);
  if (!kind || kind === "status" || kind === "gone" || kind === "overview") showState(here);
  if (!kind || kind === "overview" || kind === "faults" || kind === "kinds" || kind === "types") {
    // Clears the view of a station without news.
    modules.show(shown, here);
    device.show(shown, here.overview?.identity);
    tuning.show(here);
    presets.show(here);
    showScheme();
  }
  if (!kind || kind === "events") showEvents(here.events);
}

function health(here) {
  if (!isOpen()) return "";
  if (here.gone) return "bad";
  if (!here.status) return "";
  if (here.status.live.is_commanded) return "good";
  return here.status.live.state.includes("lease") || here.status.live.state.includes("stopped") ? "warn" : "bad";
}

function showStations() {
  if (scope.isRecorded) return;
  const buttons = stations.map((here, number) => {
    const button = node("button", {
      title: here.gone ?? here.status?.live.state ?? "",
      onclick: () => { shown = number; show(); },
    }, node("span", { className: `dot ${health(here)}` }), here.name);
    button.setAttribute("aria-current", String(number === shown));
    return button;
  });
  const nav = by("stations");
  const key = buttons.map((button) => button.outerHTML).join();
  if (nav.dataset.key !== key) {
    nav.dataset.key = key;
    nav.replaceChildren(...buttons);
  }
}

/** Returns why this page cannot change a controller; empty if it can. */
function refusal(here) {
  if (!isOpen()) return "no connection to the server";
  if (here.gone) return `no connection to the controller: ${here.gone}`;
  if (!here.status) return "no status from the controller yet";
  if (here.status.holder != null && !isMine(here)) return "another page has armed it: STOP it, or disarm it there";
  return "";
}

/** Enables a button, or disables it and shows why. */
function allow(id, why) {
  const button = by(id);
  button.dataset.title ??= button.title;
  button.title = why || button.dataset.title;
  button.disabled = Boolean(why);
}

function showState(here) {
  const live = here.status?.live, isHeld = isMine(here), why = refusal(here);
  const isOtherPage = here.status?.holder != null && !isHeld;
  const isOther = live?.holder != null && !isHeld && `client ${live.holder} holds the lease`;
  const text = by("state-text");
  text.className = `verdict ${health(here)}`;
  text.textContent = !isOpen() ? "no connection to the server: state unknown"
    : here.gone ? `no connection: ${here.gone}` : (live?.state ?? "…");
  allow("arm", why || isOther || (isHeld && "already armed by this page"));
  by("arm").classList.toggle("on", isHeld);
  by("arm").textContent = isHeld ? "Armed by this page" : isOtherPage ? "Armed by another page" : "Arm";
  by("arm-all").hidden = stations.length < 2;
  allow("arm-all", isOpen() ? "" : why);
  allow("disarm", stations.some(isMine) ? "" : isOtherPage ? why : "no controller is armed by this page");
  const isRunning = here.overview?.status.is_running && !live?.state.includes("stopped");
  allow("start", why || isOther || (isRunning && "already running"));
  for (const id of ["reset", "save"]) allow(id, why);
  by("transaction").hidden = !here.overview?.status.is_in_transaction || modules.isBusy(shown);
  allow("abort", why);
  modules.allow(why);
  const whyStill = why || (isOther || "");
  device.allow(whyStill);
  robots?.allow(whyStill);
  tuning.allow(why, isHeld);
  presets.allow(why || (isHeld ? "" : "arm the controller first"));
  const status = here.overview?.status, identity = here.overview?.identity;
  const bound = status?.timing?.bound_cycles;
  const cycles = (count) => (count == null ? null : `${count} cycles`);
  const facts = [
    ["device", identity && `${identity.device}, ${identity.axes.length === 1 ? "1 axis" : `${identity.axes.length} axes`} (${identity.axes.join(", ")})`],
    ["image", identity?.image],
    ["tick", live && `${live.ticks}, every ${1000 * (identity?.sample_period_s ?? 0)} ms`],
    ["drive", status?.drive],
    ["lease", live && (isHeld ? "this page" : isOtherPage ? "another page" : live.holder == null ? "free" : `client ${live.holder}`)],
    ["first fault", status?.first_fault && `tick ${status.first_fault.tick}: ${status.first_fault.reason}`],
    ["isolated", status?.cut_out],
    ["last tick", cycles(status?.timing?.last_cycles)],
    ["mean, max", status?.timing?.mean_cycles != null ? `${status.timing.mean_cycles}, ${status.timing.max_cycles} cycles` : null],
    ["bound, limit", bound && `${bound}, ${status.timing.limit_cycles ?? "no"} cycles`],
    ["late, overrun", status?.timing && `${status.timing.late}, ${status.timing.overruns} of ${status.timing.ticks} ticks`],
    ["scheme", status?.schemes && `loaded at start: ${status.schemes.origin}; trial: ${status.schemes.trial}`],
    ["missed", missed ? `${missed} updates: this browser is too slow` : null],
    ["ticks lost", scope.gaps(shown) ? `${scope.gaps(shown)} in transmission` : null],
  ].filter(([, value]) => value);
  by("facts").replaceChildren(...facts.flatMap(([name, value]) =>
    [node("dt", { textContent: name }), node("dd", { textContent: value })]));
}

/** Shows the pending scheme, or the running one. */
function showScheme() {
  const { overview, findings } = modules.shown();
  drawScheme(by("scheme"), overview, findings, modules);
  by("findings").replaceChildren(...findings.map((finding) => node("li", {
    className: finding.is_fault ? "fault" : "quiet",
    textContent: `${finding.is_fault ? "fault" : "delay"}: ${finding.text}`,
  })));
}

/** Shows all simulated devices in 3D; loads the view when it is needed. */
async function showRobots() {
  const has = stations.some(({ geometry }) => geometry);
  by("robot-section").hidden = !has;
  if (!has || !by("robot-details").open) return;
  if (robots) return robots.show(stations);
  try {
    const { Robots } = await import("./robots.js");
    robots ??= new Robots(by("robot"), hold);
    robots.show(stations);
  } catch (error) {
    by("robot").textContent = `No 3D view: ${error.message}`;
  }
}

function showEvents(events) {
  by("events").replaceChildren(...[...(events ?? [])].reverse().map((event) =>
    node("li", { textContent: `tick ${event.tick}: ${event.what} ${event.name}${event.text ? `: ${event.text}` : ""}` })));
}

const told = (promise) => promise.then((done) => say(String(done)), (error) => say(error.message, true));

/** Starts or ends a recording of the shown station; every page receives the summary. */
const record = (on) => ask(shown, { do: "record", on }).then((path) => on && say(`recording to ${path}`), (error) => say(error.message, true));

/** Stops every device, and reports success after all answers. */
async function stopAll() {
  if (!isOpen()) return say("NOT STOPPED: no connection to the server", true);
  say("STOP: waiting for the answer …", true);
  /** @type {any[]} */
  const answers = await Promise.allSettled(stations.map((_, station) => ask(station, { say: "stop" })));
  const wrong = answers.flatMap(({ reason }, station) => (reason ? [`${stations[station]?.name ?? ""}: ${reason.message}`] : []));
  if (wrong.length) say(`NOT STOPPED or not confirmed: ${wrong.join("; ")}`, true);
  else say([...new Set(answers.map(({ value }) => String(value)))].join("; "));
}

enableZoom(by("scheme"));
by("robot-details").ontoggle = showRobots;
by("stop").onclick = stopAll;
addEventListener("keydown", (event) => { if (event.key === "Escape") stopAll(); });
by("arm").onclick = () => told(ask(shown, { do: "arm" }));
by("arm-all").onclick = () => stations.forEach((_, station) => told(ask(station, { do: "arm" })));
by("disarm").onclick = () => stations.forEach((here, station) => {
  if (isMine(here)) told(ask(station, { do: "disarm" }));
});
by("start").onclick = () => told(ask(shown, { do: "check" }).then(({ state }) => state));
by("reset").onclick = () => told(ask(shown, { do: "reset" }));
by("save").onclick = () => told(ask(shown, { do: "save" }));
by("abort").onclick = () => told(ask(shown, { do: "abort" }));
// A hidden page sends no presence: a device must not move unseen.
setInterval(() => {
  if (stations.some(isMine) && !document.hidden) socket.send('{"say":"here"}');
}, HERE_MS);

connect();
