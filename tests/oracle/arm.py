#!/usr/bin/env python3
"""Reference implementation of the arm.

Simulates arms in MuJoCo (RK4, in steps small enough that halving them changes nothing that counts) under held torques,
and writes what a simulator has to reproduce:

    FOLDER/arm.json         the parameters of every arm as its file (TOML) names them, and at random positions and
                            velocities: mass matrix, bias, gravity torques, tip, Jacobian of the tip
    FOLDER/arm_<case>.csv   after every tick: commands, then true positions, then velocities, 17 significant digits

To run, as `two_sided_loop.py`:

    .venv/bin/python tests/oracle/arm.py --out target/oracle

Exit status: 0 written, 1 a self-check failed, 2 wrong arguments. The links are placed by modified
Denavit-Hartenberg parameters, of which MuJoCo knows nothing: here they become places and quaternions of bodies.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from check import SelfCheckError, require, require_close

TICK_S = 1e-3
STEPS_PER_TICK = 50
TICKS = 1500
SAMPLES = 40
GRAVITY = [0.3, -0.2, -9.81]


def link(
    kind: str, placed: tuple[float, float, float, float], mass: float, centre: list[float], inertia: list[float],
    motor: float, viscous: float, start: float,
) -> dict[str, Any]:
    a, alpha, d, theta = placed
    return {
        "kind": kind, "a_m": a, "alpha_rad": alpha, "d_m": d, "theta_rad": theta, "mass_kg": mass,
        "centre_of_mass_m": centre, "inertia_kg_m2": inertia, "motor_inertia": motor, "viscous": viscous,
        "start_position": start,
    }


R, P = "revolute", "prismatic"
# Name: tip in the frame of the last link, links, amplitude and frequency (Hz) of the torque of each.
CASES: dict[str, tuple[list[float], list[dict[str, Any]], list[tuple[float, float]]]] = {
    "six_axes": (
        [0.03, -0.02, 0.11],
        [
            link(R, (0.0, 0.0, 0.35, 0.2), 6.0, [0.02, -0.04, -0.12], [0.08, 0.07, 0.03, 0.004, -0.003, 0.002], 0.4, 1.0, 0.3),
            link(R, (0.06, -pi / 2, 0.05, -0.4), 5.0, [0.18, 0.01, 0.04], [0.02, 0.11, 0.12, -0.003, 0.006, 0.001], 0.5, 1.2, -0.5),
            link(R, (0.38, 0.15, -0.04, 0.1), 3.0, [0.05, -0.06, 0.02], [0.02, 0.015, 0.025, 0.002, 0.001, -0.002], 0.2, 0.6, 0.9),
            link(R, (0.07, -pi / 2, 0.33, 0.0), 1.6, [0.01, 0.02, -0.08], [0.008, 0.0075, 0.002, 0.0004, 0.0003, 0.0002], 0.05, 0.2, -0.2),
            link(R, (0.0, 1.4, 0.01, 0.3), 1.1, [-0.01, 0.03, 0.01], [0.002, 0.0015, 0.0018, 0.0001, -0.0002, 0.0001], 0.03, 0.15, 0.6),
            link(R, (0.02, -1.5, 0.07, -0.1), 0.5, [0.015, 0.01, 0.04], [0.0006, 0.0005, 0.0004, 0.00003, 0.00002, -0.00004], 0.01, 0.08, 0.0),
        ],
        [(25.0, 1.1), (40.0, 0.8), (18.0, 1.3), (4.0, 1.7), (2.0, 2.3), (0.8, 2.9)],
    ),
    "sliding_and_turning": (
        [0.1, 0.05, -0.02],
        [
            link(P, (0.1, 0.4, 0.2, 0.5), 4.0, [0.05, 0.02, -0.03], [0.03, 0.04, 0.035, 0.002, 0.001, -0.003], 1.5, 8.0, 0.1),
            link(R, (0.2, -0.9, 0.1, 0.2), 2.0, [0.15, -0.05, 0.02], [0.01, 0.02, 0.022, 0.001, -0.002, 0.001], 0.0, 0.3, 0.4),
            link(P, (0.05, 1.2, 0.3, -0.3), 1.0, [0.02, 0.01, 0.1], [0.004, 0.0045, 0.002, 0.0003, 0.0002, -0.0004], 0.3, 3.0, -0.05),
            link(R, (-0.1, 0.7, 0.0, 0.0), 0.7, [0.06, 0.03, 0.01], [0.001, 0.0015, 0.002, 0.0001, 0.0002, 0.0001], 0.01, 0.02, 1.0),
        ],
        [(60.0, 1.0), (6.0, 1.5), (15.0, 2.0), (0.6, 3.0)],
    ),
}


def principal(inertia: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments and axes: what MuJoCo makes of a `fullinertia` itself is off by 1e-9 of it."""
    xx, yy, zz, xy, xz, yz = inertia
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, axes.flatten())
    return moments, quaternion


