// Exports of the scope: CSV and MCAP with the shown signals, PNG with the plots.

import { post } from "./request.js";

function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  URL.revokeObjectURL(link.href);
}

export function exportCsv({ columns, rows }) {
  const head = ["tick", "time_s (s)", ...columns.map(({ header }) => header)].join(",");
  const lines = rows.map(({ tick, time_s, values }) => [tick, Number(time_s.toPrecision(12)), ...values].join(","));
  download(new Blob([[head, ...lines].join("\n")], { type: "text/csv" }), "scope.csv");
}

export function exportPng(canvas) {
  canvas.toBlob((blob) => download(blob, "scope.png"));
}

/** The server writes the file. NaN is null in JSON. */
export async function exportMcap({ source, columns, rows }, token) {
  const body = JSON.stringify({
    source,
    columns: columns.map(({ name, unit }) => ({ name, unit })),
    rows: rows.map(({ tick, time_s, values }) => [tick, time_s, ...values]),
  });
  download(await (await post("export", body, token)).blob(), "scope.mcap");
}
