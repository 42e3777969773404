#!/usr/bin/env python3
"""Writes a page with the comparisons of the tests with other implementations: a table and plots.

    python tests/oracle/report.py --found target/oracle/found --out target/oracle-report

The tests write the rows (`tests/oracle/evidence.rs`); `cargo xtask step oracle` runs everything.
"""

from __future__ import annotations

import argparse
import html
import json
import re
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PACKAGES = ("numpy", "scipy", "control", "mujoco")
STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:76rem;margin:2rem auto;padding:0 1rem;color:#1f252b}
table{border-collapse:collapse;width:100%;font-size:14px}td,th{padding:.3rem .6rem;border-bottom:1px solid #e3e7eb;
text-align:left;vertical-align:top}td.n{text-align:right;font-variant-numeric:tabular-nums}tr.wrong{background:#fde8e0}
figure{display:inline-block;margin:1rem 1rem 0 0}figcaption{font-size:13px;max-width:36rem}img{width:36rem}"""


def main() -> int:
    parser = argparse.ArgumentParser(description="Write a page with the comparisons.")
    parser.add_argument("--found", type=Path, required=True, help="folder of the tests' rows")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    arguments = parser.parse_args()
    files = sorted(arguments.found.glob("*.json"))
    rows = [row for file in files for row in json.loads(file.read_text())]
    if not rows:
        print(f"no rows in {arguments.found}: run the tests first", file=sys.stderr)
        return 1
    pictures = arguments.out / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    for place, row in enumerate(rows):
        row["picture"] = draw(row, pictures / f"{place:03}-{slug(row['subject'])}.png")
    (arguments.out / "index.html").write_text(page(rows))
    print(table(rows))
    wrong = sum(not is_right(row) for row in rows)
    print(f"{len(rows)} comparisons, {wrong} exceed their tolerance: {arguments.out / 'index.html'}")
    return 1 if wrong else 0


def is_right(row: dict[str, Any]) -> bool:
    return row["largest_error"] is not None and row["largest_error"] <= row["tolerance"]


def slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def figures(row: dict[str, Any]) -> tuple[str, str, str]:
    error = row["largest_error"]
    return str(row["samples"]), "NaN" if error is None else f"{error:.1e}", f"{row['tolerance']:.0e}"


def table(rows: list[dict[str, Any]]) -> str:
    """Returns a text table with a row for each comparison."""
    head = ("Subject", "Quantity", "Reference", "Samples", "Max. error", "Tolerance")
    body = [(row["subject"], row["name"], row["oracle"], *figures(row)) for row in rows]
    widths = [max(len(line[place]) for line in [head, *body]) for place in range(len(head))]
    lines = ["  ".join(word.ljust(width) for word, width in zip(line, widths)).rstrip() for line in [head, *body]]
    return "\n".join(lines)


def draw(row: dict[str, Any], path: Path) -> str | None:
    curve = row["curve"]
    if curve is None:
        return None
    figure, axes = plt.subplots(figsize=(7.2, 2.6), layout="constrained")
    axes.plot(curve["time_s"], curve["expected"], color="#f0a868", linewidth=3.5, label=row["oracle"])
    axes.plot(curve["time_s"], curve["found"], color="#006daa", linewidth=1.0, label=row["subject"])
    axes.set_xlabel(row.get("axis_label") or "time (s)", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(color="#e3e7eb")
    axes.legend(fontsize=8, loc="best")
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return f"pictures/{path.name}"


def page(rows: list[dict[str, Any]]) -> str:
    def cells(row: dict[str, Any]) -> str:
        name = html.escape(row["name"]) + (f"<br><small>{html.escape(row['why'])}</small>" if row["why"] else "")
        words = f"<td>{html.escape(row['subject'])}<td>{name}<td>{html.escape(row['oracle'])}"
        numbers = "".join(f'<td class="n">{figure}' for figure in figures(row))
        return f'<tr class="{"" if is_right(row) else "wrong"}">{words}{numbers}'

    def picture(row: dict[str, Any]) -> str:
        caption = html.escape(f"{row['subject']}: {row['name']} ({row['oracle']})")
        return f'<figure><img loading="lazy" src="{row["picture"]}" alt=""><figcaption>{caption}</figcaption></figure>'

    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    body = "\n".join(cells(row) for row in rows)
    images = "\n".join(picture(row) for row in rows if row["picture"])
    return f"""<!doctype html><html lang="en"><meta charset="utf-8"><title>DIMSART compared with other implementations</title>
<style>{STYLE}</style><h1>DIMSART compared with other implementations</h1>
<p>Every module and plant, computed by the controller (f32) or the simulator (f64), is compared with {packages} or a
closed form in double precision. Errors are relative to the signal's maximum magnitude.</p>
<table><tr><th>Subject<th>Quantity<th>Reference<th>Samples<th>Max. error<th>Tolerance
{body}</table><h2>Curves</h2>{images}</html>
"""


if __name__ == "__main__":
    sys.exit(main())
