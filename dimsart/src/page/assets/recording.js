// The button that records the station that is shown. The recording is the server's: it goes on without this page.

const by = (id) => document.getElementById(id);

export class Recording {
  /** `record` begins or ends it; `say` shows a text. */
  constructor(record, say) {
    this.say = say;
    by("record").onclick = () => record(by("record").getAttribute("aria-pressed") !== "true");
  }

  /** What a station's recording has become; how it ended is said on every page. */
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
