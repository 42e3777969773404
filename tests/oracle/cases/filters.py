"""Filters and observers of velocity: scipy.signal, and Riccati's equation by scipy.linalg."""

from __future__ import annotations

import control
import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.linalg import solve_discrete_are

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 2000
RATE_HZ = 1 / TICK_S

Signal = NDArray[np.float64]


def cases() -> list[Case]:
    return [
        low_pass_first(),
        low_pass_slow(),
        low_pass_second(0.5**0.5, 40.0),
        low_pass_second(0.2, 0.5),
        notch(60.0, 5.0),
        notch(3.0, 30.0),
        biquad("a low-pass of eight poles", signal.ellip(8, 0.5, 60, 90, fs=RATE_HZ, output="sos")),
        biquad("a band-pass of four poles", signal.butter(2, [30, 80], "bandpass", fs=RATE_HZ, output="sos")),
        moving_average(),
        tracking(),
        difference(),
        alpha_beta(),
        kalman_velocity(),
        kalman_acceleration(),
    ]


def filtered(module: str, name: str, oracle: str, rows: str, sos: Signal, x: Signal) -> Case:
    """A filter that begins with its input at rest."""
    rest = signal.sosfilt_zi(sos) * x[0]
    return Case(
        module=module,
        name=name,
        oracle=oracle,
        rows=rows,
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": signal.sosfilt(sos, x, zi=rest)[0]},
    )


def low_pass_first() -> Case:
    numerator, denominator, _ = signal.cont2discrete(([1.0], [1 / (2 * np.pi * 20), 1.0]), TICK_S, "zoh")
    x = 1 + noise(TICKS, seed=10)
    # What comes in a tick is in its output, not in that of the next one.
    expected, _ = signal.lfilter(numerator[0][1:], denominator, x, zi=[-denominator[1] * x[0]])
    return Case(
        module="LOWPASS_MOD",
        name="first order, noise",
        oracle="scipy.signal.cont2discrete, lfilter",
        rows="LOWPASS_MOD FREQUENCY 20",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": expected},
    )


def low_pass_slow() -> Case:
    pole = np.exp(-2 * np.pi * float(np.float32(0.01)) * TICK_S)
    x = np.ones(20_000)
    x[0] = 0.0
    return Case(
        module="LOWPASS_MOD",
        name="first order, 0.01 Hz, a step",
        oracle="scipy.signal.lfilter",
        rows="LOWPASS_MOD FREQUENCY 0.01",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": signal.lfilter([1 - pole], [1, -pole], x)},
    )


def low_pass_second(damping: float, frequency_hz: float) -> Case:
    warped = 2 * RATE_HZ * np.tan(np.pi * frequency_hz * TICK_S)
    sos = signal.tf2sos(
        *signal.bilinear([warped**2], [1.0, 2 * damping * warped, warped**2], fs=RATE_HZ)
    )
    x = rounded(np.where(times(TICKS) < 0.1, 1.0, 2.0) + noise(TICKS, seed=11, amplitude=0.1))
    return filtered(
        "LOWPASS_MOD",
        f"second order, {frequency_hz:g} Hz, damping {damping:.2g}",
        "scipy.signal.bilinear, sosfilt",
        f"LOWPASS_MOD ORDER SECOND\nLOWPASS_MOD FREQUENCY {frequency_hz}\nLOWPASS_MOD DAMPING {damping}",
        sos,
        x,
    )


def notch(frequency_hz: float, quality: float) -> Case:
    sos = signal.tf2sos(*signal.iirnotch(frequency_hz, quality, fs=RATE_HZ))
    sine = np.sin(2 * np.pi * frequency_hz * times(TICKS))
    return filtered(
        "NOTCH_MOD",
        f"{frequency_hz:g} Hz, quality {quality:g}",
        "scipy.signal.iirnotch, sosfilt",
        f"NOTCH_MOD FREQUENCY {frequency_hz}\nNOTCH_MOD QUALITY {quality}",
        sos,
        rounded(0.5 + sine + noise(TICKS, seed=12, amplitude=0.2)),
    )


def biquad(name: str, sos: Signal) -> Case:
    sos = rounded(sos)
    rows = [
        f"BIQUAD_MOD SOS[{section}][{place}] {value:.9g}"
        for section, row in enumerate(sos)
        for place, value in enumerate(row)
    ]
    x = rounded(1 + noise(TICKS, seed=13))
    return filtered("BIQUAD_MOD", name, "scipy.signal.sosfilt, sosfilt_zi", "\n".join(rows), sos, x)


def moving_average() -> Case:
    window, x = 37, rounded(3 + noise(TICKS, 2, seed=14))
    there = np.minimum(np.arange(TICKS) + 1, window)[:, None]
    return Case(
        module="MOVING_AVERAGE_MOD",
        name="37 ticks, two axes",
        oracle="scipy.signal.lfilter",
        rows=f"MOVING_AVERAGE_MOD WINDOW {window}",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": signal.lfilter(np.ones(window), [1.0], x, axis=0) / there},
    )


