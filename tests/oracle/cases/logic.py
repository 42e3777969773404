"""Selection, comparison, logic, sequences and tables: numpy and `scipy.ndimage`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from module_case import Case, noise, rounded, times

TICKS = 1000


def cases() -> list[Case]:
    return [mux(), demux(), comparator(), *logic(), sequence(), table()]


def switching(seed: int, axes: int = 1) -> NDArray[np.float64]:
    """0 and 1, each for some ticks."""
    values = np.random.default_rng(seed).integers(0, 2, (TICKS // 10, axes)).repeat(10, axis=0)
    return values.astype(float) if axes > 1 else values[:, 0].astype(float)


def mux() -> Case:
    a, b, condition = noise(TICKS, 2, seed=70), noise(TICKS, 2, seed=71), switching(72, 2)
    return Case(
        module="MUX_MOD",
        name="a condition of each of two axes",
        oracle="numpy.where",
        rows="MUX_MOD SELECT_BY CONDITION\nMUX_MOD PORT_IN1 FORCE\nMUX_MOD PORT_IN2 FEED_FORCE",
        inputs={"FORCE": a, "FEED_FORCE": b, "CONDITION": condition},
        expected={"SIGNAL_OUT": np.where(condition > 0.5, b, a)},
    )


def demux() -> Case:
    x, number = noise(TICKS, seed=73), rounded(np.arange(TICKS) // 7 % 3)
    rows = "DEMUX_MOD SELECT_BY CONDITION\nDEMUX_MOD COUNT 3"
    names = ["SIGNAL_OUT", "SIGNAL_OUT.2", "SIGNAL_OUT.3"]
    return Case(
        module="DEMUX_MOD",
        name="one of three",
        oracle="numpy.where",
        rows=rows,
        inputs={"SIGNAL": x, "CONDITION": number},
        expected={name: np.where(number == place, x, 0.0) for place, name in enumerate(names)},
    )


def comparator() -> Case:
    x = rounded(np.sin(2 * np.pi * 3 * times(TICKS)) + 0.2 * noise(TICKS, seed=74))
    # What the last sample beyond either level says.
    said = np.where(x > 0.4, 1.0, np.where(x < 0.2, 0.0, np.nan))
    last = np.maximum.accumulate(np.where(np.isnan(said), 0, np.arange(TICKS)))
    return Case(
        module="COMPARE_MOD",
        name="a noisy sine",
        oracle="numpy",
        rows="COMPARE_MOD LEVEL 0.3\nCOMPARE_MOD HYSTERESIS 0.2",
        inputs={"SIGNAL": x},
        expected={"CONDITION": np.nan_to_num(said[last])},
    )


def logic() -> list[Case]:
    a, b = switching(75), switching(76)
    before = np.r_[a[0], a[:-1]]
    ticks = 23
    # Of this tick and so many before it.
    window = {"size": ticks + 1, "origin": (ticks + 1) // 2 - 1, "mode": "nearest"}
    # What was said last: 1 by A, 0 by B.
    said = np.where(b > 0.5, 0.0, np.where(a > 0.5, 1.0, np.nan))
    last = np.maximum.accumulate(np.where(np.isnan(said), 0, np.arange(TICKS)))
    expected = {
        "AND": np.logical_and(a, b),
        "OR": np.logical_or(a, b),
        "XOR": np.logical_xor(a, b),
        "NOT": np.logical_not(a),
        "LATCH": np.nan_to_num(said[last]),
        "EDGE": a > before,
        "EDGE INVERT": a < before,
        "ON_DELAY": minimum_filter1d(a, **window),
        "OFF_DELAY": maximum_filter1d(a, **window),
    }
    return [
        Case(
            module="LOGIC_MOD",
            name=", inverted ".join(function.split(" INVERT")).lower().replace("_", " ").strip(),
            oracle="scipy.ndimage" if "DELAY" in function else "numpy",
            rows="\n".join(
                ["LOGIC_MOD FUNCTION " + function.split()[0], "LOGIC_MOD DELAY 0.023"]
                + ["LOGIC_MOD INVERT ON"] * ("INVERT" in function)
                + ["LOGIC_MOD PORT_B DRIVE_FAULT"] * (function in ("AND", "OR", "XOR", "LATCH"))
            ),
            inputs={"CONDITION": a, "DRIVE_FAULT": b},
            expected={"CONDITION.3": np.asarray(values, dtype=float)},
        )
        for function, values in expected.items()
    ]


def sequence() -> Case:
    """0 for 100 ticks, 1 for 50, 2 until B, 3 until A, and 0 again."""
    tick = np.arange(TICKS)
    a, b = (tick == 700).astype(float), (tick == 400).astype(float)
    lasting = [100, 50, 250, 300, 100, 50, 150]
    states = np.repeat([0, 1, 2, 3, 0, 1, 2], lasting)
    outputs = np.array([5.0, -1.0, 2.5, 7.0])
    table = ["AFTER[0][0] 0.1", "THEN[0][0] 1", "AFTER[0][1] 0.05", "THEN[0][1] 2", "IF_B[0][2] 3", "IF_A[0][3] 0"]
    table += [f"OUTPUT[0][{state}] {value}" for state, value in enumerate(outputs)]
    return Case(
        module="SEQUENCE_MOD",
        name="four states",
        oracle="numpy.repeat",
        rows="\n".join(f"SEQUENCE_MOD {row}" for row in [*table, "PORT_B DRIVE_FAULT"]),
        inputs={"CONDITION": a, "DRIVE_FAULT": b},
        expected={"STATE": states.astype(float), "SIGNAL_OUT": outputs[states]},
    )


def table() -> Case:
    x = noise(TICKS, 2, seed=77, amplitude=3)
    points = rounded(np.sort(noise(32, seed=78, amplitude=2.5).reshape(2, 16), axis=1))
    values = noise(32, seed=79, amplitude=10).reshape(2, 16)
    rows = [f"X[{axis}][{place}] {value!r}" for axis in (0, 1) for place, value in enumerate(points[axis].tolist())]
    rows += [f"Y[{axis}][{place}] {value!r}" for axis in (0, 1) for place, value in enumerate(values[axis].tolist())]
    return Case(
        module="TABLE_MOD",
        name="sixteen points of two axes",
        oracle="numpy.interp",
        rows="\n".join(f"TABLE_MOD {row}" for row in [*rows, "COUNT 16"]),
        inputs={"SIGNAL": x},
        expected={
            "SIGNAL_OUT": np.stack([np.interp(x[:, axis], points[axis], values[axis]) for axis in (0, 1)], axis=1)
        },
    )
