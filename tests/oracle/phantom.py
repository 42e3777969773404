#!/usr/bin/env python3
"""Reference implementation of the PHANToM.

Integrates the device with scipy's DOP853 at a relative tolerance of 1e-11, tick by tick under a held command, and writes
what a simulator has to reproduce:

    FOLDER/phantom.json         the parameters of every case as a device's file (TOML) names them, and the hand at the tip
    FOLDER/phantom_<case>.csv   after every tick: commands, true angles, speeds, tip, 17 significant digits

To run, as `two_sided_loop.py`:

    .venv/bin/python tests/oracle/phantom.py --out target/oracle

Exit status: 0 written, 1 a self-check failed, 2 wrong arguments. The published equations of motion are not used:
each of the five bodies is put where it is in space, and turned as it is turned. Kinetic energy is that of its mass and of
its moments of inertia, potential energy that of its weight, and Lagrange's equations are made of the slopes of both:
of what is placed by a step along the imaginary axis, which is exact, of the mass matrix by central differences of
fourth order.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import pi, sin
from pathlib import Path
from typing import Any, Callable

import numpy as np
from scipy.integrate import solve_ivp

from check import SelfCheckError, require, require_close

TICK_S = 1e-3
TICKS = 1000
COLUMNS = tuple(f"{what}_{axis}" for what in ("command", "position", "velocity", "tip") for axis in range(3))
# Of the differences. Their error is of its fourth power, and of the rounding divided by it.
SLOPE_RAD = 2e-3
# Of the paper; the mass centres of `be` and `df` count for their weight alone, as their moments are about the pivots.
L1, L2, L3, L5, L6 = 0.215, 0.170, 0.0325, -0.0368, 0.0527
MA, MC, MBE, MDF = 0.0202, 0.0249, 0.2359, 0.1906
IA, IC = (0.4864e-4, 0.001843e-4, 0.4864e-4), (0.959e-4, 0.959e-4, 0.0051e-4)
IBE, IDF = (11.09e-4, 10.06e-4, 0.591e-4), (7.11e-4, 0.629e-4, 6.246e-4)
IBASE = 11.87e-4
GRAVITY = 9.81
RATIOS, ROTOR, VISCOUS = (13.3, 11.2, 11.2), 1.08e-6, 5e-4

IDEAL = {
    "coulomb_nm": 0.0, "viscous_nms_per_rad": 0.0, "rotor_inertia_kg_m2": 0.0, "motor_limit_nm": "inf",
    "min_rad": ["-inf"] * 3, "max_rad": ["inf"] * 3, "elbow_min_rad": "-inf", "elbow_max_rad": "inf",
}
# Name: what differs from the device as published, amplitudes of the command, its frequencies, hand: stiffness, damping.
CASES: dict[str, tuple[dict[str, Any], tuple[float, ...], tuple[float, ...], tuple[float, float]]] = {
    "falling": ({**IDEAL, "port": "joint", "start_position_rad": [0.2, 0.4, 0.9]}, (0.01, 0.0, 0.0), (1.0, 1.0, 1.0), (0.0, 0.0)),
    "torques": (
        {**IDEAL, "port": "joint", "start_position_rad": [-0.3, 0.1, 0.3]},
        (0.05, 0.12, 0.08), (1.3, 2.1, 1.7), (0.0, 0.0),
    ),
    "force_and_hand": (
        {
            **IDEAL, "viscous_nms_per_rad": VISCOUS, "rotor_inertia_kg_m2": ROTOR, "motor_limit_nm": 0.129,
            "start_position_rad": [0.1, 0.2, -0.1],
        },
        (0.8, 0.6, 1.0), (1.1, 1.9, 2.7), (120.0, 1.5),
    ),
}


SHIFTS = np.einsum("s,ab->asb", np.array([-2, -1, 1, 2]), np.eye(3)) * SLOPE_RAD
WEIGHTS = np.array([1, -8, 8, -1]) / (12 * SLOPE_RAD)
UP = np.array([0.0, 0.0, 1.0])

# All of these take angles in the last dimension, and any dimensions before it.


def slope(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray) -> np.ndarray:
    """How the value changes with either angle: a dimension for that, then those of the value."""
    return function(q[..., None, :] + 1e-20j * np.eye(3)).imag * 1e20


def difference(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray) -> np.ndarray:
    """The same of a function that is itself made of slopes."""
    return np.tensordot(function(q[..., None, None, :] + SHIFTS), WEIGHTS, (q.ndim, 0))


def turned(about_vertical: np.ndarray, in_plane: np.ndarray) -> np.ndarray:
    """A body that leans from forward to up by `in_plane`, on a base that is turned: its axes across, up, forward."""
    sine, cosine, zero = np.sin(about_vertical), np.cos(about_vertical), np.zeros_like(about_vertical)
    forward, left = np.stack([cosine, sine, zero], -1), np.stack([-sine, cosine, zero], -1)
    sine, cosine = np.sin(in_plane)[..., None], np.cos(in_plane)[..., None]
    return np.stack([left, cosine * UP - sine * forward, sine * UP + cosine * forward], -2)


def links(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How inner and outer link are turned; the parallel bar and what sits on the shoulder turn with the one or other."""
    return turned(q[..., 0], q[..., 1]), turned(q[..., 0], q[..., 2])


