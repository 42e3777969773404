// Diagram of the scheme: columns are the device and the modules in order, rows are the signals of the Data Base. A wire leads
// from the writer of a signal to its readers; it is dashed where the signal is read before it is written in a tick.
//
// A module's name opens its card, + adds a module, and a dot can be dragged to another signal that fits its port.

import { by, focusedElement, svgNode } from "./dom.js";

const COLUMN = 88, ROW = 20, LEFT = 180, TOP = 92, RIGHT = 80;

/** `editor` is `Modules`. */
export function drawScheme(place, overview, findings, editor) {
  if (!overview) {
    delete place.dataset.key;
    return place.replaceChildren();
  }
  const key = JSON.stringify([overview.modules, overview.signals.map(({ name, unit }) => [name, unit]), overview.measured, findings]);
  if (place.dataset.key === key) return;
  place.dataset.key = key;
  const plugged = overview.modules.filter((module) => module.place != null);
  const columns = [{ name: "device measurement", reads: [], writes: overview.measured ?? [] },
    ...plugged, { name: "device command", reads: overview.taken ?? [], writes: [] }];
  const wrong = findings.filter((finding) => finding.is_fault);
  const wrongSignals = new Set(wrong.map((finding) => finding.signal));
  const wrongModules = new Set(wrong.map((finding) => finding.module));
  // In the order of their writers, then the signals without a writer.
  const names = [...new Set([...columns.flatMap((column) => column.writes), ...columns.flatMap((column) => column.reads)])];
  const units = new Map(overview.signals.map((signal) => [signal.name, signal.unit]));
  const width = LEFT + COLUMN * columns.length + RIGHT, height = TOP + ROW * names.length + 12;
  const svg = svgNode("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "group" });
  svg.setAttribute("aria-label", `${plugged.length} modules: ${plugged.map((module) => module.name).join(", ")}`);
  const x = (column) => LEFT + COLUMN * (column + 0.5), y = (row) => TOP + ROW * (row + 0.5);
  columns.forEach((column, number) => {
    svg.append(svgNode("line", { x1: x(number), x2: x(number), y1: TOP - 6, y2: height - 8, class: "column" }));
    const isWrong = wrongModules.has(column.name);
    const isFrame = number === 0 || number === columns.length - 1;
    const title = svgNode("text", {
      x: x(number) - 4, y: TOP - 12, transform: `rotate(-32 ${x(number) - 4} ${TOP - 12})`,
      class: isWrong ? "wrong" : isFrame ? "quiet" : "",
    }, column.name);
    svg.append(title);
    if (!isFrame) asModule(title, column, editor);
    if (number > 0) svg.append(plus(x(number) - COLUMN / 2, isFrame ? null : column.name, editor));
  });
  const lanes = new Map();
  names.forEach((name, row) => {
    const isWrong = wrongSignals.has(name);
    const unit = units.get(name);
    const label = svgNode("text", { x: 0, y: y(row) + 4, class: isWrong ? "wrong" : "" }, unit ? `${name} (${unit})` : name);
    const lane = svgNode("rect", { x: 0, y: y(row) - ROW / 2, width, height: ROW, class: "lane" });
    lanes.set(name, lane);
    svg.append(lane, label);
    const writers = columns.flatMap((column, number) => (column.writes.includes(name) ? [number] : []));
    const readers = columns.flatMap((column, number) => (column.reads.includes(name) ? [number] : []));
    const all = [...writers, ...readers];
    const first = Math.min(...all), last = Math.max(...all), from = writers[0] ?? first;
    const wire = (start, end, late) => {
      if (start !== end) {
        svg.append(svgNode("line", { x1: x(start), x2: x(end), y1: y(row), y2: y(row),
          class: `wire ${late ? "late" : ""} ${isWrong ? "wrong" : ""}` }));
      }
    };
    wire(first, from, true);
    wire(from, last, false);
    const dot = (number, kind) => {
      const column = columns[number];
      const circle = svgNode("circle", { cx: x(number), cy: y(row), r: 5, class: `${kind} ${isWrong ? "wrong" : ""}` });
      circle.append(svgNode("title", {}, `${column.name} ${kind} ${name}`));
      svg.append(circle);
      const port = column.ports?.find((found) => found.signal === name && found.writes === (kind === "writes"));
      if (port) asPort(circle, column.name, port, lanes, editor);
    };
    readers.forEach((number) => dot(number, "reads"));
    writers.forEach((number) => dot(number, "writes"));
  });
  const focused = focusedElement()?.dataset?.edit;
  place.replaceChildren(svg);
  if (focused) place.querySelector(`[data-edit="${CSS.escape(focused)}"]`)?.focus();
}

const ZOOM_STEP = 1.25, MIN_ZOOM = 0.4, MAX_ZOOM = 3;

/** Enables zoom of the diagram by buttons and by Ctrl and the wheel; it pans by scrolling. */
export function enableZoom(place) {
  let zoom = 1;
  const change = (factor) => {
    zoom = Math.max(MIN_ZOOM, Math.min(MAX_ZOOM, zoom * factor));
    place.style.setProperty("--zoom", String(zoom));
  };
  by("zoom-in").onclick = () => change(ZOOM_STEP);
  by("zoom-out").onclick = () => change(1 / ZOOM_STEP);
  place.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    change(event.deltaY < 0 ? ZOOM_STEP : 1 / ZOOM_STEP);
  }, { passive: false });
}

