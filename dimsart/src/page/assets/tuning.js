// Identify and tune: excite the loop, identify the joint, choose gains, try them in a simulation, add them to the pending changes.
//
//   excite ──▶ rows of the scope ──▶ /identify ──▶ gainsFor ──▶ /trial (a trace) or pending changes

import { digits } from "./device.js";
import { by, node } from "./dom.js";
import { gainsFor, marginsOf } from "./gains.js";
import { Plots } from "./plots.js";
import { post } from "./request.js";
import { decodeRecording } from "./sources.js";

/** Computation and hold of a command: one and a half sample periods. */
const HOLD_TICKS = 1.5;

export class Tuning {
  /** `ask(action)` sends an action for the shown station; `scope` provides rows; `modules` the scheme. */
  constructor(ask, scope, modules, say, token) {
    this.ask = ask;
    this.scope = scope;
    this.modules = modules;
    this.say = say;
    this.token = token;
    this.joint = null;
    this.plots = new Plots(by("tune-plot"), { draw() {}, set() {} }, null);
    const run = (work) => () => work.call(this).catch((error) => say(error.message, true));
    by("tune-kind").onchange = () => this.offer();
    by("tune-axis").onchange = () => this.forget();
    by("excite").onclick = run(this.excite);
    by("identify").onclick = run(this.identify);
    by("tune-try").onclick = run(this.attempt);
    by("tune-apply").onclick = () => this.apply();
    for (const id of ["tune-bandwidth", "tune-damping", "tune-integral"]) by(id).oninput = () => this.suggest();
    this.offer();
  }

  offer() {
    const isChirp = by("tune-kind").value === "chirp";
    by("tune-chirp").hidden = !isChirp;
    by("tune-prbs").hidden = isChirp;
  }

  /** Shows the axes of a station. */
  show(here) {
    this.here = here;
    const identity = here?.overview?.identity, axes = identity?.axes ?? [];
    const device = `${here?.name} ${axes.join()}`;
    if (this.device === device) return;
    this.device = device;
    this.forget();
    by("tune-axis").replaceChildren(...axes.map((kind, axis) => node("option", { value: axis, textContent: `${axis} (${kind})` })));
  }

  allow(why, isMine) {
    const simulated = this.here?.simulated;
    this.why = why;
    if (!isMine && this.timer) {
      clearInterval(this.timer);
      this.timer = null;
      by("excite-state").textContent = "stopped: the controller is not armed by this page";
    }
    const reason = why || (!simulated ? "on a board, add CHIRP_MOD or PRBS_MOD to the scheme instead" : isMine ? "" : "arm the controller first");
    by("excite").disabled = Boolean(reason);
    by("excite").title = reason || "Move the reference around its present value";
  }

  axis() { return Number(by("tune-axis").value) || 0; }

  isRotary() { return this.here.overview.identity.axes[this.axis()] === "rotary"; }

  async excite() {
    const number = (id) => Number(by(id).value);
    const seconds = number("tune-duration");
    const text = by("tune-kind").value === "chirp"
      ? `chirp ${number("tune-amplitude")} ${number("tune-from")} ${number("tune-to")} ${seconds}`
      : `prbs ${number("tune-amplitude")} ${number("tune-bit")} ${seconds}`;
    await this.ask({ do: "excite", signal: "DES_POSITION", axis: this.axis(), excitation: text });
    this.startedAt = performance.now();
    clearInterval(this.timer);
    this.timer = setInterval(() => {
      const left = seconds - (performance.now() - this.startedAt) / 1000;
      by("excite-state").textContent = left > 0 ? `${digits(Math.ceil(left))} s left` : "finished: identify";
      if (left > 0) return;
      clearInterval(this.timer);
      this.timer = null;
    }, 200);
  }

  /** Forgets the identified joint: it belongs to another axis. */
  forget() {
    this.joint = null;
    by("identified").replaceChildren();
    by("margins").textContent = "";
    by("tune-gains").hidden = true;
    this.plots.build([], "spectrum", 1);
  }

  async identify() {
    this.forget();
    const names = (name) => [name, `${name}[${this.axis()}]`];
    const { period_s, tick_s, values } = this.scope.series([names("POSITION"), names("FORCE"), names("DES_FORCE"), names("DES_POSITION")], Number(by("tune-duration").value));
    const [position, measured, commanded, reference] = values;
    if (!position || !(measured ?? commanded)) throw new Error("the scope receives no POSITION or no force of this axis");
    by("identified").textContent = "identifying …";
    const body = JSON.stringify({
      period_s, is_rotary: this.isRotary(), is_measured: Boolean(measured), delay_ticks: 0,
      position, force: measured ?? commanded, reference: reference ?? [],
    });
    const response = await post("identify", body, this.token).finally(() => { by("identified").textContent = ""; });
    this.showIdentified(await response.json(), tick_s, Boolean(measured));
  }