def places(q: np.ndarray) -> np.ndarray:
    """Mass centres of `a`, `c`, `be` and `df`."""
    along_inner, along_outer = links(q)
    inner, down = along_inner[..., 2, :], -along_outer[..., 1, :]
    return np.stack([L1 * inner + L2 / 2 * down, L1 / 2 * inner + L3 * down, L5 * inner, -L6 * down], -2)


def tip(q: np.ndarray) -> np.ndarray:
    along_inner, along_outer = links(q)
    return L1 * along_inner[..., 2, :] - L2 * along_outer[..., 1, :]


def mass_matrix(q: np.ndarray) -> np.ndarray:
    # The moments of `be` and `df` are about their pivots: that their centres move is in them.
    moved = slope(places, q)[..., :2, :]
    mass = np.einsum("...ibk,...jbk,b->...ij", moved, moved, np.array([MA, MC]))
    mass[..., 0, 0] += IBASE
    for axes, turn, moments in zip(links(q), (1, 2), (np.add(IBE, IC), np.add(IA, IDF))):
        angular = np.zeros(q.shape + (3,))
        angular[..., 0, :] = UP
        # From forward to up is backwards about what points left.
        angular[..., turn, :] = -axes[..., 0, :]
        about_axes = np.einsum("...ik,...mk->...im", angular, axes)
        mass += np.einsum("...im,...jm,m->...ij", about_axes, about_axes, moments)
    return mass


def potential(q: np.ndarray) -> np.ndarray:
    return GRAVITY * places(q)[..., 2] @ np.array([MA, MC, MBE, MDF])


def jacobian(q: np.ndarray) -> np.ndarray:
    return slope(tip, q).T


def acceleration(q: np.ndarray, v: np.ndarray, torques: np.ndarray, rotors: np.ndarray) -> np.ndarray:
    """Lagrange: d/dt (M v) - grad(½ vᵀ M v) + grad V = torques."""
    slopes = difference(mass_matrix, q)
    bias = np.einsum("aij,a,j->i", slopes, v, v) - 0.5 * np.einsum("aij,i,j->a", slopes, v, v)
    return np.linalg.solve(mass_matrix(q) + np.diag(rotors), torques - bias - slope(potential, q))


def simulate(name: str) -> np.ndarray:
    parameters, amplitudes, frequencies, (stiffness, damping) = CASES[name]
    viscous = parameters["viscous_nms_per_rad"]
    rotors = parameters["rotor_inertia_kg_m2"] * np.array(RATIOS) ** 2
    limits = float(parameters["motor_limit_nm"]) * np.array(RATIOS)
    q = np.array(parameters["start_position_rad"])
    anchor = tip(q)

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:3], y[3:]
        torques = held - viscous * v
        if stiffness:
            levers = jacobian(q)
            torques = torques + levers.T @ (stiffness * (anchor - tip(q)) - damping * levers @ v)
        return np.concatenate([v, acceleration(q, v, torques, rotors)])

    y, rows = np.concatenate([q, np.zeros(3)]), []
    for tick in range(TICKS):
        command = np.array([
            float(np.float32(amplitude * sin(2 * pi * hz * tick * TICK_S + axis)))
            for axis, (amplitude, hz) in enumerate(zip(amplitudes, frequencies))
        ])
        held = command if parameters.get("port") == "joint" else jacobian(y[:3]).T @ command
        held = np.clip(held, -limits, limits)
        solution = solve_ivp(rates, (0.0, TICK_S), y, method="DOP853", rtol=1e-11, atol=1e-13, first_step=TICK_S)
        if not solution.success:
            raise SelfCheckError(f"{name}, tick {tick}: {solution.message}")
        y = solution.y[:, -1]
        rows.append([*command, *y, *tip(y[:3])])
    return np.array(rows)


def check() -> None:
    """What is published: how heavy the tip feels with all axes at 0, so that no body is turned the wrong way here."""
    mass, levers = mass_matrix(np.zeros(3)), jacobian(np.zeros(3))
    inverse = levers @ np.linalg.solve(mass, levers.T)
    for direction, apparent_kg in enumerate((0.0322, 0.0773, 0.0525)):
        require_close(f"apparent mass {direction}", 1 / inverse[direction, direction], apparent_kg, 0.5e-4)
    require_close("tip", tip(np.zeros(3))[2], -L2, 1e-15)


def toml(value: Any) -> str:
    """As a value of TOML."""
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return value if value in ("inf", "-inf") else json.dumps(value)


def main() -> int:
    parser = argparse.ArgumentParser(description="Reference runs of the PHANToM.")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    folder: Path = parser.parse_args().out
    try:
        check()
        folder.mkdir(parents=True, exist_ok=True)
        listed = []
        for name, (parameters, _, _, (stiffness, damping)) in CASES.items():
            file = f"phantom_{name}.csv"
            rows = simulate(name)
            travel = float(np.min(np.ptp(rows[:, 3:6], axis=0)))
            require(travel > 0.03, f"{name}: an axis moves by {travel:.2g} rad only")
            np.savetxt(folder / file, rows, "%.17g", ",", header=",".join(COLUMNS), comments="")
            text = "".join(f"{key} = {toml(value)}\n" for key, value in parameters.items())
            listed.append({
                "name": name, "file": file, "phantom": text,
                "hand_stiffness_n_per_m": stiffness, "hand_damping_n_s_per_m": damping,
            })
        (folder / "phantom.json").write_text(json.dumps({"tick_s": TICK_S, "cases": listed}, indent=2) + "\n")
    except (SelfCheckError, OSError) as error:
        print(f"phantom.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
