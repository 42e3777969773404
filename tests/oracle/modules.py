#!/usr/bin/env python3
"""Writes every case of `cases/`: the library modules' expected results from other implementations.

    FOLDER/modules.json    see `module_case.py`

To run (Python 3.11 or later), after `pip install -r requirements.txt`:

    python tests/oracle/modules.py --out target/oracle

Then `tests/modules.rs` runs them. A module's cases are in `cases/`, a file for each group or module; whatever is there is
found, and its `cases()` is asked.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

# Before numpy loads: one thread rounds the same way on every run and leaves the other cores alone.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> int:
    parser = argparse.ArgumentParser(description="Writes the cases of the modules.")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    out = parser.parse_args().out
    here = Path(__file__).parent
    found = [
        case.as_json()
        for file in sorted((here / "cases").glob("*.py"))
        for case in importlib.import_module(f"cases.{file.stem}").cases()
    ]
    out.mkdir(parents=True, exist_ok=True)
    (out / "modules.json").write_text(json.dumps(found))
    print(f"{len(found)} cases of {len({case['module'] for case in found})} modules")
    return 0


if __name__ == "__main__":
    sys.exit(main())