/** Makes an element usable by keyboard. */
function asButton(element, edit, label) {
  Object.assign(element.dataset, { edit: `diagram ${edit}` });
  for (const [name, value] of Object.entries({ tabindex: 0, role: "button", "aria-label": label })) element.setAttribute(name, value);
}

/** A module's name: opens its card; Alt and an arrow key move the module, Delete removes it. */
function asModule(title, { name }, editor) {
  asButton(title, `title ${name}`, `${name}: Enter opens its card, Alt with an arrow key moves it, Delete removes it`);
  title.onclick = () => editor.reveal(name);
  title.onkeydown = (event) => {
    const steps = event.altKey && { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (steps) editor.move(name, steps);
    else if (event.key === "Delete") editor.remove(name);
    else if (event.key === "Enter") editor.reveal(name);
    else return;
    event.preventDefault();
  };
}

/** Adds a module before another one. */
function plus(x, before, editor) {
  const group = svgNode("g", { class: "plus", transform: `translate(${x} ${TOP - 14})` });
  asButton(group, `add ${before ?? ""}`, before ? `Add a module before ${before}` : "Add a module at the end");
  group.append(svgNode("circle", { r: 7 }), svgNode("path", { d: "M -4 0 H 4 M 0 -4 V 4" }), svgNode("title", {}, group.getAttribute("aria-label")));
  group.onclick = () => editor.choose(before);
  group.onkeydown = (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    editor.choose(before);
  };
  return group;
}

/** A port: dragged to the lane of another signal, or moved by arrow keys, it is bound to this signal. */
function asPort(circle, module, port, lanes, editor) {
  const edit = `${module} ${port.name}`, verb = port.writes ? "writes" : "reads";
  asButton(circle, edit, `${edit} ${verb} ${port.signal}: arrow keys bind it to another signal`);
  const fitting = () => new Set(editor.matching(port));
  const laneAt = (event) => {
    const fits = fitting();
    return [...lanes].find(([name, lane]) => {
      const { top, bottom } = lane.getBoundingClientRect();
      return event.clientY >= top && event.clientY < bottom && fits.has(name);
    })?.[0];
  };
  let isDragged = false;
  const end = () => {
    isDragged = false;
    for (const lane of lanes.values()) lane.classList.remove("fits", "over");
    circle.removeAttribute("transform");
  };
  circle.onpointerdown = (event) => {
    if (editor.why) return;
    isDragged = true;
    circle.setPointerCapture(event.pointerId);
    const fits = fitting();
    for (const [name, lane] of lanes) lane.classList.toggle("fits", fits.has(name));
  };
  circle.onpointermove = (event) => {
    if (!isDragged) return;
    const box = lanes.get(port.signal).getBoundingClientRect(), over = laneAt(event);
    // The diagram may be zoomed.
    const scale = box.height / Number(lanes.get(port.signal).getAttribute("height"));
    circle.setAttribute("transform", `translate(0 ${(event.clientY - (box.top + box.bottom) / 2) / scale})`);
    for (const [name, lane] of lanes) lane.classList.toggle("over", name === over);
  };
  circle.onpointerup = (event) => {
    if (!isDragged) return;
    const over = laneAt(event);
    end();
    if (over && over !== port.signal) editor.bind(module, port.name, over);
  };
  circle.onpointercancel = end;
  circle.onkeydown = (event) => {
    const steps = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!steps) return;
    event.preventDefault();
    const fits = fitting(), names = [...lanes.keys()].filter((name) => fits.has(name));
    const next = names[names.indexOf(port.signal) + steps];
    if (next) editor.bind(module, port.name, next);
  };
}
