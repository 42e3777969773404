#!/usr/bin/env python3
"""Reference implementation of the two-sided teleoperation loop.

Simulates the wave-variable loop of `loop.py` (equations there) with python-control, checks itself
against a plain loop over the ticks (`tick_loop.py`) and against closed forms (`predictions.py`), and
writes what a simulator has to reproduce:

    FOLDER/<case>.csv         every signal at every tick, 17 significant digits
    FOLDER/cases.json         the parameters of every case, the columns, the hand force
    FOLDER/predictions.json   closed forms, growth rates, spectral radii, passivity and damping bounds

To run (Python 3.11 or later):

    python3 -m venv .venv
    .venv/bin/pip install -r tests/oracle/requirements.txt
    .venv/bin/python tests/oracle/two_sided_loop.py --out target/oracle

Exit status: 0 written, 1 a self-check failed or the folder cannot be written, 2 wrong arguments.
The devices are exact for a force held over the tick (h = 1 ms); positions start at 0 at rest, waves
at 0. The force columns are what each PD commands to its own device in that tick; the desired
position is the one the wave transformer published in that tick.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import asdict, replace
from math import cos, pi
from pathlib import Path
from typing import Any

# Before numpy loads: one thread rounds the same way on every run and leaves the other cores alone.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from check import SelfCheckError, require
from loop import SIGNALS, TICK_S, Loop, Side, build, simulate, spectral_radius
from predictions import all_predictions
from tick_loop import simulate_ticks

TICKS = 10_000
AGREEMENT = 1e-9
COLUMNS = ("tick", "hand_force_n", *SIGNALS)

# A jump at tick 0 that excites every mode, and pulses that cancel: a free device stays in its workspace.
HAND_FORCE = {
    "cosines": [{"amplitude_n": 2.0, "frequency_hz": 1.3}, {"amplitude_n": 0.5, "frequency_hz": 5.7}],
    "pulses": [
        {"force_n": 1.5, "first_tick": 3000, "end_tick": 3250},
        {"force_n": -1.5, "first_tick": 6000, "end_tick": 6250},
    ],
}

# The master's mass includes half a kilogram of hand, its damping the hand's.
MASTER = Side(mass_kg=0.6, device_damping_n_s_per_m=8.0, stiffness_n_per_m=3000.0)
SLAVE = Side(mass_kg=0.5, device_damping_n_s_per_m=8.0, stiffness_n_per_m=5000.0)


def damped(side: Side, pd_damping_n_s_per_m: float) -> Side:
    return replace(side, pd_damping_n_s_per_m=pd_damping_n_s_per_m)


# Name: loop, ticks. Split needs h K/b + 2 D/b <= 15/16. The printed order diverges, so its run is short.
CASES: dict[str, tuple[Loop, int]] = {
    "split_free": (Loop("split", 11, 11, MASTER, SLAVE), TICKS),
    "split_stiff_wall": (Loop("split", 11, 11, MASTER, SLAVE, 1e4), TICKS),
    "split_soft_wall_uneven_delay": (Loop("split", 10, 1, MASTER, SLAVE, 1e3), TICKS),
    "split_damped_free": (Loop("split", 11, 11, damped(MASTER, 1.0), damped(SLAVE, 1.0)), TICKS),
    "split_long_delay_free": (Loop("split", 100, 100, MASTER, SLAVE), TICKS),
    "implicit_stiff_wall": (Loop("implicit", 11, 11, MASTER, SLAVE, 1e4), TICKS),
    "implicit_damped_free": (Loop("implicit", 11, 11, damped(MASTER, 2.0), damped(SLAVE, 2.0)), TICKS),
    "printed_free": (Loop("printed", 11, 11, MASTER, SLAVE), 300),
}


def hand_force(ticks: int) -> NDArray[np.float64]:
    force = np.zeros(ticks)
    for k in range(ticks):
        waves = (c["amplitude_n"] * cos(2 * pi * c["frequency_hz"] * k * TICK_S) for c in HAND_FORCE["cosines"])
        pulses = (p["force_n"] for p in HAND_FORCE["pulses"] if p["first_tick"] <= k < p["end_tick"])
        force[k] = sum(waves) + sum(pulses)
    return force


def run_case(name: str, loop: Loop, ticks: int) -> tuple[NDArray[np.float64], dict[str, Any]]:
    """The table of one case and its entry in cases.json."""
    hand = hand_force(ticks)
    system = build(loop)
    radius = spectral_radius(system)
    require(loop.order == "printed" or radius < 1 + AGREEMENT, f"case {name} is unstable: spectral radius {radius!r}")
    signals = simulate(system, hand)
    disagreement = np.max(np.abs(signals - simulate_ticks(loop, hand)), axis=1) / np.max(np.abs(signals), axis=1)
    worst = int(np.argmax(disagreement))
    require(
        bool(np.all(disagreement <= AGREEMENT)),
        f"case {name}: python-control and the tick loop differ by {disagreement[worst]:.3g} of the peak"
        f" in {SIGNALS[worst]}",
    )
    about = {
        "name": name,
        "file": f"{name}.csv",
        "ticks": ticks,
        **asdict(loop),
        "spectral_radius": radius,
        "self_check_difference": float(disagreement[worst]),
    }
    return np.column_stack((np.arange(ticks), hand, signals.T)), about


def write_json(path: Path, content: dict[str, Any]) -> None:
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_all(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    cases = []
    for number, (name, (loop, ticks)) in enumerate(CASES.items(), start=1):
        table, about = run_case(name, loop, ticks)
        np.savetxt(folder / about["file"], table, fmt="%.17g", delimiter=",", header=",".join(COLUMNS), comments="")
        cases.append(about)
        difference = about["self_check_difference"]
        print(f"case {number}/{len(CASES)} {name}: {ticks} ticks, self-check {difference:.1e}", flush=True)
    write_json(
        folder / "cases.json",
        {"tick_s": TICK_S, "columns": COLUMNS, "hand_force": HAND_FORCE, "cases": cases},
    )
    write_json(folder / "predictions.json", all_predictions())


def main() -> int:
    parser = argparse.ArgumentParser(
        description="Write reference runs of the two-sided wave-variable loop, computed with python-control.",
        epilog="Exit status: 0 written, 1 a self-check failed or the folder cannot be written, 2 wrong arguments.",
    )
    parser.add_argument(
        "--out", metavar="FOLDER", type=Path, required=True, help="folder for the files; made if missing"
    )
    folder: Path = parser.parse_args().out
    try:
        write_all(folder)
    except SelfCheckError as error:
        print(f"self-check failed: {error}\nDo not use the files in {folder}.", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"cannot write to {folder}: {error}\nGive another folder with --out.", file=sys.stderr)
        return 1
    print(f"written to {folder}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
