"""What works on a signal of any unit, and what makes a position of a velocity: numpy, scipy."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 2000


def cases() -> list[Case]:
    return [weighed_sum(), normalizer(), integrator(), differentiator(), velocity_to_position()]


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
        name="a sine behind a low-pass of 4 ms",
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
