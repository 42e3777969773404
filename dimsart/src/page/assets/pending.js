// The pending scheme of a controller: every edit is checked by the controller's own rules, can be undone, and is applied
// together with the others between two ticks.
//
//   edit ──▶ dry run on the controller ──▶ history ──▶ Apply: one transaction
//                                            ▲ undo, redo

import { between, changes } from "./rows.js";

export class Pending {
  /**
   * `ask(what)` sends an action to the controller; `changed()` is called after every change; `stored` is the key under which a
   * reload of the page finds the pending edits.
   */
  constructor(ask, changed, stored) {
    this.ask = ask;
    this.changed = changed;
    this.stored = stored;
    this.queue = Promise.resolve();
    // The schemes that ran; the last one runs.
    this.applied = [];
    // An entry is a number of edits of an applied scheme, or of `rows`; `tried` is the result of its dry run.
    this.history = [];
    this.at = -1;
    this.refused = "";
    this.isBusy = false;
  }

  get entry() {
    return this.history[this.at];
  }

  get running() {
    return this.applied[this.applied.length - 1];
  }

  /** Result of the dry run; `undefined` if the running scheme is unchanged. */
  get tried() {
    return this.entry && this.isChanged(this.entry) ? this.entry.tried : undefined;
  }

  get canUndo() {
    return this.at > 0;
  }

  get canRedo() {
    return this.at + 1 < this.history.length;
  }

  /** Texts of the differences to the running scheme. */
  get lines() {
    return this.tried ? changes(this.running.modules, this.tried.overview.modules) : [];
  }

  /** Why it cannot be applied; empty if it can. */
  get why() {
    if (this.isBusy) return "checking …";
    if (!this.tried) return "no change";
    const { faults, findings } = this.tried;
    return faults ? `check failed: ${findings.filter(({ is_fault }) => is_fault).map(({ text }) => text).join("; ")}` : "";
  }

  isChanged({ base, rows, edits }) {
    return rows !== undefined || edits.length > 0 || base !== this.running;
  }

  /** Does the edits that `make(modules)` returns for the modules of the pending scheme. */
  edit(make) {
    return this.inTurn(async () => {
      await this.readRunning();
      const { base, rows, edits } = this.entry;
      const made = make((this.tried?.overview ?? this.running).modules);
      if (made.length) await this.push({ base, rows, edits: [...edits, ...made] });
    });
  }

  /** Restores the pending edits after a reload of the page. */
  restore() {
    const text = sessionStorage.getItem(this.stored);
    if (!text) return this.queue;
    return this.inTurn(async () => {
      await this.readRunning();
      await this.push({ base: this.running, ...JSON.parse(text) });
    });
  }

  /** Replaces the pending scheme by rows. */
  open(rows) {
    return this.inTurn(async () => {
      await this.readRunning();
      await this.push({ base: this.running, rows, edits: [] });
    });
  }

  /** Returns to the running scheme; this can be undone. */
  discard() {
    return this.inTurn(async () => {
      if (this.tried) await this.push({ base: this.running, edits: [] });
    });
  }

  /** Goes through the history. */
  go(steps) {
    return this.inTurn(async () => {
      await this.readRunning();
      const entry = this.history[this.at + steps];
      if (!entry) return;
      await this.try(entry);
      this.at += steps;
    });
  }

  /** Applies the pending scheme; returns the controller's answer. */
  apply() {
    return this.inTurn(async () => {
      const done = await this.ask({ do: "transaction", ...this.transaction(this.entry), commit: true });
      const { modules } = this.entry.tried.overview;
      this.applied.push({ rows: await this.ask({ do: "rows" }), modules });
      this.history[this.at] = { base: this.running, edits: [] };
      return done;
    });
  }

  async push(entry) {
    await this.try(entry);
    this.history.length = this.at + 1;
    this.at = this.history.push(entry) - 1;
  }

  /** Checks an entry on the controller. */
  async try(entry) {
    if (!this.isChanged(entry)) return;
    const { refused, ...tried } = await this.ask({ do: "transaction", ...this.transaction(entry), commit: false });
    if (refused) throw new Error(refused);
    entry.tried = tried;
  }

  /** Edits that lead from the running scheme to an entry. */
  transaction({ base, rows, edits }) {
    if (rows !== undefined || base === this.running) return { rows, edits };
    return { edits: [...between(this.running.rows, base.rows, base.modules), ...edits] };
  }

  /** Reads the running scheme, which another client may have changed: the pending edits then apply to the new one. */
  async readRunning() {
    const rows = await this.ask({ do: "rows" });
    if (rows === this.running?.rows) return;
    const { overview: { modules } } = await this.ask({ do: "transaction", edits: [], commit: false });
    const before = this.running;
    this.applied.push({ rows, modules });
    if (!this.entry) this.at = this.history.push({ base: this.running, edits: [] }) - 1;
    else if (this.entry.base === before) this.history[this.at] = { ...this.entry, base: this.running };
  }

  /** Runs one task after another; a failed task changes nothing but `refused`. */
  inTurn(task) {
    const run = async () => {
      Object.assign(this, { isBusy: true, refused: "" });
      this.changed();
      try {
        const done = await task();
        if (this.tried) sessionStorage.setItem(this.stored, JSON.stringify(this.transaction(this.entry)));
        else sessionStorage.removeItem(this.stored);
        return done;
      } catch (error) {
        this.refused = error.message;
        return undefined;
      } finally {
        this.isBusy = false;
        this.changed();
      }
    };
    this.queue = this.queue.then(run);
    return this.queue;
  }
}
