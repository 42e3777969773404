#!/usr/bin/env python3
"""Reference implementation of the actuated joint.

Integrates the joint's equations with scipy's DOP853 at a relative tolerance of 1e-10, tick by tick under
a held command and from event to event of dry friction, and writes what a simulator has to reproduce:

    FOLDER/joint.json         the parameters of every case as a joint's file (TOML) names them, and the load
    FOLDER/joint_<case>.csv   command and true state after every tick, 17 significant digits

To run, as `two_sided_loop.py`:

    .venv/bin/python tests/oracle/joint.py --out target/oracle

Exit status: 0 written, 1 a self-check failed, 2 wrong arguments. Where teeth
or a stop touch, the step control of the integrator finds the kink. No term is taken from the simulator:

    output   M q'' = tau + load + gravity + stop - b q' - F_LuGre
    rotor    J th'' = tau_motor - friction - tau/(N e)              rigid: th = N q
    brushed  L i' = u - R i - k w                                  u = R i + k w + L wc (i_ref - i), limited
    dq       L i' = u - R i -/+ w_e L i - w_e psi - dead time      u the same, with what the PI has learnt of it
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from math import cos, exp, hypot, pi, sin, sqrt
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.integrate import solve_ivp

from check import SelfCheckError, require, require_close

TICK_S = 1e-3
COLUMNS = (
    "command", "position", "velocity", "motor_position", "motor_velocity", "force", "current_a", "winding_c",
)
Q, V, TH, W, Z, ID, IQ, XD, XQ, T = range(10)

THERMAL = {"resistance_k_per_w": 10.0, "capacity_j_per_k": 0.5, "ambient_c": 22.0, "coefficient_per_k": 0.0039}
BRUSHED = {
    "kind": "brushed",
    "resistance_ohm": 1.2,
    "inductance_h": 4e-4,
    "torque_constant_nm_per_a": 0.05,
    "rotor_inertia_kg_m2": 1.4e-5,
    "viscous_nms_per_rad": 2e-5,
    "current_limit_a": 8.0,
    "voltage_limit_v": 14.0,
    "current_bandwidth_rad_per_s": 3000.0,
    "thermal": THERMAL,
}
THREE_PHASE = {
    "kind": "three_phase",
    "resistance_ohm": 0.4,
    "direct_inductance_h": 2.5e-4,
    "quadrature_inductance_h": 4e-4,
    "flux_linkage_vs": 0.009,
    "pole_pairs": 7,
    "rotor_inertia_kg_m2": 3e-5,
    "viscous_nms_per_rad": 3e-5,
    "current_limit_a": 15.0,
    "supply_v": 24.0,
    "dead_time_share": 0.015,
    "dead_time_current_a": 0.3,
    "current_bandwidth_rad_per_s": 3000.0,
    "thermal": THERMAL,
}
BRISTLES = {
    "coulomb": 0.8,
    "breakaway": 1.1,
    "stribeck_velocity": 0.05,
    "viscous": 0.3,
    "presliding_stiffness": 3000.0,
    "presliding_damping": 2.0,
}

# Name: parameters, ticks, command (amplitude, first and last frequency of a chirp, Hz), load (amplitude, Hz).
CASES: dict[str, tuple[dict[str, Any], int, tuple[float, float, float], tuple[float, float]]] = {
    "brushed_flexible_bristles": (
        {
            "load": {"inertia": 0.12, "damping": 0.05, "gravity_torque_nm": 2.0, "gravity_angle_rad": -0.2},
            "motor": BRUSHED,
            "gear": {"ratio": 50.0, "inertia_kg_m2": 4e-6},
            "flexible": {"stiffness": 900.0, "damping": 0.4},
            "friction": BRISTLES,
        },
        1000, (12.0, 0.5, 30.0), (1.0, 3.0),
    ),
    "three_phase_pendulum": (
        {
            "load": {"inertia": 0.3, "damping": 0.02, "gravity_torque_nm": 4.0, "start_position": 0.4},
            "motor": THREE_PHASE,
            "gear": {"ratio": 20.0, "inertia_kg_m2": 1e-5},
        },
        1000, (25.0, 1.0, 12.0), (3.0, 2.0),
    ),
    "brushed_backlash_stops": (
        {
            "load": {"inertia": 0.12, "damping": 0.3},
            "motor": BRUSHED,
            "gear": {"ratio": 50.0, "backlash": 0.02},
            "flexible": {"stiffness": 400.0, "damping": 0.5},
            "stops": {"min": -0.15, "max": 0.2, "stiffness": 1500.0, "damping": 4.0},
        },
        500, (5.0, 2.0, 6.0), (0.0, 0.0),
    ),
    "brushed_dry_lossy": (
        {
            "load": {"inertia": 0.12, "damping": 1.0, "gravity_torque_nm": 1.5, "gravity_angle_rad": 0.3},
            "motor": {**BRUSHED, "coulomb_nm": 0.004},
            "gear": {"ratio": 50.0, "efficiency": 0.8, "backdrive_efficiency": 0.65},
            "friction": {"coulomb": 1.0, "breakaway": 1.4, "stribeck_velocity": 0.1, "viscous": 0.2},
        },
        1000, (3.0, 1.0, 8.0), (0.5, 3.0),
    ),
}


class Joint:
    def __init__(self, parameters: dict[str, Any]) -> None:
        self.load = parameters["load"]
        self.motor = parameters["motor"]
        self.gear = parameters["gear"]
        self.flexible = parameters.get("flexible")
        self.friction = parameters.get("friction")
        self.stops = parameters.get("stops")
        self.ratio = self.gear["ratio"]
        self.rotor = self.motor["rotor_inertia_kg_m2"] + self.gear.get("inertia_kg_m2", 0.0)
        self.is_brushed = self.motor["kind"] == "brushed"
        # Of dry friction and of a gear with losses: -1, 0 (sticks), 1; without them, nothing asks.
        self.sliding = 0.0
        self.is_dry = bool(self.friction) and "presliding_stiffness" not in self.friction

    def start(self) -> np.ndarray:
        state = np.zeros(10)
        state[Q] = self.load.get("start_position", 0.0)
        state[TH] = self.ratio * state[Q]
        state[T] = self.motor["thermal"]["ambient_c"]
        return state

    def spring(self, y: np.ndarray) -> float:
        """The torque between gear and load of a flexible joint."""
        twist, rate = y[TH] / self.ratio - y[Q], y[W] / self.ratio - y[V]
        half = self.gear.get("backlash", 0.0) / 2
        if half == 0.0:
            return self.flexible["stiffness"] * twist + self.flexible["damping"] * rate
        if abs(twist) <= half:
            return 0.0
        if twist > 0:
            return max(0.0, self.flexible["stiffness"] * (twist - half) + self.flexible["damping"] * rate)
        return min(0.0, self.flexible["stiffness"] * (twist + half) + self.flexible["damping"] * rate)

    def outer(self, y: np.ndarray, load: float) -> tuple[float, float]:
        """All on the output but the drive, and the rate of the bristles."""
        position, velocity = y[Q], y[V]
        force = load - self.load.get("damping", 0.0) * velocity
        force -= self.load.get("gravity_torque_nm", 0.0) * sin(position - self.load.get("gravity_angle_rad", 0.0))
        bristles = 0.0
        if self.friction:
            f = self.friction
            level = f["coulomb"] + (f["breakaway"] - f["coulomb"]) * exp(-((velocity / f["stribeck_velocity"]) ** 2))
            force -= f["viscous"] * velocity
            if self.is_dry:
                return force - self.sliding * level, 0.0
            bristles = velocity - f["presliding_stiffness"] * abs(velocity) * y[Z] / level
            force -= f["presliding_stiffness"] * y[Z] + f["presliding_damping"] * bristles
        if self.stops:
            s = self.stops
            if position > s["max"]:
                force -= max(0.0, s["stiffness"] * (position - s["max"]) + s["damping"] * velocity)
            if position < s["min"]:
                force += max(0.0, s["stiffness"] * (s["min"] - position) - s["damping"] * velocity)
        return force, bristles

    def torque(self, y: np.ndarray) -> float:
        m = self.motor
        if self.is_brushed:
            return m["torque_constant_nm_per_a"] * y[IQ]
        reluctance = (m["direct_inductance_h"] - m["quadrature_inductance_h"]) * y[ID] * y[IQ]
        return 1.5 * m["pole_pairs"] * (m["flux_linkage_vs"] * y[IQ] + reluctance)

    def electric(self, y: np.ndarray, speed: float, wanted: float, rates: np.ndarray) -> None:
        m, bandwidth = self.motor, self.motor["current_bandwidth_rad_per_s"]
        thermal = m["thermal"]
        warm = m["resistance_ohm"] * (1 + thermal["coefficient_per_k"] * (y[T] - 25.0))
        if self.is_brushed:
            constant, inductance, limit = m["torque_constant_nm_per_a"], m["inductance_h"], m["voltage_limit_v"]
            reference = float(np.clip(wanted / constant, -m["current_limit_a"], m["current_limit_a"]))
            back = warm * y[IQ] + constant * speed
            voltage = float(np.clip(back + inductance * bandwidth * (reference - y[IQ]), -limit, limit))
            rates[IQ] = (voltage - back) / inductance
            heat = warm * y[IQ] ** 2
        else:
            ld, lq, psi, pairs = (
                m["direct_inductance_h"], m["quadrature_inductance_h"], m["flux_linkage_vs"], m["pole_pairs"],
            )
            reference = float(
                np.clip(wanted / (1.5 * pairs * psi), -m["current_limit_a"], m["current_limit_a"])
            )
            we = pairs * speed
            back_d, back_q = warm * y[ID] - we * lq * y[IQ], warm * y[IQ] + we * (ld * y[ID] + psi)
            radius = m["supply_v"] / sqrt(3)
            ud = float(np.clip(back_d + y[XD] + ld * bandwidth * (0 - y[ID]), -radius, radius))
            room = sqrt(max(0.0, radius**2 - ud**2))
            uq = float(np.clip(back_q + y[XQ] + lq * bandwidth * (reference - y[IQ]), -room, room))
            dead = 4 / pi * m["supply_v"] * m["dead_time_share"] / max(hypot(y[ID], y[IQ]), m["dead_time_current_a"])
            rates[ID] = (ud - back_d - dead * y[ID]) / ld
            rates[IQ] = (uq - back_q - dead * y[IQ]) / lq
            rates[XD] = (dead * y[ID] - y[XD]) * m["resistance_ohm"] / ld
            rates[XQ] = (dead * y[IQ] - y[XQ]) * m["resistance_ohm"] / lq
            heat = 1.5 * warm * (y[ID] ** 2 + y[IQ] ** 2)
        rates[T] = (heat - (y[T] - thermal["ambient_c"]) / thermal["resistance_k_per_w"]) / thermal["capacity_j_per_k"]

    def rigid(self, y: np.ndarray, load: float) -> tuple[float, float]:
        """Acceleration of the output and the drive's force on it, the gear's losses taken by trial."""
        speed, inertia = self.ratio * y[V], self.load["inertia"]
        turning = self.torque(y) - self.motor["viscous_nms_per_rad"] * speed
        turning -= self.sliding * self.motor.get("coulomb_nm", 0.0)
        outer, _ = self.outer(y, load)
        if self.is_dry and self.sliding == 0.0:
            return 0.0, self.ratio * turning
        driving, driven = self.gear.get("efficiency", 1.0), 1 / self.gear.get("backdrive_efficiency", 1.0)
        for efficiency, is_driving in ((driving, True), (driven, False)):
            acceleration = (self.ratio * efficiency * turning + outer) / (
                inertia + self.ratio**2 * efficiency * self.rotor
            )
            force = inertia * acceleration - outer
            if (force * self.sliding >= 0) == is_driving:
                break
        return acceleration, force

    def released(self, y: np.ndarray, load: float) -> tuple[float, float]:
        """How it would accelerate from rest, sliding forward and sliding backward; then sticks again."""
        accelerations = []
        for self.sliding in (1.0, -1.0):
            accelerations.append(self.rigid(y, load)[0])
        self.sliding = 0.0
        return accelerations[0], accelerations[1]

    def release(self, y: np.ndarray, load: float) -> None:
        """Chooses the sliding direction of an output at rest."""
        forward, backward = self.released(y, load)
        self.sliding = 1.0 if forward > 0 else -1.0 if backward < 0 else 0.0

    def rates(self, y: np.ndarray, load: float, wanted: float) -> np.ndarray:
        rates = np.zeros(10)
        speed = y[W] if self.flexible else self.ratio * y[V]
        outer, rates[Z] = self.outer(y, load)
        rates[Q] = y[V]
        if self.flexible:
            turning = self.torque(y) - self.motor["viscous_nms_per_rad"] * speed
            spring = self.spring(y)
            rates[V] = (spring + outer) / self.load["inertia"]
            rates[TH] = y[W]
            rates[W] = (turning - spring / self.ratio) / self.rotor
        else:
            rates[V], _ = self.rigid(y, load)
            rates[TH], rates[W] = self.ratio * y[V], self.ratio * rates[V]
        self.electric(y, speed, wanted, rates)
        return rates

    def force(self, y: np.ndarray, load: float) -> float:
        """Of the drive on the output."""
        return self.spring(y) if self.flexible else self.rigid(y, load)[1]


def chirp(amplitude: float, first_hz: float, last_hz: float, time_s: float, end_s: float) -> float:
    return amplitude * sin(2 * pi * (first_hz + (last_hz - first_hz) * time_s / (2 * end_s)) * time_s)


def simulate(name: str) -> np.ndarray:
    parameters, ticks, (amplitude, first_hz, last_hz), (push, push_hz) = CASES[name]
    joint = Joint(parameters)

    def load(time_s: float) -> float:
        return push * cos(2 * pi * push_hz * time_s)

    def stops(time_s: float, y: np.ndarray) -> float:
        """Crosses 0 downward when the output comes to rest."""
        return y[V] * joint.sliding

    def starts(time_s: float, y: np.ndarray) -> float:
        """Crosses 0 downward when friction no longer holds the output."""
        forward, backward = joint.released(y, load(time_s))
        return min(-forward, backward)

    for event in (stops, starts):
        event.terminal, event.direction = True, -1

    y, rows = joint.start(), []
    for tick in range(ticks):
        time_s, end_s = tick * TICK_S, (tick + 1) * TICK_S
        command = chirp(amplitude, first_hz, last_hz, time_s, ticks * TICK_S)
        wanted = command / joint.ratio
        while time_s < end_s:
            event = None
            if joint.is_dry:
                if not joint.sliding:
                    joint.release(y, load(time_s))
                event = stops if joint.sliding else starts
            solution = solve_ivp(
                lambda t, y: joint.rates(y, load(t), wanted),
                (time_s, end_s), y, method="DOP853", rtol=1e-10, atol=1e-13, events=event,
            )
            if not solution.success:
                raise SelfCheckError(f"{name}, tick {tick}: {solution.message}")
            time_s, y = solution.t[-1], solution.y[:, -1]
            if solution.status == 1:
                if event is stops:
                    y[V], y[W], joint.sliding = 0.0, 0.0, 0.0
                else:
                    forward, backward = joint.released(y, load(time_s))
                    joint.sliding = 1.0 if -forward < backward else -1.0
        rows.append([command, y[Q], y[V], y[TH], y[W], joint.force(y, load(end_s)), y[IQ], y[T]])
    return np.array(rows)


def check() -> None:
    """An undamped flexible joint against its closed form, so that a wrong sign here is not the reference."""
    motor = {**BRUSHED, "viscous_nms_per_rad": 0.0}
    joint = Joint(
        {"load": {"inertia": 2.0}, "motor": motor, "gear": {"ratio": 1.0}, "flexible": {"stiffness": 1e3, "damping": 0.0}}
    )
    y = joint.start()
    y[Q] = 0.01
    natural = sqrt(1e3 * (1 / 2.0 + 1 / joint.rotor))
    # No current: the back-EMF fed forward is all the voltage.
    solution = solve_ivp(
        lambda t, y: joint.rates(y, 0.0, 0.0), (0.0, 1e-3), y, method="DOP853", rtol=1e-10, atol=1e-14
    )
    end = solution.y[:, -1]
    require_close("twist", end[TH] - end[Q], -0.01 * cos(natural * 1e-3), 1e-8)


def toml(value: Any) -> str:
    """As a value of TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(inner)}" for key, inner in value.items()) + " }"
    return json.dumps(value)


def main() -> int:
    parser = argparse.ArgumentParser(description="Reference runs of the actuated joint.")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    folder: Path = parser.parse_args().out
    try:
        check()
        folder.mkdir(parents=True, exist_ok=True)
        listed = []
        for name, (parameters, ticks, _, (push, push_hz)) in CASES.items():
            file = f"joint_{name}.csv"
            rows = simulate(name)
            sticking_ticks = int(np.sum(rows[:, COLUMNS.index("velocity")] == 0))
            require("dry" not in name or 100 < sticking_ticks < ticks - 100, f"{name} sticks in {sticking_ticks} ticks")
            np.savetxt(folder / file, rows, "%.17g", ",", header=",".join(COLUMNS), comments="")
            text = "".join(f"{section} = {toml(keys)}\n" for section, keys in parameters.items())
            listed.append({"name": name, "file": file, "joint": text, "load": push, "load_hz": push_hz})
        (folder / "joint.json").write_text(json.dumps({"tick_s": TICK_S, "cases": listed}, indent=2) + "\n")
    except (SelfCheckError, OSError) as error:
        print(f"joint.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