  showIdentified({ estimates, unexplained, refused, closed_loop, margins }, tick_s, isMeasured) {
    const rows = estimates.map(({ name, unit, value }) => node("tr", {}, node("th", { textContent: name }),
      node("td", { textContent: value ? `${digits(value[0])} ± ${digits(value[1])} ${unit}` : "not identifiable from this motion" })));
    by("identified").replaceChildren(...(refused
      ? [node("p", { className: "fault", textContent: refused })]
      : [node("table", {}, node("tbody", {}, ...rows)), node("p", { className: "quiet", textContent: `${digits(100 * unexplained)} % of the force is unexplained; force ${isMeasured ? "measured" : "as commanded"}; 95 % confidence` })]));
    const degrees = (value) => digits((value * 180) / Math.PI);
    by("margins").textContent = !closed_loop.length ? "" : [
      margins.bandwidth_hz && `bandwidth ${digits(margins.bandwidth_hz)} Hz`,
      margins.crossover && `phase margin ${degrees(margins.crossover[1])}° at ${digits(margins.crossover[0])} Hz`,
      margins.phase_crossing && `gain margin ${digits(margins.phase_crossing[1])} at ${digits(margins.phase_crossing[0])} Hz`,
    ].filter(Boolean).join(", ") || "margins: the loop's crossover is outside the excited frequencies";
    const used = closed_loop.filter(({ coherence }) => coherence >= 0.8);
    const x = used.map(({ frequency_hz }) => frequency_hz);
    const curve = (label, unit, color) => ({ label, unit, color });
    this.plots.build(used.length ? [{ curves: [curve("gain, reference to position", "dB", "#0072b2"), curve("phase", "°", "#d55e00")] }] : [], "spectrum", 1);
    if (used.length) this.plots.draw([[[x, used.map(({ gain }) => 20 * Math.log10(gain))], [x, used.map(({ phase_rad }) => (phase_rad * 180) / Math.PI)]]]);
    const value = (wanted) => estimates.find(({ quantity }) => quantity === wanted)?.value?.[0];
    if (value("inertia") > 0) {
      this.joint = { inertia: value("inertia"), viscous: Math.max(0, value("viscous") ?? 0), coulomb: Math.max(0, value("coulomb") ?? 0), lateness_s: Math.max(0, value("lateness") ?? 0), tick_s };
      this.suggest();
    }
  }

  /** The module of the scheme that the gains belong to. */
  law() { return this.modules.shown().overview?.modules.find(({ parameters }) => ["K_PARAM", "D_PARAM"].every((name) => parameters.some((known) => known.name === name))); }

  suggest() {
    const law = this.law();
    by("tune-gains").hidden = !this.joint;
    if (!this.joint) return;
    const canIntegrate = law?.parameters.some(({ name }) => name === "I_PARAM");
    by("tune-integral").disabled = !canIntegrate;
    const wanted = { bandwidth_hz: Number(by("tune-bandwidth").value), damping: Number(by("tune-damping").value), hasIntegral: canIntegrate && by("tune-integral").checked };
    if (!(wanted.bandwidth_hz > 0 && wanted.damping > 0)) return;
    this.gains = gainsFor(this.joint, wanted);
    const delay_s = HOLD_TICKS * this.joint.tick_s + this.joint.lateness_s;
    const filter_s = Number(law?.parameters.find(({ name }) => name === "FILTER_TIME")?.values[0] ?? 0);
    const { crossover_hz, phase_margin_deg, gain_margin } = marginsOf(this.joint, this.gains, { delay_s, filter_s });
    const { K, I, D } = this.gains;
    const isPoor = phase_margin_deg !== null && phase_margin_deg < 30;
    by("suggested").className = isPoor ? "fault" : "";
    by("suggested").textContent = `K = ${digits(K)}, ${wanted.hasIntegral ? `I = ${digits(I)}, ` : ""}D = ${digits(D)}; predicted phase margin ${digits(phase_margin_deg ?? NaN)}° at ${digits(crossover_hz ?? NaN)} Hz, gain margin ${gain_margin === null ? "unlimited" : digits(gain_margin)}, with ${digits(1000 * delay_s)} ms delay${isPoor ? ": reduce the bandwidth" : ""}`;
    by("tune-apply").disabled = by("tune-try").disabled = !law;
    by("tune-apply").title = law ? `Set the gains of ${law.name} in the pending changes` : "the scheme has no module with K_PARAM and D_PARAM";
  }

  /** Parameters of the law and their new values. */
  changes() {
    const law = this.law(), { K, I, D } = this.gains;
    const isKnown = (wanted) => law.parameters.some(({ name }) => name === wanted);
    const own = { K_PARAM: K, D_PARAM: D, ...(isKnown("I_PARAM") ? { I_PARAM: by("tune-integral").checked ? I : 0 } : {}) };
    return { law, own };
  }

  async attempt() {
    const { law, own } = this.changes(), { inertia, viscous, coulomb, tick_s } = this.joint;
    if (this.here.overview.identity.axes.length !== 1) throw new Error("a trial simulates a single axis: this controller has several");
    const rows = await this.ask({ do: "rows" });
    const rounded = Object.fromEntries(Object.entries(own).map(([name, value]) => [name, Number(value.toPrecision(5))]));
    const body = JSON.stringify({ name: this.scope.name, period_s: tick_s, is_rotary: this.isRotary(), delay_ticks: 0.5, inertia, viscous, coulomb, step: Number(by("tune-step").value), rows, set: { [law.name]: rounded } });
    const response = await post("trial", body, this.token);
    this.scope.align(decodeRecording(await response.arrayBuffer()), 0, `simulated, ${by("tune-bandwidth").value} Hz`);
    this.say("the simulated step is a dashed trace in the scope");
  }

  apply() {
    if (this.why) return this.say(this.why, true);
    const { law, own } = this.changes(), axes = this.here.overview.identity.axes.length;
    for (const [name, value] of Object.entries(own)) {
      const field = axes > 1 ? `${name}[${this.axis()}]` : name;
      this.modules.set(law.name, field, String(Number(value.toPrecision(5))), false);
    }
    this.say("the gains are in the pending changes: check and apply them");
  }
}
