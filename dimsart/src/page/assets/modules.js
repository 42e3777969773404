// The pending scheme as cards, one per module, and the bar that applies it.

import { Adding } from "./adding.js";
import { by, focusedElement, node } from "./dom.js";
import { Pending } from "./pending.js";
import { flag } from "./rows.js";

// Up to this number of modules, all cards are open.
const FEW = 3;

export class Modules {
  /** `ask(station, what)` sends an action to a station; `changed()` is called when the pending scheme changes. */
  constructor(ask, say, changed) {
    this.ask = ask;
    this.say = say;
    this.changed = changed;
    this.drafts = new Map();
    this.draft = null;
    this.why = "";
    this.key = "";
    this.adding = new Adding((kind, before) => this.add(kind, before));
    by("module-filter").oninput = () => this.filter();
    by("add").onclick = () => this.choose(null);
    by("undo").onclick = () => this.draft.pending.go(-1);
    by("redo").onclick = () => this.draft.pending.go(1);
    by("drop").onclick = () => this.draft.pending.discard();
    by("apply").onclick = () => this.apply();
    by("copy-rows").onclick = () => this.copy();
    by("open-rows").onclick = () => by("rows-file").click();
    by("rows-file").onchange = () => this.open();
    addEventListener("keydown", (event) => {
      if (!event.ctrlKey || this.why || !this.draft) return;
      // A text field undoes its own input.
      const isTyping = /** @type {Element} */ (event.target).matches("input, textarea");
      const todo = { Enter: "apply", ...(!isTyping && { z: event.shiftKey ? "redo" : "undo", Z: "redo", y: "redo" }) }[event.key];
      if (!todo) return;
      event.preventDefault();
      // The change of the focused field comes first.
      focusedElement()?.blur();
      this.draft.pending.queue.then(() => by(todo).click());
    });
  }

  /** Shows a station: `here` is its latest news. */
  show(station, here) {
    if (!this.drafts.has(station)) {
      const draft = { station, open: new Map() };
      draft.pending = new Pending((what) => this.ask(station, what), () => {
        if (draft !== this.draft) return;
        // Shows the present value instead of a refused one.
        if (draft.pending.refused) this.key = "";
        this.showCards();
        this.showPending();
        this.changed();
      }, `dimsart pending ${here.name}`);
      this.drafts.set(station, draft);
      draft.pending.restore();
    }
    this.draft = this.drafts.get(station);
    this.draft.here = here;
    this.showCards();
    this.showPending();
  }

  /** Forgets a replaced station. */
  forget(station) {
    this.drafts.delete(station);
  }

  /** Enables changes of the shown station, or shows why they are disabled. */
  allow(why) {
    if (this.why === why) return;
    this.why = why;
    for (const id of ["modules", "add", "open-rows"]) Object.assign(by(id), { disabled: Boolean(why), title: why });
    if (this.draft) this.showPending();
  }

  /** Whether a check of the pending scheme runs on the controller. */
  isBusy(station) {
    return Boolean(this.drafts.get(station)?.pending.isBusy);
  }

  /** Returns overview and faults of the pending scheme, or of the running one. */
  shown({ pending, here } = this.draft) {
    return pending.tried ?? { overview: here.overview, findings: here.faults?.findings ?? [] };
  }

  /** Does edits, made from the modules of the pending scheme. */
  edit(make) {
    if (!this.why) this.draft.pending.edit(make);
  }

  set(module, parameter, value, isStructural) {
    this.edit((modules) => {
      const set = { edit: "set", module, parameter, value };
      return isStructural ? replugged(modules, module, [set]) : [set];
    });
  }

  add(kind, before) {
    this.draft.open.set(kind, true);
    this.edit((modules) => [{ edit: "on", module: free(modules, kind), before }]);
  }

  remove(module) {
    this.edit(() => [{ edit: "close", module }]);
  }

  /** Moves a module by one place. */
  move(module, steps) {
    this.edit((modules) => {
      const others = plugged(modules).filter((name) => name !== module);
      const place = plugged(modules).indexOf(module) + steps;
      return place < 0 || place > others.length ? [] : [{ edit: "off", module }, { edit: "on", module, before: others[place] ?? null }];
    });
  }

  duplicate(module) {
    this.edit((modules) => {
      const { ports, parameters } = modules.find(({ name }) => name === module);
      const copy = free(modules, module.replace(/\.\d+$/, ""));
      const settings = [...ports.map(({ name, signal }) => [name, signal]), ...parameters.flatMap(({ name, values, default: fallback }) =>
        (fallback === null ? [] : values.map((value, place) => [values.length > 1 ? `${name}[${place}]` : name, flag(value)])))];
      const sets = settings.map(([parameter, value]) => ({ edit: "set", module: copy, parameter, value: String(value) }));
      return [...sets, { edit: "on", module: copy, before: following(modules, module) }];
    });
  }

