// Draws the figures of a report as interactive plots; without scripts the page shows pictures.

const plots = JSON.parse(document.getElementById("plots").textContent);
const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#56b4e9", "#8c564b", "#7f7f7f"];
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
let drawn = [], other = null, range = null;

function digits(value) {
  if (value == null) return "–";
  const size = Math.abs(value);
  return size !== 0 && (size >= 1e5 || size < 1e-3) ? value.toExponential(3) : String(Number(value.toPrecision(5)));
}

/** Joins the curves of a panel, and of the same panel of the other run, on one time axis. */
function tables(panel, theirs) {
  const table = (curve) => [curve.time_s, curve.values];
  const all = [...panel.curves, ...(theirs?.curves ?? [])];
  return all.length ? window.uPlot.join(all.map(table), all.map(() => [2])) : [[]];
}

function shade(plot, spans) {
  const { left, top, width, height } = plot.bbox;
  spans.forEach((span, number) => {
    const [start, end] = [span.start_s, span.end_s].map((at) => Math.min(Math.max(plot.valToPos(at, "x", true), left), left + width));
    plot.ctx.fillStyle = number % 2 ? "rgba(128,128,128,.05)" : "rgba(0,114,178,.09)";
    plot.ctx.fillRect(start, top, end - start, height);
  });
}

function mark(plot, levels, spans, isFirst) {
  const { left, top, width } = plot.bbox, scale = devicePixelRatio;
  plot.ctx.save();
  plot.ctx.textAlign = "left";
  plot.ctx.font = `${12 * scale}px system-ui, sans-serif`;
  plot.ctx.fillStyle = plot.ctx.strokeStyle = style("--quiet");
  plot.ctx.setLineDash([7 * scale, 5 * scale]);
  const { min, max } = plot.scales.y;
  for (const { label, value } of levels.filter(({ value }) => value > min && value < max)) {
    const y = plot.valToPos(value, "y", true);
    plot.ctx.beginPath();
    plot.ctx.moveTo(left, y);
    plot.ctx.lineTo(left + width, y);
    plot.ctx.stroke();
    plot.ctx.fillText(label, left + 6 * scale, y - 4 * scale);
  }
  if (isFirst) {
    for (const { start_s, end_s, label } of spans) {
      const [start, end] = [start_s, end_s].map((at) => Math.min(Math.max(plot.valToPos(at, "x", true), left), left + width));
      const text = plot.ctx.measureText(label).width;
      if (text < end - start) plot.ctx.fillText(label, (start + end - text) / 2, top + 13 * scale);
    }
  }
  plot.ctx.restore();
}

function draw() {
  drawn.forEach((plot) => plot.destroy());
  drawn = [];
  const axis = { stroke: style("--quiet"), grid: { stroke: style("--rule"), width: 1 }, ticks: { stroke: style("--rule"), width: 1 } };
  for (const figure of plots) {
    const place = document.querySelector(`[data-plot="${CSS.escape(figure.stem)}"]`);
    place.replaceChildren();
    const theirs = other?.find(({ stem }) => stem === figure.stem);
    figure.panels.forEach((panel, number) => {
      const their = theirs?.panels[number];
      const unit = /\(([^)]*)\)$/.exec(panel.y_label)?.[1] ?? "";
      const value = (_, found) => `${digits(found)} ${unit}`;
      const series = (curve, place_, isOther) => ({
        label: isOther ? `${curve.label}, other run` : curve.label, stroke: COLORS[place_ % COLORS.length], value,
        width: isOther ? 1 : 1.6, dash: isOther ? [6, 4] : undefined, points: { show: false },
      });
      drawn.push(new window.uPlot({
        title: panel.title, width: place.clientWidth, height: 200,
        scales: { x: { time: false, ...(range ? { min: range[0], max: range[1] } : {}) } },
        cursor: { sync: { key: "report" }, drag: { x: true, y: false } },
        series: [{ label: "time", value: (_, found) => `${digits(found)} s` },
          ...panel.curves.map((curve, place_) => series(curve, place_, false)),
          ...(their?.curves ?? []).map((curve, place_) => series(curve, place_, true))],
        axes: [axis, { ...axis, size: 72, label: panel.y_label, labelSize: 18, values: (_, numbers) => numbers.map(digits) }],
        hooks: {
          drawClear: [(self) => shade(self, figure.spans)],
          draw: [(self) => mark(self, panel.levels, figure.spans, number === 0)],
          setSelect: [(self) => {
            if (self.select.width > 0) zoom([self.posToVal(self.select.left, "x"), self.posToVal(self.select.left + self.select.width, "x")]);
          }],
          ready: [(self) => self.over.addEventListener("dblclick", () => zoom(null))],
        },
      }, tables(panel, their), place));
    });
  }
}

/** Zooms every plot to a time span; null shows the whole run. */
function zoom(to) {
  range = to;
  for (const plot of drawn) {
    const times = plot.data[0];
    plot.setScale("x", to ? { min: to[0], max: to[1] } : { min: times[0], max: times[times.length - 1] });
  }
}

document.documentElement.classList.add("live");
draw();
let width = document.body.clientWidth;
addEventListener("resize", () => {
  if (width !== document.body.clientWidth) draw();
  width = document.body.clientWidth;
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
document.getElementById("other").addEventListener("change", async ({ target }) => {
  const text = await target.files[0]?.text();
  const page = text && new DOMParser().parseFromString(text, "text/html").getElementById("plots");
  other = page ? JSON.parse(page.textContent) : null;
  document.getElementById("other-said").textContent = text && !page ? "invalid file: not a report of `dimsart run`" : "";
  draw();
});