def model(tip: list[float], links: list[dict[str, Any]], step_s: float) -> mujoco.MjModel:
    """MuJoCo's: one body in the other, its joint at its origin along its z."""
    spec = mujoco.MjSpec()
    spec.option.timestep = step_s
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = GRAVITY
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    body = spec.worldbody
    for one in links:
        alpha, theta = one["alpha_rad"], one["theta_rad"]
        about_x, about_z = [cos(alpha / 2), sin(alpha / 2), 0, 0], [cos(theta / 2), 0, 0, sin(theta / 2)]
        quaternion = np.zeros(4)
        mujoco.mju_mulQuat(quaternion, np.array(about_x), np.array(about_z))
        moments, axes = principal(one["inertia_kg_m2"])
        body = body.add_body(
            pos=[one["a_m"], -sin(alpha) * one["d_m"], cos(alpha) * one["d_m"]], quat=quaternion,
            mass=one["mass_kg"], ipos=one["centre_of_mass_m"], inertia=moments, iquat=axes, explicitinertial=True,
        )
        kind = mujoco.mjtJoint.mjJNT_HINGE if one["kind"] == R else mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(type=kind, axis=[0, 0, 1], damping=one["viscous"], armature=one["motor_inertia"])
    body.add_site(name="tip", pos=tip)
    return spec.compile()


def start(m: mujoco.MjModel, links: list[dict[str, Any]]) -> mujoco.MjData:
    data = mujoco.MjData(m)
    data.qpos[:] = [one["start_position"] for one in links]
    mujoco.mj_forward(m, data)
    return data


def torques(waves: list[tuple[float, float]], time_s: float) -> list[float]:
    """In single precision, as a controller commands them."""
    return [float(np.float32(a * sin(2 * pi * hz * time_s + axis))) for axis, (a, hz) in enumerate(waves)]


def simulate(name: str, steps_per_tick: int) -> np.ndarray:
    tip, links, waves = CASES[name]
    m = model(tip, links, TICK_S / steps_per_tick)
    data = start(m, links)
    rows = []
    for tick in range(TICKS):
        data.qfrc_applied[:] = torques(waves, tick * TICK_S)
        for _ in range(steps_per_tick):
            mujoco.mj_step(m, data)
        rows.append([*data.qfrc_applied, *data.qpos, *data.qvel])
    return np.array(rows)


def samples(name: str) -> list[dict[str, Any]]:
    tip, links, _ = CASES[name]
    m = model(tip, links, TICK_S)
    data = mujoco.MjData(m)
    random = np.random.default_rng(7)
    listed = []
    for _ in range(SAMPLES):
        position, velocity = random.uniform(-3, 3, m.nq), random.uniform(-4, 4, m.nv)
        data.qpos[:] = position
        data.qvel[:] = 0.0
        mujoco.mj_forward(m, data)
        mass, jacobian, gravity, bias = np.zeros((m.nv, m.nv)), np.zeros((3, m.nv)), np.zeros(m.nv), np.zeros(m.nv)
        mujoco.mj_fullM(m, mass, data.qM)
        mujoco.mj_jacSite(m, data, jacobian, None, 0)
        mujoco.mj_rne(m, data, 0, gravity)
        data.qvel[:] = velocity
        mujoco.mj_fwdVelocity(m, data)
        mujoco.mj_rne(m, data, 0, bias)
        listed.append({
            "position": position.tolist(), "velocity": velocity.tolist(), "mass": mass.tolist(),
            "bias": bias.tolist(), "gravity": gravity.tolist(), "tip": data.site_xpos[0].tolist(),
            "jacobian": jacobian.tolist(),
        })
    return listed


def check() -> None:
    """A pendulum of one point mass, so that a wrong sign or a wrong order of the angles here is not the reference."""
    one = link(R, (0.0, pi / 2, 0.0, 0.0), 2.0, [0.5, 0.0, 0.0], [1e-9] * 3 + [0.0] * 3, 0.1, 0.0, 0.0)
    m = model([0.5, 0.0, 0.0], [one], TICK_S)
    data = start(m, [one])
    # It swings in the plane of x and z; gravity has a part along either.
    require_close("bias", data.qfrc_bias[0], 2.0 * 0.5 * 9.81, 1e-12)
    mass = np.zeros((1, 1))
    mujoco.mj_fullM(m, mass, data.qM)
    require_close("inertia", mass[0, 0], 2.0 * 0.25 + 0.1, 1e-8)
    data.qpos[0] = pi / 2
    mujoco.mj_forward(m, data)
    require_close("tip", data.site_xpos[0][2], 0.5, 1e-12)
    require_close("bias", data.qfrc_bias[0], 2.0 * 0.5 * 0.3, 1e-12)


def toml(tip: list[float], links: list[dict[str, Any]]) -> str:
    lines = [f"gravity_m_per_s2 = {json.dumps(GRAVITY)}", f"tip_m = {json.dumps(tip)}"]
    for one in links:
        lines += ["[[link]]", *(f"{key} = {json.dumps(value)}" for key, value in one.items())]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description="Reference runs of the arm.")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    folder: Path = parser.parse_args().out
    try:
        check()
        folder.mkdir(parents=True, exist_ok=True)
        listed = []
        for name, (tip, links, _) in CASES.items():
            file = f"arm_{name}.csv"
            rows, coarser = simulate(name, STEPS_PER_TICK), simulate(name, STEPS_PER_TICK // 2)
            change = float(np.max(np.max(np.abs(rows - coarser), axis=0) / np.max(np.abs(rows), axis=0)))
            require(change < 1e-11, f"{name}: halving the step changes {change:.1e} of a peak")
            columns = [f"{what}_{axis}" for what in ("command", "position", "velocity") for axis in range(len(links))]
            np.savetxt(folder / file, rows, "%.17g", ",", header=",".join(columns), comments="")
            listed.append({"name": name, "file": file, "arm": toml(tip, links), "samples": samples(name)})
        (folder / "arm.json").write_text(json.dumps({"tick_s": TICK_S, "cases": listed}, indent=1) + "\n")
    except (SelfCheckError, OSError) as error:
        print(f"arm.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
