// Diagram of the scheme: columns are the device and the modules in order, rows are the signals of the Data Base. A wire leads
// from the writer of a signal to its readers; it is dashed where the signal is read before it is written in a tick.

const COLUMN = 88, ROW = 20, LEFT = 180, TOP = 92;
const SVG = "http://www.w3.org/2000/svg";

function make(name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

export function drawScheme(place, overview, faults) {
  if (!overview) {
    delete place.dataset.key;
    return place.replaceChildren();
  }
  const plugged = overview.modules.filter((module) => module.place != null);
  const columns = [{ name: "device measurement", reads: [], writes: overview.measured ?? [] },
    ...plugged, { name: "device command", reads: overview.taken ?? [], writes: [] }];
  const wrong = (faults?.findings ?? []).filter((finding) => finding.is_fault);
  const wrongSignals = new Set(wrong.map((finding) => finding.signal));
  const wrongModules = new Set(wrong.map((finding) => finding.module));
  // In the order of their writers, then the signals without a writer.
  const names = [...new Set([...columns.flatMap((column) => column.writes), ...columns.flatMap((column) => column.reads)])];
  const units = new Map(overview.signals.map((signal) => [signal.name, signal.unit]));
  const width = LEFT + COLUMN * columns.length + 20, height = TOP + ROW * names.length + 12;
  const svg = make("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img" });
  svg.setAttribute("aria-label", `${plugged.length} modules: ${plugged.map((module) => module.name).join(", ")}`);
  const x = (column) => LEFT + COLUMN * (column + 0.5), y = (row) => TOP + ROW * (row + 0.5);
  columns.forEach((column, number) => {
    svg.append(make("line", { x1: x(number), x2: x(number), y1: TOP - 6, y2: height - 8, class: "column" }));
    const isWrong = wrongModules.has(column.name);
    const isFrame = number === 0 || number === columns.length - 1;
    svg.append(make("text", {
      x: x(number) - 4, y: TOP - 12, transform: `rotate(-32 ${x(number) - 4} ${TOP - 12})`,
      class: isWrong ? "wrong" : isFrame ? "quiet" : "",
    }, column.name));
  });
  names.forEach((name, row) => {
    const writers = [], readers = [];
    columns.forEach((column, number) => {
      if (column.writes.includes(name)) writers.push(number);
      if (column.reads.includes(name)) readers.push(number);
    });
    const isWrong = wrongSignals.has(name);
    const unit = units.get(name);
    svg.append(make("text", { x: 0, y: y(row) + 4, class: isWrong ? "wrong" : "" }, unit ? `${name} (${unit})` : name));
    const all = [...writers, ...readers];
    if (all.length === 0) return;
    const first = Math.min(...all), last = Math.max(...all), from = writers[0] ?? first;
    const wire = (start, end, late) => {
      if (start !== end) {
        svg.append(make("line", { x1: x(start), x2: x(end), y1: y(row), y2: y(row),
          class: `wire ${late ? "late" : ""} ${isWrong ? "wrong" : ""}` }));
      }
    };
    wire(first, from, true);
    wire(from, last, false);
    const dot = (number, kind) => {
      const circle = make("circle", { cx: x(number), cy: y(row), r: 5, class: `${kind} ${isWrong ? "wrong" : ""}` });
      circle.append(make("title", {}, `${columns[number].name} ${kind} ${name}`));
      svg.append(circle);
    };
    readers.forEach((number) => dot(number, "reads"));
    writers.forEach((number) => dot(number, "writes"));
  });
  const key = svg.outerHTML;
  if (place.dataset.key === key) return;
  place.dataset.key = key;
  place.replaceChildren(svg);
}