  /** Binds a port to a signal. */
  bind(module, port, signal) {
    this.set(module, port, signal, true);
  }

  /** Lists the signals that a port can be bound to. */
  matching(port) {
    const types = this.draft.here.types ?? [];
    const fits = ({ unit, shape }) => shape === port.shape && (unit === port.unit || unit === "any" || port.unit === "any");
    return [...new Set([port.signal, ...types.filter(fits).map(({ name }) => name)])];
  }

  /** Opens the dialog that adds a module before another one. */
  choose(before) {
    const { here } = this.draft;
    this.adding.open(here.kinds ?? [], plugged(this.shown().overview?.modules ?? []), before);
  }

  /** Opens the card of a module. */
  reveal(module) {
    this.draft.open.set(module, true);
    this.key = "";
    this.showCards();
    const card = [...by("modules").children].find((found) => found.dataset.module === module);
    card?.scrollIntoView({ block: "nearest" });
    card?.querySelector("input, select, summary")?.focus();
  }

  showCards() {
    const { station, here: { overview: running } } = this.draft;
    const { overview, findings } = this.shown();
    const wrong = new Set(findings.filter((finding) => finding.is_fault).map((finding) => finding.module));
    // Rebuild only after a change: the user may be editing.
    const { modules } = overview ?? { modules: [] };
    const key = JSON.stringify([station, modules, [...wrong], running?.modules, this.draft.here.types?.length]);
    if (key === this.key) return;
    this.key = key;
    const focused = focusedElement()?.dataset?.edit;
    by("type-names").replaceChildren(...(this.draft.here.types ?? []).map(({ name }) => node("option", { value: name })));
    by("modules").replaceChildren(...modules.map((module) => this.card(module, wrong.has(module.name))));
    if (focused) by("modules").querySelector(`[data-edit="${CSS.escape(focused)}"]`)?.focus();
    this.filter();
  }

  card(module, isWrong) {
    const { draft } = this, { name } = module;
    const isOn = module.place != null;
    const action = (label, textContent, title, onclick) => {
      const button = node("button", { type: "button", textContent, title, onclick });
      Object.assign(button.dataset, { edit: `${name} ${label}` });
      button.setAttribute("aria-label", `${label} ${name}`);
      return button;
    };
    const switched = isOn ? action("unplug", "Unplug", "It keeps its parameters", () => this.edit(() => [{ edit: "off", module: name }]))
      : action("plug in", "Plug in", "As the last module", () => this.edit(() => [{ edit: "on", module: name, before: null }]));
    const buttons = [
      ...(isOn ? [action("earlier", "▲", "Move it before the previous module", () => this.move(name, -1)),
        action("later", "▼", "Move it behind the next module", () => this.move(name, 1))] : []),
      switched,
      action("duplicate", "Duplicate", "Add another module with the same settings", () => this.duplicate(name)),
      action("remove", "Remove", "Remove it with its parameters", () => this.remove(name)),
    ];
    const place = isOn ? `${module.place}. ${name}` : `${name}, not plugged in`;
    const card = node("details", {
      className: `module ${isOn ? "" : "off"} ${isWrong ? "wrong" : ""}`,
      open: draft.open.get(name) ?? (isWrong || draft.here.overview?.modules.length <= FEW),
    }, node("summary", {}, node("span", { textContent: place })), node("div", { className: "buttons" }, ...buttons));
    card.ontoggle = () => draft.open.set(name, card.open);
    card.dataset.module = name;
    card.dataset.name = `${name} ${module.parameters.map((parameter) => parameter.name).join(" ")}`.toLowerCase();
    const running = draft.here.overview?.modules.find((found) => found.name === name);
    for (const parameter of module.parameters) card.append(this.parameter(module, parameter, running));
    for (const port of module.ports) card.append(this.port(module, port, running));
    return card;
  }

  parameter(module, parameter, running) {
    const isOf = (value) => parameter.default !== null && String(value) !== String(parameter.default);
    const isChanged = parameter.values.some(isOf);
    const isMany = parameter.values.length > 1;
    if (parameter.default === null) return this.list(module, parameter);
    const before = running?.parameters.find(({ name }) => name === parameter.name)?.values;
    const inputs = parameter.values.map((value, place) => {
      const name = isMany ? `${parameter.name}[${place}]` : parameter.name;
      return this.input(module.name, name, flag(value), before && flag(before[place]), parameter.choices, parameter.is_structural);
    });
    const unit = parameter.unit ? node("span", { className: "unit", textContent: parameter.unit }) : "";
    const fallback = parameter.default === null ? "" : `, default ${flag(parameter.default)}${parameter.unit ? ` ${parameter.unit}` : ""}`;
    return node("div", { className: "parameter" },
      node("span", { className: isChanged ? "from-default" : "", title: parameter.summary, textContent: parameter.name }),
      node("span", { className: "values" }, ...inputs, unit),
      node("span", { className: "range", textContent: `${parameter.summary} Allowed: ${parameter.range}${fallback}` }));
  }

