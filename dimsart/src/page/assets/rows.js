// Compares schemes, given by their rows `destination module command value` and by the reports of their modules.

/** Splits rows by module: its settings in order, and the plugged-in modules in order. */
function parse(rows) {
  const modules = new Map(), order = [];
  const of = (name) => {
    if (!modules.has(name)) modules.set(name, []);
    return modules.get(name);
  };
  for (const line of rows.split("\n")) {
    const [, module, command, ...value] = line.replace(/#.*/, "").trim().split(/\s+/);
    if (command === "MOD_ON") {
      of(value[0]);
      order.push(value[0]);
    } else if (command && module !== "MOD_ENG") {
      of(module).push([command, value.join(" ")]);
    }
  }
  return { modules, order };
}

/** Returns a longest common subsequence. */
function common(from, to) {
  const longest = Array.from({ length: from.length + 1 }, () => Array(to.length + 1).fill(0));
  for (let i = from.length - 1; i >= 0; i--) {
    for (let j = to.length - 1; j >= 0; j--) {
      longest[i][j] = from[i] === to[j] ? longest[i + 1][j + 1] + 1 : Math.max(longest[i + 1][j], longest[i][j + 1]);
    }
  }
  const found = [];
  for (let i = 0, j = 0; i < from.length && j < to.length;) {
    if (from[i] === to[j]) { found.push(from[i]); i++; j++; }
    else if (longest[i + 1][j] >= longest[i][j + 1]) i++;
    else j++;
  }
  return found;
}

/** Lists the differences between two schemes, given by their modules. */
export function changes(from, to) {
  const find = (modules, name) => modules.find((module) => module.name === name);
  const order = (modules) => modules.filter(({ place }) => place != null).map(({ name }) => name);
  const stays = new Set(common(order(from), order(to)));
  const texts = from.filter(({ name }) => !find(to, name)).map(({ name }) => `− ${name}`);
  for (const module of to) {
    const { name, place } = module, before = find(from, name);
    if (!before) texts.push(`+ ${name}${place == null ? ", not plugged in" : ` at place ${place}`}`);
    else if (place == null && before.place != null) texts.push(`${name}: unplugged`);
    else if (place != null && before.place == null) texts.push(`${name}: plugged in at place ${place}`);
    else if (place != null && !stays.has(name)) texts.push(`${name}: place ${before.place} → ${place}`);
    const values = ({ values: all }) => all.map(flag).join(" ");
    const settings = ({ parameters, ports }) => [
      ...parameters.map((parameter) => [parameter.name, values(parameter), parameter.default === null ? "" : parameter.values.map(() => flag(parameter.default)).join(" ")]),
      ...ports.map((port) => [port.name, port.signal, ""])];
    const old = new Map(before && settings(before).map(([key, value]) => [key, value]));
    for (const [key, value, fallback] of settings(module)) {
      const was = old.get(key) ?? (before ? "" : fallback);
      if (was !== value && (before || !isPort(key))) texts.push(`${name} ${key}: ${was || "–"} → ${value}`);
    }
  }
  return texts;
}

const isPort = (name) => name.startsWith("PORT_");

/** Returns the edits that lead from one scheme to another. A module keeps its state unless its lists differ. `modules` are the
    reports of the modules of `to`. */
export function between(from, to, modules) {
  const [old, now] = [parse(from), parse(to)];
  const report = (module) => modules.find(({ name }) => name === module);
  const parameter = (module, name) => report(module)?.parameters.find((found) => found.name === name.replace(/\[\d+\]$/, ""));
  const isList = (module, name) => !isPort(name) && parameter(module, name)?.default === null;
  const lists = (scheme, module) => JSON.stringify((scheme.modules.get(module) ?? []).filter(([name]) => isList(module, name)));
  const isStructural = (module, name) => isPort(name) || parameter(module, name)?.is_structural;
  /** Values to set, also of settings that return to their defaults. */
  const changed = (module) => {
    const [before, after] = [old, now].map((scheme) => new Map(scheme.modules.get(module)?.filter(([name]) => !isList(module, name))));
    const sets = [...after].filter(([name, value]) => before.get(name) !== value);
    for (const name of before.keys()) {
      if (after.has(name)) continue;
      const port = report(module)?.ports.find((found) => found.name === name);
      const values = parameter(module, name)?.values ?? [];
      const entry = name.match(/\[(\d+)\]$/)?.[1];
      if (port) sets.push([name, port.signal]);
      else if (entry || values.length === 1) sets.push([name, flag(values[entry ?? 0])]);
      else values.forEach((value, place) => sets.push([`${name}[${place}]`, flag(value)]));
    }
    return sets;
  };
  const set = (module) => ([name, value]) => ({ edit: "set", module, parameter: name, value: String(value) });
  const edits = [];
  const isNew = (module) => !old.modules.has(module) || lists(old, module) !== lists(now, module);
  for (const module of old.modules.keys()) {
    if (!now.modules.has(module) || isNew(module)) edits.push({ edit: "close", module });
  }
  const kept = new Set(common(old.order.filter((module) => now.modules.has(module) && !isNew(module)), now.order));
  for (const module of now.modules.keys()) {
    if (now.order.includes(module)) continue;
    if (!isNew(module) && old.order.includes(module)) edits.push({ edit: "off", module });
    edits.push(...(isNew(module) ? now.modules.get(module) : changed(module)).map(set(module)));
  }
  // From the last to the first: the module that follows is in its place already.
  for (const [place, module] of [...now.order.entries()].reverse()) {
    const on = { edit: "on", module, before: now.order[place + 1] ?? null };
    if (isNew(module)) {
      edits.push(...now.modules.get(module).map(set(module)), on);
      continue;
    }
    const sets = changed(module), isPlugged = old.order.includes(module);
    const moves = !kept.has(module) || sets.some(([name]) => isStructural(module, name));
    if (moves && isPlugged) edits.push({ edit: "off", module });
    edits.push(...sets.map(set(module)));
    if (moves) edits.push(on);
  }
  return edits;
}

/** Text of a value. */
export const flag = (value) => (value === true ? "ON" : value === false ? "OFF" : value);
