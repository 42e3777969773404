"""The signal generator: `scipy.signal`'s forms, from the time since it was plugged in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import sawtooth, square

from module_case import Case, times

TICKS = 5000
FREQUENCY_HZ = 1.25
AMPLITUDE, OFFSET = 0.5, 0.25


def cases() -> list[Case]:
    turns = 2 * np.pi * FREQUENCY_HZ * times(TICKS)
    # scipy's triangle begins at its trough, ours halfway up.
    forms = {"SINE": np.sin(turns), "TRIANGLE": sawtooth(turns + np.pi / 2, 0.5)}
    smooth = [form(name, values) for name, values in forms.items()]
    # Half a tick on: where a square wave steps, neither side of it is wrong.
    return [*smooth, form("SQUARE", square(turns + np.pi * FREQUENCY_HZ * 1e-3))]


def form(name: str, values: NDArray[np.float64]) -> Case:
    rows = {"FORM": name, "FREQUENCY": FREQUENCY_HZ, "AMPLITUDE": AMPLITUDE, "OFFSET": OFFSET}
    return Case(
        module="SIGGEN_MOD",
        name=name.lower(),
        oracle="numpy.sin" if name == "SINE" else "scipy.signal",
        rows="\n".join(f"SIGGEN_MOD {parameter} {value}" for parameter, value in rows.items()),
        inputs={},
        expected={"SIGNAL_OUT": OFFSET + AMPLITUDE * values},
    )
