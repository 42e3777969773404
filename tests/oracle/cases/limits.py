"""Limits, walls, fixtures and homing: numpy, and for the distance to brake in the roots of its equation."""

from __future__ import annotations

import numpy as np

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 1000
PERIOD_S = float(np.float32(TICK_S))


def cases() -> list[Case]:
    return [clipped(), slewed(), joint_limit(), soft_limit(), *fixtures(), homing()]


def clipped() -> Case:
    x = noise(TICKS, 2, seed=60, amplitude=5)
    return Case(
        module="LIMIT_MOD",
        name="between two values",
        oracle="numpy.clip",
        rows="LIMIT_MOD LOW -1\nLIMIT_MOD HIGH[1] 3",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": np.clip(x, -1, [1e9, 3])},
    )


def slewed() -> Case:
    """Steps of 0, 1, -0.5: at 4/s there in 0.25 s and in 0.375 s."""
    time = times(TICKS, PERIOD_S)
    x = np.where(time < 0.1, 0.0, np.where(time < 0.5, 1.0, -0.5))
    corners = np.array([0, 99, 349, 499, 874, 2000]) * PERIOD_S
    return Case(
        module="LIMIT_MOD",
        name="two steps as ramps",
        oracle="numpy.interp",
        rows="LIMIT_MOD RATE 4",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": np.interp(time, corners, [0, 0, 1, 1, -0.5, -0.5])},
    )


def joint_limit() -> Case:
    x, v = noise(TICKS, seed=61), noise(TICKS, seed=62, amplitude=3)
    wanted = noise(TICKS, seed=63, amplitude=400)
    low, high, velocity, force, a, inertia = -1.0, 1.5, 2.0, 300.0, 20.0, 0.5
    scale = inertia / PERIOD_S

    def fastest(distance: float, speed: float) -> float:
        roots = np.roots([1 / (2 * a), PERIOD_S / 2, PERIOD_S * speed / 2 - distance])
        # Where it cannot stop any more, the square root is that of 0.
        return min(float(np.max(roots.real)), velocity)

    most = [scale * (fastest(high - x[k], v[k]) - v[k]) for k in range(TICKS)]
    least = [-scale * (fastest(x[k] - low, -v[k]) + v[k]) for k in range(TICKS)]
    expected = np.clip(np.minimum(np.maximum(wanted, least), most), -force, force)
    return Case(
        module="JLIMIT_MOD",
        name="noise of position, velocity and force",
        oracle="numpy.roots",
        rows=(
            "JLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nJLIMIT_MOD POSITION_LOW -1\nJLIMIT_MOD POSITION_HIGH 1.5\n"
            "JLIMIT_MOD VELOCITY_LIMIT 2\nJLIMIT_MOD FORCE_LIMIT 300\nJLIMIT_MOD DECELERATION 20\nJLIMIT_MOD INERTIA 0.5"
        ),
        inputs={"POSITION": x, "VELOCITY": v, "FEED_FORCE": wanted},
        expected={"DES_FORCE": expected},
    )


def soft_limit() -> Case:
    x = rounded(1.5 * np.sin(2 * np.pi * 1.3 * times(TICKS)))
    wanted = noise(TICKS, seed=64, amplitude=20)
    v = np.diff(x, prepend=x[0]) / TICK_S
    upper = np.where(x > 1, np.maximum(300 * (x - 1) + 4 * v, 0), 0)
    lower = np.where(x < -0.5, np.minimum(300 * (x + 0.5) + 4 * v, 0), 0)
    return Case(
        module="SOFTLIMIT_MOD",
        name="a sine through both walls",
        oracle="numpy",
        rows=(
            "SOFTLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nSOFTLIMIT_MOD LOW -0.5\nSOFTLIMIT_MOD HIGH 1\n"
            "SOFTLIMIT_MOD K_PARAM 300\nSOFTLIMIT_MOD B_PARAM 4"
        ),
        inputs={"POSITION": x, "FEED_FORCE": wanted},
        expected={"DES_FORCE": wanted - upper - lower},
    )


def fixtures() -> list[Case]:
    time = times(TICKS)[:, None]
    x = rounded(0.3 * np.sin(2 * np.pi * np.array([1.0, 1.7, 2.3]) * time))
    wanted = noise(TICKS, 3, seed=65, amplitude=5)
    direction, origin = np.array([1.0, -2.0, 2.0]), rounded([0.1, 0.0, -0.05])
    n = direction / np.linalg.norm(direction)
    push = 200 * (x - origin) + 3 * np.diff(x, axis=0, prepend=x[:1]) / TICK_S
    across = np.outer(n, n)
    is_inside = ((x - origin) @ n < 0) & (push @ n < 0)
    forces = {
        "PLANE": -push @ across,
        "LINE": -push @ (np.eye(3) - across),
        "HALF_SPACE": np.where(is_inside[:, None], -push @ across, 0.0),
    }
    parameters = [f"FIXTURE_MOD DIRECTION[{axis}] {value}" for axis, value in enumerate(direction)]
    parameters += [f"FIXTURE_MOD ORIGIN[{axis}] {value}" for axis, value in enumerate(origin)]
    parameters += ["FIXTURE_MOD K_PARAM 200", "FIXTURE_MOD B_PARAM 3", "FIXTURE_MOD PORT_FORCE_IN FEED_FORCE"]
    return [
        Case(
            module="FIXTURE_MOD",
            name=form.lower().replace("_", " "),
            oracle="numpy, by projection",
            rows="\n".join([*parameters, f"FIXTURE_MOD FORM {form}"]),
            inputs={"POSITION": x, "FEED_FORCE": wanted},
            expected={"DES_FORCE": wanted + force},
        )
        for form, force in forces.items()
    ]


def homing() -> Case:
    """From 0.2 at -0.1 m/s to a switch at tick 500, which has to last 20.5 ms; back by 0.02."""
    tick = np.arange(TICKS)
    x = rounded(np.interp(tick, [0, 500], [0.2, 0.15]))
    condition = (tick >= 500).astype(float)
    found = 520
    desired = np.interp(tick, [0, found - 1, found, found + 200], [0.1999, 0.2 - 0.1 * found * TICK_S, 0.15, 0.17])
    return Case(
        module="HOMING_MOD",
        name="to a switch and back",
        oracle="numpy.interp",
        rows=(
            "HOMING_MOD STOP_BY CONDITION\nHOMING_MOD HOMING_VELOCITY -0.1\nHOMING_MOD BACK_OFF 0.02\n"
            "HOMING_MOD STALL_TIME 0.0205\nHOMING_MOD HOME_POSITION -1"
        ),
        inputs={"POSITION": x, "CONDITION": condition},
        expected={"DES_POSITION": desired, "POSITION.2": np.where(tick < found, x, x - 1.15)},
    )
