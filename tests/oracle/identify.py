#!/usr/bin/env python3
"""Reference implementation of identification: scipy's frequency response and numpy's least squares.

    FOLDER/identify.json   signals, the response that scipy finds of them; a joint with its motion in closed form

To run, as `two_sided_loop.py`:

    .venv/bin/python tests/oracle/identify.py --out target/oracle

The joint is not simulated: its position is a sum of sines, whose derivatives are known, and the force is what the equation of
motion then asks for. So nothing here integrates, and what is estimated has one right value.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from scipy.signal import coherence, csd, lfilter, max_len_seq, welch

from check import SelfCheckError, require_close

TICK_S = 1e-3
SEGMENT = 1024
TRUTH = {"inertia": 0.12, "viscous": 0.4, "coulomb": 0.25, "weight_sine": 1.8, "weight_cosine": -0.6, "constant": 0.15}


def response() -> dict[str, object]:
    """A resonance with noise behind a PRBS, so that the coherence is not 1 everywhere."""
    bits, _ = max_len_seq(14, length=16384)
    force = np.repeat(2.0 * bits - 1.0, 2)[:16384]
    position = lfilter([0.0, 0.01, 0.008], [1.0, -1.9, 0.93], force) + 0.05 * np.random.default_rng(3).normal(size=len(force))
    settings = {"fs": 1 / TICK_S, "window": "hann", "nperseg": SEGMENT}
    frequency, power = welch(force, **settings)
    _, cross = csd(force, position, **settings)
    _, coherent = coherence(force, position, **settings)
    found = cross / power
    return {
        "segment": SEGMENT, "input": force.tolist(), "output": position.tolist(), "frequency_hz": frequency.tolist(),
        "real": found.real.tolist(), "imaginary": found.imag.tolist(), "coherence": coherent.tolist(),
    }


def joint() -> dict[str, object]:
    time = np.arange(20000) * TICK_S
    waves = [(0.9, 2.1, 0.0), (0.5, 4.7, 1.0), (0.12, 11.3, 2.0)]
    position = sum(a * np.sin(w * time + p) for a, w, p in waves)
    speed = sum(a * w * np.cos(w * time + p) for a, w, p in waves)
    acceleration = sum(-a * w * w * np.sin(w * time + p) for a, w, p in waves)
    columns = np.stack([acceleration, speed, np.sign(speed), np.sin(position), np.cos(position), np.ones_like(time)], 1)
    force = columns @ np.array(list(TRUTH.values()))
    found, *_ = np.linalg.lstsq(columns, force, rcond=None)
    for value, (name, truth) in zip(found, TRUTH.items()):
        require_close(name, value, truth, 1e-9)
    return {"position": position.tolist(), "force": force.tolist(), "truth": list(TRUTH.values())}


def main() -> int:
    parser = argparse.ArgumentParser(description="What identification has to find.")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    folder: Path = parser.parse_args().out
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "identify.json").write_text(json.dumps({"tick_s": TICK_S, "response": response(), "joint": joint()}))
    except (SelfCheckError, OSError) as error:
        print(f"identify.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
