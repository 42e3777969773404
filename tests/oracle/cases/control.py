"""P, PD, PID and the wall: `scipy.signal.lfilter` with their difference equations, and a spring with numpy."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 2000


def cases() -> list[Case]:
    return [proportional(), proportional_derivative(), pid(), wall()]


def proportional() -> Case:
    position, desired = noise(TICKS, 3, seed=1), noise(TICKS, 3, seed=2)
    gains = np.array([3000.0, 3000.0, 50.0])
    return Case(
        module="PCTRL_MOD",
        name="three axes, one with a gain of its own",
        oracle="numpy",
        rows="PCTRL_MOD K_PARAM 3000\nPCTRL_MOD K_PARAM[2] 50",
        inputs={"POSITION": position, "DES_POSITION": desired},
        expected={"DES_FORCE": gains * (desired - position)},
    )


def proportional_derivative() -> Case:
    position, desired = noise(TICKS, seed=3, amplitude=0.01), noise(TICKS, seed=4, amplitude=0.01)
    error = desired - position
    stiffness, damping = 300.0, 4.0
    force = lfilter([stiffness + damping / TICK_S, -damping / TICK_S], [1.0], error)
    force[0] = stiffness * error[0]
    return Case(
        module="PDCTRL_MOD",
        name="noise",
        oracle="scipy.signal.lfilter",
        rows="PDCTRL_MOD K_PARAM 300\nPDCTRL_MOD D_PARAM 4",
        inputs={"POSITION": position, "DES_POSITION": desired},
        expected={"DES_FORCE": force},
    )


def pid() -> Case:
    time = times(TICKS)
    desired = rounded(0.2 * np.sin(2 * np.pi * 1.5 * time))
    position = np.zeros(TICKS)
    stiffness, integral, damping, filter_s = 20.0, 50.0, 2.0, 0.01
    # I and D of the error that begins with what it is.
    share = TICK_S / (TICK_S + filter_s)
    slope = np.diff(desired, prepend=desired[0]) / TICK_S
    slow = lfilter([share], [1.0, share - 1.0], slope)
    force = stiffness * desired + integral * TICK_S * np.cumsum(desired) + damping * slow
    return Case(
        module="PIDCTRL_MOD",
        name="a sine",
        oracle="scipy.signal.lfilter, numpy.cumsum",
        rows="PIDCTRL_MOD K_PARAM 20\nPIDCTRL_MOD I_PARAM 50\nPIDCTRL_MOD D_PARAM 2\nPIDCTRL_MOD FILTER_TIME 0.01",
        inputs={"POSITION": position, "DES_POSITION": desired},
        expected={"DES_FORCE": force},
    )


def wall() -> Case:
    """In, on and out again: the damper acts inside alone, and the wall never pulls."""
    position = rounded(0.02 * np.sin(2 * np.pi * 4 * times(TICKS)) + noise(TICKS, seed=5, amplitude=1e-5))
    depth = -0.005 - position
    velocity = -np.diff(position, prepend=position[0]) / TICK_S
    push = np.maximum(2000 * depth + 15 * velocity, 0)
    return Case(
        module="VWALL_MOD",
        name="below, touched again and again",
        oracle="numpy.maximum, numpy.diff",
        rows="""VWALL_MOD WALL_POSITION -0.005
VWALL_MOD K_PARAM 2000
VWALL_MOD B_PARAM 15
VWALL_MOD SIDE BELOW""",
        inputs={"POSITION": position},
        expected={"DES_FORCE": np.where(depth > 0, push, 0)},
    )
