"""Moves and signals that excite: `scipy.interpolate` with the times of their segments, and `scipy.signal`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BPoly, CubicSpline, PPoly
from scipy.signal import chirp, max_len_seq

from module_case import TICK_S, Case, rounded, times

TICKS = 3000
PERIOD_S = float(np.float32(TICK_S))
SIGNALS = ("DES_POSITION", "DES_VELOCITY", "DES_ACCELERATION")


def cases() -> list[Case]:
    return [
        trapezoid("TARGET 0.8\nVELOCITY_LIMIT 0.5\nACCELERATION_LIMIT 2", 0.3, [2, 0, -2], [0.25, 0.75, 0.25]),
        trapezoid("TARGET -0.1\nVELOCITY_LIMIT 5\nACCELERATION_LIMIT 4", 0.3, [-4, 4], [0.4**0.5 / 2] * 2),
        turning_back(),
        synchronised(),
        s_curve(),
        s_curve_of_one_jerk(),
        minimum_jerk(),
        via_points(),
        *sweeps(),
        multisine(),
        *binary_noise(),
    ]


def rows(module: str, parameters: str) -> str:
    return "\n".join(f"{module} {row}" for row in parameters.split("\n"))


def pieces(highest: list[float], durations_s: list[float], start: list[float]) -> list[PPoly]:
    """Position and its derivatives, of which the highest one is constant in each piece. `start`: position, velocity, …"""
    ends = np.r_[0.0, np.cumsum(durations_s), 100.0]
    path = PPoly(np.r_[highest, 0.0][None, :], ends)
    derivatives = [path]
    for value in reversed(start):
        path = path.antiderivative()
        path.c[-1] += value
        derivatives.append(path)
    return derivatives[::-1]


def move(module: str, name: str, parameters: str, start: float, path: list[PPoly], count: int = 3) -> Case:
    time = times(TICKS, PERIOD_S)
    return Case(
        module=module,
        name=name,
        oracle="scipy.interpolate.PPoly",
        rows=rows(module, parameters),
        inputs={"POSITION": np.full(TICKS, rounded(start))},
        expected={signal: x(time) for signal, x in list(zip(SIGNALS, path))[:count]},
    )


def trapezoid(parameters: str, start: float, acceleration: list[float], durations_s: list[float]) -> Case:
    name = "up to its velocity" if len(acceleration) == 3 else "too near for its velocity, backwards"
    start = float(rounded(start))
    if len(acceleration) == 3:
        # The start is not 0.3 to the last digit.
        durations_s[1] = (0.8 - start - 0.125) / 0.5
    else:
        durations_s = [np.sqrt((start + float(np.float32(0.1))) / 4)] * 2
    path = pieces(acceleration, durations_s, [start, 0.0])
    # The acceleration jumps within a tick, where there is a mean.
    return move("TRAPEZOID_MOD", name, parameters, start, path, count=2)


def turning_back() -> Case:
    """To 0.5, and after 0.4 s, at 0.8 m/s, to -0.5: it brakes for 0.4 s, at 0.32, and is 0.82 away."""
    speeding_s = np.sqrt(0.82 / 2)
    path = pieces([2, -2, 2], [0.4, 0.4 + speeding_s, speeding_s], [0.0, 0.0])
    case = move(
        "TRAPEZOID_MOD",
        "a target that changes on the way",
        "TARGET 0.5\nVELOCITY_LIMIT 5\nACCELERATION_LIMIT 2",
        0.0,
        path,
        count=2,
    )
    case.commands = {400: "TRAPEZOID_MOD TARGET -0.5"}
    return case


def synchronised() -> Case:
    """The first axis takes longest: 1 m with 0.5 m/s and 2 m/s²; the others go shares of its way."""
    [path, velocity, _] = pieces([2, 0, -2], [0.25, 1.75, 0.25], [0.0, 0.0])
    time, shares = times(TICKS, PERIOD_S), np.array([1.0, -0.4, 0.0])
    return Case(
        module="TRAPEZOID_MOD",
        name="three axes on a line",
        oracle="scipy.interpolate.PPoly",
        rows=rows(
            "TRAPEZOID_MOD",
            "SYNCHRONISED ON\nTARGET[0] 1\nTARGET[1] -0.4\nVELOCITY_LIMIT 0.5\nACCELERATION_LIMIT 2",
        ),
        inputs={"POSITION": np.zeros((TICKS, 3))},
        expected={
            "DES_POSITION": path(time)[:, None] * shares,
            "DES_VELOCITY": velocity(time)[:, None] * shares,
        },
    )


def s_curve() -> Case:
    """All seven segments: T_j = 0.2 s, T_a = 0.45 s, and what is left at 1 m/s."""
    way = 1.2
    jerk = [20, 0, -20, 0, -20, 0, 20]
    durations_s = [0.2, 0.05, 0.2, way - 0.45, 0.2, 0.05, 0.2]
    path = pieces(jerk, durations_s, [0.0, 0.0, 0.0])
    parameters = f"TARGET {way}\nVELOCITY_LIMIT 1\nACCELERATION_LIMIT 4\nJERK_LIMIT 20"
    case = move("SCURVE_MOD", "all seven segments", parameters, 0.0, path)
    return case


def s_curve_of_one_jerk() -> Case:
    """So near that it has no constant acceleration."""
    segment_s = np.cbrt(0.3 / (2 * 100))
    path = pieces([-100, 100, -100], [segment_s, 2 * segment_s, segment_s], [0.3, 0.0, 0.0])
    parameters = "TARGET 0\nVELOCITY_LIMIT 9\nACCELERATION_LIMIT 90\nJERK_LIMIT 100"
    return move("SCURVE_MOD", "jerk only, backwards", parameters, 0.3, path)


def minimum_jerk() -> Case:
    """From 0.2 to 1.5; after 1 s from there to -0.5, in 2 s again."""
    time = times(TICKS + 1000, PERIOD_S)
    start = float(rounded(0.2))
    first = BPoly.from_derivatives([0, 2], [[start, 0, 0], [1.5, 0, 0]])
    there = [first(1000 * PERIOD_S, nu) for nu in range(3)]
    second = BPoly.from_derivatives([0, 2, 100], [there, [-0.5, 0, 0], [-0.5, 0, 0]])
    since = time - 1000 * PERIOD_S
    return Case(
        module="MINJERK_MOD",
        name="a target that changes on the way",
        oracle="scipy.interpolate.BPoly",
        rows="MINJERK_MOD TARGET 1.5\nMINJERK_MOD DURATION 2",
        inputs={"POSITION": np.full(time.size, start)},
        expected={
            signal: np.where(since < 0, first(time, nu), second(np.maximum(since, 0), nu))
            for nu, signal in enumerate(SIGNALS)
        },
        commands={1000: "MINJERK_MOD TARGET -0.5"},
    )


def via_points() -> Case:
    """Two axes, five points."""
    time = times(TICKS, PERIOD_S)
    start = rounded([0.1, -0.2])
    points = rounded([[0.5, 0.4, -0.3, 0.0, 1.0], [1.0, 0.0, 1.0, 0.0, 0.5]])
    steps_s = [0.5, 0.25, 0.75, 0.3, 0.6]
    spline = CubicSpline(np.r_[0.0, np.cumsum(steps_s)], np.vstack([start, points.T]), bc_type="clamped")
    end_s = float(np.sum(steps_s))
    is_over = (time >= end_s)[:, None]
    parameters = [f"POINTS[{axis}][{place}] {x}" for axis, row in enumerate(points) for place, x in enumerate(row)]
    parameters += [f"TIMES[0][{place}] {step_s}" for place, step_s in enumerate(steps_s)]
    ends = [points[:, -1], 0.0, 0.0]
    return Case(
        module="VIA_MOD",
        name="five points of two axes",
        oracle="scipy.interpolate.CubicSpline",
        rows=rows("VIA_MOD", "\n".join([*parameters, "COUNT 5"])),
        inputs={"POSITION": np.tile(start, (TICKS, 1))},
        expected={
            signal: np.where(is_over, ends[nu], spline(np.minimum(time, end_s), nu))
            for nu, signal in enumerate(SIGNALS)
        },
    )


def sweeps() -> list[Case]:
    time = times(4000, PERIOD_S)
    return [
        Case(
            module="CHIRP_MOD",
            name=f"{sweep.lower()}, 0.5 to 20 Hz",
            oracle="scipy.signal.chirp",
            rows=rows("CHIRP_MOD", f"FROM 0.5\nTO 20\nDURATION 5\nSWEEP {sweep}\nAMPLITUDE 2\nOFFSET 0.5"),
            inputs={"POSITION": np.zeros(time.size)},
            expected={"SIGNAL_OUT": 0.5 + 2 * chirp(time, 0.5, 5, 20, method=sweep.lower(), phi=-90)},
        )
        for sweep in ("LINEAR", "LOGARITHMIC")
    ]


def multisine() -> Case:
    time, tones = times(4000, PERIOD_S), np.arange(1, 13)
    phases = -np.pi * tones * (tones - 1) / tones.size
    waves = np.cos(2 * np.pi * 1.5 * time[:, None] * tones + phases)
    return Case(
        module="MULTISINE_MOD",
        name="twelve tones",
        oracle="numpy",
        rows=rows("MULTISINE_MOD", "FREQUENCY 1.5\nTONES 12\nAMPLITUDE 0.5\nOFFSET -1"),
        inputs={"POSITION": np.zeros(time.size)},
        expected={"SIGNAL_OUT": -1 + 0.5 * waves.sum(axis=1)},
        tolerance=2e-5,
        why="periods per tick are rounded to f32, and the last tone has completed 72",
    )


def binary_noise() -> list[Case]:
    return [sequence(bits) for bits in range(2, 17)]


def sequence(bits: int) -> Case:
    ticks = 3000
    bit: NDArray[np.int8] = max_len_seq(bits, length=ticks // 2)[0]
    return Case(
        module="PRBS_MOD",
        name=f"{bits} bits",
        oracle="scipy.signal.max_len_seq",
        rows=rows("PRBS_MOD", f"BITS {bits}\nEVERY 2\nAMPLITUDE 3\nOFFSET 1"),
        inputs={"POSITION": np.zeros(ticks)},
        expected={"SIGNAL_OUT": 1 + 3 * (2.0 * np.repeat(bit, 2) - 1)},
    )