  /** A parameter that is a list: a new entry is added at its end. */
  list(module, { name, values, range, summary, is_structural }) {
    const entry = this.input(module.name, name, "", undefined, null, is_structural);
    Object.assign(entry, { placeholder: "add an entry", size: 16 });
    entry.setAttribute("list", "type-names");
    const last = values.length ? `last entry ${values.map(flag).join(" ")}` : "empty";
    return node("div", { className: "parameter" },
      node("span", { title: summary, textContent: name }),
      node("span", { className: "values" }, node("span", { className: "quiet", textContent: last }), entry),
      node("span", { className: "range", textContent: `${summary} Allowed: ${range}` }));
  }

  port(module, port, running) {
    const before = running?.ports.find(({ name }) => name === port.name)?.signal;
    const input = this.input(module.name, port.name, port.signal, before, this.matching(port), true);
    const form = `${port.unit || "no unit"}, ${port.shape} word${port.shape === "1" ? "" : "s"}`;
    return node("div", { className: "parameter" },
      node("span", { textContent: port.name.replace(/^PORT_/, "") }), node("span", { className: "values" }, input),
      node("span", { className: "range", textContent: `${port.writes ? "writes" : "reads"} this signal: ${form}` }));
  }

  input(module, parameter, value, before, choices, isStructural) {
    const key = `${module} ${parameter}`, shown = String(value);
    const input = choices?.length
      ? node("select", {}, ...choices.map((choice) => node("option", { value: choice, textContent: choice, selected: choice === shown })))
      : node("input", { type: "text", inputMode: "decimal", value: shown, size: Math.max(5, shown.length) });
    input.setAttribute("aria-label", key);
    input.dataset.edit = key;
    input.classList.toggle("edited", before !== undefined && String(before) !== shown);
    input.onchange = () => {
      const value = input.value.trim();
      if (value) this.set(module, parameter, value, isStructural);
    };
    return input;
  }

  showPending() {
    const { pending } = this.draft, { lines, refused, why } = pending;
    const { usage, timing } = this.shown().overview?.status ?? {};
    by("pending").hidden = !pending.tried && !refused;
    by("pending-count").textContent = `${lines.length} change${lines.length === 1 ? "" : "s"}, not applied yet`;
    by("pending-list").replaceChildren(...lines.map((text) => node("li", { textContent: text })));
    by("pending-check").textContent = refused || why || "check passed";
    by("pending-check").className = refused || (why && !pending.isBusy) ? "bad" : "good";
    by("pending-cost").textContent = [
      usage && `${usage.words} of ${usage.words_in_all} words`,
      timing?.bound_cycles && `at most ${timing.bound_cycles} of ${timing.limit_cycles ?? "any number of"} cycles per tick`,
    ].filter(Boolean).join(", ");
    Object.assign(by("apply"), { disabled: Boolean(why || this.why), title: this.why || why });
    Object.assign(by("undo"), { disabled: !pending.canUndo || Boolean(this.why) });
    Object.assign(by("redo"), { disabled: !pending.canRedo || Boolean(this.why) });
  }

  async apply() {
    const { pending } = this.draft;
    if (by("apply").disabled) return;
    const done = await pending.apply();
    this.say(done === undefined ? pending.refused : String(done), done === undefined);
  }

  /** Copies the rows of the running scheme. */
  async copy() {
    const rows = await this.ask(this.draft.station, { do: "rows" });
    await navigator.clipboard.writeText(rows).then(() => this.say("rows of the scheme copied"), (error) => this.say(error.message, true));
  }

  /** Opens a scheme file as the pending scheme. */
  async open() {
    const [file] = by("rows-file").files;
    by("rows-file").value = "";
    if (file) this.draft.pending.open(await file.text());
  }

  filter() {
    const wanted = by("module-filter").value.trim().toLowerCase();
    for (const card of by("modules").children) {
      card.hidden = !card.dataset.name.includes(wanted);
      if (wanted && !card.hidden) card.open = true;
    }
  }
}

const plugged = (modules) => modules.filter(({ place }) => place != null).map(({ name }) => name);

/** The module after another one. */
const following = (modules, module) => {
  const names = plugged(modules);
  return names[names.indexOf(module) + 1] ?? null;
};

/** A free name for a module of a kind. */
function free(modules, kind) {
  const names = new Set(modules.map(({ name }) => name));
  let name = kind;
  for (let number = 2; names.has(name); number++) name = `${kind}.${number}`;
  return name;
}

/** Edits of a module that must be unplugged meanwhile. */
function replugged(modules, module, edits) {
  if (!plugged(modules).includes(module)) return edits;
  return [{ edit: "off", module }, ...edits, { edit: "on", module, before: following(modules, module) }];
}
