// Module cards. What is edited is collected, tried on the device without effect, and applied together between two ticks.

const by = (id) => document.getElementById(id);
const TRY_MS = 350;
// So many modules are shown with all their parameters.
const FEW = 3;

function node(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

export class Modules {
  constructor(ask, say) {
    Object.assign(this, { ask, say, edits: new Map(), open: new Map(), key: "" });
    by("module-filter").oninput = () => this.filter();
    by("drop").onclick = () => this.drop();
    by("apply").onclick = () => this.apply();
    by("plug").onchange = () => {
      const module = by("plug").value;
      by("plug").value = "";
      if (module) this.edit(`${module} on`, { edit: "on", module, before: null }, `plug ${module} in`);
    };
    by("modules").addEventListener("keydown", (event) => {
      if (event.key === "Enter" && event.ctrlKey) this.apply();
    });
  }

  show(overview, faults, kinds) {
    this.overview = overview;
    const wrong = new Set((faults?.findings ?? []).filter((finding) => finding.is_fault).map((finding) => finding.module));
    // What is being edited must not be taken away under the user's hands.
    const { signals, modules } = overview;
    const key = JSON.stringify([modules, [...wrong], signals.map(({ name }) => name), kinds, [...this.edits.keys()]]);
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
    const isOn = module.place != null;
    const toggle = node("button", { textContent: isOn ? "Plug out" : "Plug in" });
    toggle.onclick = () => this.edit(`${module.name} on`,
      isOn ? { edit: "off", module: module.name } : { edit: "on", module: module.name, before: null },
      `plug ${module.name} ${isOn ? "out" : "in"}`);
    const place = isOn ? `${module.place}. ${module.name}` : `${module.name}, not plugged in`;
    const card = node("details", {
      className: `module ${isOn ? "" : "off"} ${isWrong ? "wrong" : ""}`,
      open: this.open.get(module.name) ?? (isWrong || this.overview.modules.length <= FEW),
    }, node("summary", {}, node("span", { textContent: place }), toggle));
    card.ontoggle = () => this.open.set(module.name, card.open);
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
    const signals = this.overview.signals.map(({ name }) => name);
    if (!signals.includes(port.signal)) signals.unshift(port.signal);
    const input = this.input(module.name, port.name, port.signal, signals, true);
    return node("div", { className: "parameter" },
      node("span", { textContent: port.name }), node("span", { className: "values" }, input),
      node("span", { className: "range", textContent: port.writes ? "writes this signal" : "reads this signal" }));
  }

  input(module, parameter, value, choices, structural) {
    const key = `${module} ${parameter}`;
    const edited = this.edits.get(key);
    const shown = edited?.edit.value ?? String(value);
    const input = choices?.length
      ? node("select", {}, ...choices.map((choice) => node("option", { value: choice, textContent: choice, selected: choice === shown })))
      : node("input", { type: "text", inputMode: "decimal", value: shown, size: Math.max(5, shown.length) });
    input.setAttribute("aria-label", key);
    input.dataset.edit = key;
    input.classList.toggle("edited", Boolean(edited));
    input.onchange = () => {
      if (input.value.trim() === String(value)) return this.forget(key);
      this.edit(key, { edit: "set", module, parameter, value: input.value.trim() }, `${key}: ${value} → ${input.value.trim()}`, structural);
    };
    return input;
  }

  edit(key, edit, text, structural = false) {
    if (edit.edit !== "set" && this.edits.has(key)) return this.forget(key);
    this.edits.set(key, { edit, text, structural });
    this.showPending();
  }

  forget(key) {
    this.edits.delete(key);
    this.showPending();
  }

  drop() {
    this.edits.clear();
    this.showPending();
  }

  showPending() {
    this.key = "";
    by("pending").hidden = this.edits.size === 0;
    by("pending-count").textContent = `${this.edits.size} change${this.edits.size === 1 ? "" : "s"}, not applied yet`;
    by("pending-list").replaceChildren(...[...this.edits.values()].map(({ text }) => node("li", { textContent: text })));
    by("apply").disabled = true;
    by("pending-check").textContent = "";
    if (this.overview) this.show(this.overview, this.faults, this.kinds ?? []);
    clearTimeout(this.timer);
    if (this.edits.size) this.timer = setTimeout(() => this.try(), TRY_MS);
  }

  /** The edits as the device takes them, module by module: what is set only while a module is plugged out has it out
      meanwhile, and back in its place. */
  ordered() {
    const edits = [...this.edits.values()].map(({ edit, structural }) => ({ edit, structural }));
    const names = [...new Set(edits.map(({ edit }) => edit.module))];
    const plugged = this.overview.modules.filter((module) => module.place != null).map(({ name }) => name);
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

  /** Has the device check the changes, which have no effect by that. */
  async try() {
    const tried = this.ordered();
    const show = (text, isGood) => {
      if (JSON.stringify(tried) !== JSON.stringify(this.ordered())) return;
      by("pending-check").textContent = text;
      by("pending-check").className = isGood ? "good" : "bad";
      by("apply").disabled = !isGood;
    };
    try {
      const { faults, findings } = await this.ask({ do: "transaction", edits: tried, commit: false });
      const texts = findings.filter((finding) => finding.is_fault).map((finding) => finding.text);
      show(faults ? `does not match: ${texts.join("; ")}` : "checked: it matches", !faults);
    } catch (error) {
      show(error.message, false);
    }
  }

  async apply() {
    if (!this.edits.size || by("apply").disabled) return;
    try {
      this.say(String(await this.ask({ do: "transaction", edits: this.ordered(), commit: true })));
      this.drop();
    } catch (error) {
      this.say(error.message, true);
    }
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
