// Module cards. Edits are collected, checked on the device, and applied together between two ticks.

const by = (id) => document.getElementById(id);
const TRY_MS = 350;
// Up to this number of modules, all cards are open.
const FEW = 3;

function node(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

export class Modules {
  /** `ask(station, what)` sends an action to a station. */
  constructor(ask, say) {
    Object.assign(this, { ask, say, drafts: new Map(), draft: null, why: "", key: "" });
    by("module-filter").oninput = () => this.filter();
    by("drop").onclick = () => this.drop();
    by("apply").onclick = () => this.apply();
    by("plug").onchange = () => {
      const module = by("plug").value;
      by("plug").value = "";
      if (module) this.edit(this.draft, `${module} on`, { edit: "on", module, before: null }, `plug in ${module}`);
    };
    by("modules").addEventListener("keydown", (event) => {
      if (event.key === "Enter" && event.ctrlKey) this.apply();
    });
  }

  /** Shows a station: `here` is its latest news. */
  show(station, here) {
    if (!this.drafts.has(station)) {
      // Pending edits of this station, the result of their check, and the open cards.
      this.drafts.set(station, { station, edits: new Map(), open: new Map(), text: "", isGood: false });
    }
    const draft = this.drafts.get(station);
    draft.here = here;
    if (this.draft !== draft) {
      this.draft = draft;
      this.showPending();
    }
    this.showCards();
  }

  /** Forgets a replaced station. */
  forget(station) {
    clearTimeout(this.drafts.get(station)?.timer);
    this.drafts.delete(station);
  }

  /** Enables changes of the shown station, or shows why they are disabled. */
  allow(why) {
    if (this.why === why) return;
    this.why = why;
    for (const id of ["modules", "plug"]) Object.assign(by(id), { disabled: Boolean(why), title: why });
    this.showCheck();
  }

  showCards() {
    const { station, here: { overview, faults, kinds = [] }, edits } = this.draft;
    const wrong = new Set((faults?.findings ?? []).filter((finding) => finding.is_fault).map((finding) => finding.module));
    // Rebuild only after a change: the user may be editing.
    const { signals, modules } = overview ?? { signals: [], modules: [] };
    const key = JSON.stringify([station, modules, [...wrong], signals.map(({ name }) => name), kinds, [...edits.keys()]]);
    if (key === this.key) return;
    this.key = key;
    const focused = document.activeElement?.dataset?.edit;
    by("modules").replaceChildren(...modules.map((module) => this.card(module, wrong.has(module.name))));
    if (focused) by("modules").querySelector(`[data-edit="${CSS.escape(focused)}"]`)?.focus();
    const plugged = new Set(modules.map(({ name }) => name));
    const named = kinds.map(({ name, summary }) => {
      let free = name;
      for (let number = 2; plugged.has(free); number++) free = `${name}.${number}`;
      return node("option", { value: free, textContent: free, title: summary });
    });
    by("plug").replaceChildren(node("option", { value: "", textContent: "a module …" }), ...named);
    this.filter();
  }

  card(module, isWrong) {
    const { draft } = this;
    const isOn = module.place != null;
    const toggle = node("button", { textContent: isOn ? "Unplug" : "Plug in" });
    toggle.onclick = () => this.edit(draft, `${module.name} on`,
      isOn ? { edit: "off", module: module.name } : { edit: "on", module: module.name, before: null },
      `${isOn ? "unplug" : "plug in"} ${module.name}`);
    const place = isOn ? `${module.place}. ${module.name}` : `${module.name}, not plugged in`;
    const card = node("details", {
      className: `module ${isOn ? "" : "off"} ${isWrong ? "wrong" : ""}`,
      open: draft.open.get(module.name) ?? (isWrong || draft.here.overview.modules.length <= FEW),
    }, node("summary", {}, node("span", { textContent: place }), toggle));
    card.ontoggle = () => draft.open.set(module.name, card.open);
    card.dataset.name = `${module.name} ${module.parameters.map(({ name }) => name).join(" ")}`.toLowerCase();
    for (const parameter of module.parameters) card.append(this.parameter(module, parameter));
    for (const port of module.ports) card.append(this.port(module, port));
    return card;
  }

  parameter(module, parameter) {
    const isOf = (value) => parameter.default !== null && String(value) !== String(parameter.default);
    const isChanged = parameter.values.some(isOf);
    const isMany = parameter.values.length > 1;
    const inputs = parameter.values.map((value, place) => {
      const name = isMany ? `${parameter.name}[${place}]` : parameter.name;
      return this.input(module.name, name, flag(value), parameter.choices, parameter.is_structural);
    });
    const unit = parameter.unit ? node("span", { className: "unit", textContent: parameter.unit }) : "";
    const fallback = parameter.default === null ? "" : `, default ${flag(parameter.default)}${parameter.unit ? ` ${parameter.unit}` : ""}`;
    return node("div", { className: "parameter" },
      node("span", { className: isChanged ? "from-default" : "", title: parameter.summary, textContent: parameter.name }),
      node("span", { className: "values" }, ...inputs, unit),
      node("span", { className: "range", textContent: `${parameter.summary} ${parameter.range}${fallback}` }));
  }

  port(module, port) {
    const signals = this.draft.here.overview.signals.map(({ name }) => name);
    if (!signals.includes(port.signal)) signals.unshift(port.signal);
    const input = this.input(module.name, port.name, port.signal, signals, true);
    return node("div", { className: "parameter" },
      node("span", { textContent: port.name }), node("span", { className: "values" }, input),
      node("span", { className: "range", textContent: port.writes ? "writes this signal" : "reads this signal" }));
  }

  input(module, parameter, value, choices, structural) {
    const key = `${module} ${parameter}`, { draft } = this;
    const edited = draft.edits.get(key);
    const shown = edited?.edit.value ?? String(value);
    const input = choices?.length
      ? node("select", {}, ...choices.map((choice) => node("option", { value: choice, textContent: choice, selected: choice === shown })))
      : node("input", { type: "text", inputMode: "decimal", value: shown, size: Math.max(5, shown.length) });
    input.setAttribute("aria-label", key);
    input.dataset.edit = key;
    input.classList.toggle("edited", Boolean(edited));
    input.onchange = () => {
      if (input.value.trim() === String(value)) return this.undo(draft, key);
      this.edit(draft, key, { edit: "set", module, parameter, value: input.value.trim() }, `${key}: ${value} → ${input.value.trim()}`, structural);
    };
    return input;
  }

  edit(draft, key, edit, text, structural = false) {
    if (edit.edit !== "set" && draft.edits.has(key)) return this.undo(draft, key);
    draft.edits.set(key, { edit, text, structural });
    this.changed(draft);
  }

  undo(draft, key) {
    draft.edits.delete(key);
    this.changed(draft);
  }

  drop() {
    this.draft.edits.clear();
    this.changed(this.draft);
  }

  /** Checks again after an edit. */
  changed(draft) {
    Object.assign(draft, { text: "", isGood: false });
    clearTimeout(draft.timer);
    if (draft.edits.size) draft.timer = setTimeout(() => this.try(draft), TRY_MS);
    this.showPending();
  }

  showPending() {
    const { edits } = this.draft;
    this.key = "";
    by("pending").hidden = edits.size === 0;
    by("pending-count").textContent = `${edits.size} change${edits.size === 1 ? "" : "s"}, not applied yet`;
    by("pending-list").replaceChildren(...[...edits.values()].map(({ text }) => node("li", { textContent: text })));
    this.showCheck();
    this.showCards();
  }

  showCheck() {
    const { text, isGood } = this.draft ?? { text: "", isGood: false };
    by("pending-check").textContent = text;
    by("pending-check").className = isGood ? "good" : "bad";
    Object.assign(by("apply"), { disabled: !isGood || Boolean(this.why), title: this.why });
  }

  /** Returns the edits ordered by module. A module with structural edits is unplugged meanwhile and plugged in again at its
      position. */
  ordered({ edits: made, here }) {
    const edits = [...made.values()].map(({ edit, structural }) => ({ edit, structural }));
    const names = [...new Set(edits.map(({ edit }) => edit.module))];
    const plugged = (here.overview?.modules ?? []).filter((module) => module.place != null).map(({ name }) => name);
    return names.flatMap((module) => {
      const its = edits.filter(({ edit }) => edit.module === module);
      const sets = its.filter(({ edit }) => edit.edit === "set").map(({ edit }) => edit);
      const plug = its.find(({ edit }) => edit.edit !== "set")?.edit;
      const place = plugged.indexOf(module);
      if (plug) return plug.edit === "off" ? [plug, ...sets] : [...sets, plug];
      if (place < 0 || !its.some(({ structural }) => structural)) return sets;
      return [{ edit: "off", module }, ...sets, { edit: "on", module, before: plugged[place + 1] ?? null }];
    });
  }

  /** Checks the changes on the device without applying them. */
  async try(draft) {
    const tried = this.ordered(draft);
    const show = (text, isGood) => {
      if (JSON.stringify(tried) !== JSON.stringify(this.ordered(draft))) return;
      Object.assign(draft, { text, isGood });
      if (draft === this.draft) this.showCheck();
    };
    try {
      const { faults, findings } = await this.ask(draft.station, { do: "transaction", edits: tried, commit: false });
      const texts = findings.filter((finding) => finding.is_fault).map((finding) => finding.text);
      show(faults ? `check failed: ${texts.join("; ")}` : "check passed", !faults);
    } catch (error) {
      show(error.message, false);
    }
  }

  async apply() {
    const { draft } = this;
    if (!draft?.edits.size || by("apply").disabled) return;
    const applied = [...draft.edits], edits = this.ordered(draft);
    // Prevents a second application.
    Object.assign(draft, { text: "applying …", isGood: false });
    this.showCheck();
    try {
      this.say(String(await this.ask(draft.station, { do: "transaction", edits, commit: true })));
      // Edits that were changed meanwhile stay pending.
      for (const [key, edit] of applied) if (draft.edits.get(key) === edit) draft.edits.delete(key);
    } catch (error) {
      this.say(error.message, true);
    }
    this.changed(draft);
  }

  filter() {
    const wanted = by("module-filter").value.trim().toLowerCase();
    for (const card of by("modules").children) {
      card.hidden = !card.dataset.name.includes(wanted);
      if (wanted && !card.hidden) card.open = true;
    }
  }
}

const flag = (value) => (value === true ? "ON" : value === false ? "OFF" : value);