def measured(seed: int) -> Signal:
    """A joint that swings, by an encoder of 2¹⁶ steps a turn."""
    time = times(TICKS)
    angle = 0.4 * np.sin(2 * np.pi * 1.3 * time) + noise(TICKS, seed=seed, amplitude=1e-5)
    step = 2 * np.pi / 2**16
    return rounded(step * np.round(angle / step))


def observed(model: Signal, gain: Signal, position: Signal) -> Signal:
    """Estimates of each tick of an observer `s = A s + L (x - C A s)` that begins at the position, at rest."""
    order = len(model)
    first = np.eye(order)[0]
    closed = model - np.outer(gain, first @ model)
    states = np.zeros((len(position), order))
    state = first * position[0]
    for tick, x in enumerate(position):
        state = closed @ state + gain * x
        states[tick] = state
    return states


def tracking() -> Case:
    position = measured(15)
    pole = np.exp(-2 * np.pi * 30 * TICK_S)
    model = np.array([[1.0, TICK_S], [0.0, 1.0]])
    gain = np.asarray(control.acker(model.T, (np.array([[1.0, 0.0]]) @ model).T, [pole, pole])).ravel()
    return Case(
        module="VELOCITY_OBSERVER_MOD",
        name="a tracking loop of 30 Hz after an encoder",
        oracle="control.acker",
        rows="VELOCITY_OBSERVER_MOD FREQUENCY 30",
        inputs={"POSITION": position},
        expected={"VELOCITY": observed(model, gain, position)[:, 1]},
    )


def difference() -> Case:
    position = measured(16)
    pole = np.exp(-2 * np.pi * 80 * TICK_S)
    slope = np.diff(position, prepend=position[0]) / TICK_S
    return Case(
        module="VELOCITY_OBSERVER_MOD",
        name="a difference after a low-pass of 80 Hz",
        oracle="numpy.diff, scipy.signal.lfilter",
        rows="VELOCITY_OBSERVER_MOD METHOD DIFFERENCE\nVELOCITY_OBSERVER_MOD FREQUENCY 80",
        inputs={"POSITION": position},
        expected={"VELOCITY": signal.lfilter([1 - pole], [1, -pole], slope)},
    )


def alpha_beta() -> Case:
    position = measured(17)
    alpha, beta = 0.2, 0.02
    rate = beta / TICK_S
    # From measured position to velocity (Brookner, section 1.2).
    velocity = signal.lfilter([rate, -rate], [1, alpha + beta - 2, 1 - alpha], position - position[0])
    return Case(
        module="VELOCITY_OBSERVER_MOD",
        name="an alpha-beta filter",
        oracle="scipy.signal.lfilter",
        rows="VELOCITY_OBSERVER_MOD METHOD ALPHA_BETA\nVELOCITY_OBSERVER_MOD ALPHA 0.2\nVELOCITY_OBSERVER_MOD BETA 0.02",
        inputs={"POSITION": position},
        expected={"VELOCITY": velocity},
    )


def steady(model: Signal, push: Signal, position_noise: float, acceleration_noise: float) -> Signal:
    """Gain of Kalman's filter after a long time."""
    first = np.eye(len(model))[:1]
    spread = np.outer(push, push) * acceleration_noise**2
    covariance = solve_discrete_are(model.T, first.T, spread, np.array([[position_noise**2]]))
    return (covariance @ first.T / (first @ covariance @ first.T + position_noise**2)).ravel()


def kalman_velocity() -> Case:
    position = measured(18)
    model = np.array([[1.0, TICK_S], [0.0, 1.0]])
    gain = steady(model, np.array([TICK_S**2 / 2, TICK_S]), 1e-4, 40.0)
    return Case(
        module="KALMAN_MOD",
        name="constant velocity",
        oracle="scipy.linalg.solve_discrete_are",
        rows="KALMAN_MOD POSITION_NOISE 1e-4\nKALMAN_MOD ACCELERATION_NOISE 40",
        inputs={"POSITION": position},
        expected={"VELOCITY": observed(model, gain, position)[:, 1]},
    )


def kalman_acceleration() -> Case:
    position = measured(19)
    model = np.array([[1.0, TICK_S, TICK_S**2 / 2], [0.0, 1.0, TICK_S], [0.0, 0.0, 1.0]])
    gain = steady(model, np.array([TICK_S**2 / 2, TICK_S, 1.0]), 1e-4, 2.0)
    states = observed(model, gain, position)
    return Case(
        module="KALMAN_MOD",
        name="constant acceleration",
        oracle="scipy.linalg.solve_discrete_are",
        rows="KALMAN_MOD MODEL CONSTANT_ACCELERATION\nKALMAN_MOD POSITION_NOISE 1e-4\nKALMAN_MOD ACCELERATION_NOISE 2",
        inputs={"POSITION": position},
        expected={"VELOCITY": states[:, 1], "ACCELERATION": states[:, 2]},
    )
