"""Format of a case that compares a library module with another implementation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

TICK_S = 1e-3
TOLERANCE = 1e-5


@dataclass
class Case:
    """One run of a scheme, tick by tick, and what an oracle says of it.

    A signal is an array of ticks, or of ticks x axes. Inputs are rounded to `f32`, which is what the module gets, before
    the oracle sees them: use `rounded`.
    """

    module: str
    """Name of the kind, `PIDCTRL_MOD`."""
    name: str
    """What is compared: `a step through all of its limits`."""
    oracle: str
    """What says what is right: `scipy.signal.lfilter`, `mujoco`, `closed form`."""
    rows: str
    """The scheme, `MODULE COMMAND VALUE` a line; `MOD_ENG MOD_ON module` for those that none names, and the matching
    check at the end, are added."""
    inputs: dict[str, NDArray[np.float64]]
    """What the device measures: data type to signal."""
    expected: dict[str, NDArray[np.float64]]
    """Expected data base after each tick: values by signal, `NAME` or `NAME.2`."""
    tolerance: float = TOLERANCE
    """Largest error, as a share of the largest magnitude that is expected of the signal."""
    why: str = ""
    """Why the tolerance is not 1e-5."""
    axis: str = "rotary"
    """`rotary` or `linear`."""
    period_s: float = TICK_S
    first_tick: int = 0
    """The first tick that is compared."""
    commands: dict[int, str] = field(default_factory=dict)
    """Rows that are given before a tick, for what changes on the way."""

    def as_json(self) -> dict[str, Any]:
        if self.tolerance > TOLERANCE and not self.why:
            raise ValueError(f"{self.module}, {self.name}: give a reason for the tolerance of {self.tolerance}")
        return {
            "module": self.module,
            "name": self.name,
            "oracle": self.oracle,
            "rows": self.rows,
            "inputs": {name: columns(values) for name, values in self.inputs.items()},
            "expected": {name: columns(values) for name, values in self.expected.items()},
            "tolerance": self.tolerance,
            "why": self.why,
            "axis": self.axis,
            "period_s": self.period_s,
            "first_tick": self.first_tick,
            "commands": [{"tick": tick, "rows": rows} for tick, rows in sorted(self.commands.items())],
        }


def rounded(values: ArrayLike) -> NDArray[np.float64]:
    """As a module gets them."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def columns(values: ArrayLike) -> list[list[float]]:
    """Ticks x axes."""
    array = np.asarray(values, dtype=np.float64)
    if not np.all(np.isfinite(array)):
        raise ValueError("an oracle's signal is not finite")
    return (array if array.ndim == 2 else array[:, None]).tolist()


def times(ticks: int, period_s: float = TICK_S) -> NDArray[np.float64]:
    """Of each tick, from 0, s."""
    return np.arange(ticks) * period_s


def noise(ticks: int, axes: int = 1, seed: int = 1, amplitude: float = 1.0) -> NDArray[np.float64]:
    """Evenly between the amplitudes, as a module gets it."""
    values = np.random.default_rng(seed).uniform(-amplitude, amplitude, (ticks, axes))
    return rounded(values if axes > 1 else values[:, 0])
