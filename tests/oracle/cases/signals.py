"""What works on a signal of any unit, the signal generator, and what makes a position of a velocity: numpy, scipy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter, sawtooth, square

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 2000
# Of the generator.
GENERATED_TICKS = 5000
FREQUENCY_HZ = 1.25
AMPLITUDE, OFFSET = 0.5, 0.25


def cases() -> list[Case]:
    laws = [weighed_sum(), normalizer(), integrator(), differentiator(), velocity_to_position()]
    return laws + generated()


def weighed_sum() -> Case:
    force, line_force = noise(TICKS, 2, seed=20, amplitude=50), noise(TICKS, 2, seed=21, amplitude=50)
    return Case(
        module="SUM_MOD",
        name="two forces, a gain of one axis",
        oracle="numpy",
        rows="SUM_MOD PORT_A FORCE\nSUM_MOD PORT_B LINE_FORCE\nSUM_MOD A_GAIN 2\nSUM_MOD B_GAIN[1] -0.5",
        inputs={"FORCE": force, "LINE_FORCE": line_force},
        expected={"SIGNAL_OUT": 2 * force + np.array([1.0, -0.5]) * line_force},
    )


def normalizer() -> Case:
    x = noise(TICKS, seed=22, amplitude=3)
    return Case(
        module="NORMALIZER_MOD",
        name="scaled, shifted and cut",
        oracle="numpy.clip",
        rows="NORMALIZER_MOD SCALE -40\nNORMALIZER_MOD OFFSET 0.25\nNORMALIZER_MOD LIMIT 90",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": np.clip(-40 * (x - 0.25), -90, 90)},
    )


def integrator() -> Case:
    x = rounded(0.3 + noise(TICKS, seed=23))
    # Before the first tick there was nothing.
    return Case(
        module="INTEGRATOR_MOD",
        name="noise with a mean",
        oracle="scipy.integrate.cumulative_trapezoid",
        rows="",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": cumulative_trapezoid(np.r_[0.0, x], dx=TICK_S)},
    )


def differentiator() -> Case:
    x = rounded(np.sin(2 * np.pi * 3 * times(TICKS)))
    share = TICK_S / (TICK_S + 0.004)
    slope = np.diff(x, prepend=x[0]) / TICK_S
    return Case(
        module="DIFFERENTIATOR_MOD",
        name="a sine after a low-pass of 4 ms",
        oracle="numpy.diff, scipy.signal.lfilter",
        rows="DIFFERENTIATOR_MOD FILTER_TIME 0.004",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": lfilter([share], [1.0, share - 1.0], slope)},
    )


def velocity_to_position() -> Case:
    velocity = rounded(0.2 + noise(TICKS, seed=24))
    position = rounded(1.5 + noise(TICKS, seed=25, amplitude=0.5))
    return Case(
        module="VEL2POS_MOD",
        name="noise, from where the joint stands",
        oracle="numpy.cumsum",
        rows="",
        inputs={"POSITION": position, "DES_VELOCITY": velocity},
        expected={"DES_POSITION": position[0] + TICK_S * np.cumsum(velocity)},
    )


def generated() -> list[Case]:
    """The forms of scipy, from the time since the generator was plugged in."""
    turns = 2 * np.pi * FREQUENCY_HZ * times(GENERATED_TICKS)
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
