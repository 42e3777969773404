// The button that records the shown station. The server records: closing this page does not end the recording.

import { by } from "./dom.js";

export class Recording {
  /** `record` starts or ends a recording; `say` shows a text. */
  constructor(record, say) {
    this.say = say;
    by("record").onclick = () => record(by("record").getAttribute("aria-pressed") !== "true");
  }

  /** Handles news of a station's recording; every page shows its summary. */
  hear(name, before, now) {
    if (before?.is_running && !now.is_running) this.say(`${name}: recorded: ${now.text}`);
  }

  show(recording) {
    const isRunning = Boolean(recording?.is_running);
    by("record").setAttribute("aria-pressed", isRunning);
    const lost = recording?.lost ? `, ${recording.lost} lost` : "";
    by("recorded").textContent = isRunning ? `${recording.rows} rows${lost}` : "";
    by("recorded").title = recording?.text ?? recording?.path ?? "";
    by("recorded-note").textContent = recording?.text ? `Recorded: ${recording.text}` : "";
  }
}
