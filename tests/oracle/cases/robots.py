"""Arms: MuJoCo's bodies for chains, Lagrange's equations of placed bodies (`phantom.py`) for the PHANToM."""

from __future__ import annotations

from math import pi

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

import arm
import phantom
from module_case import TICK_S, Case, noise, rounded

TICKS = 300
Array = NDArray[np.float64]

# Mass, length, mass centre, inertia about it, of each link.
LINKS = [(3.0, 0.5, 0.22, 0.06), (2.0, 0.4, 0.25, 0.03), (0.8, 0.25, 0.1, 0.004)]
MOTORS, VISCOUS = [0.3, 0.2, 0.05], [0.7, 0.4, 0.1]
# a, alpha, d, theta of each joint.
ROWS = [
    (0.0, 0.0, 0.35, 0.2), (0.06, -1.57, 0.05, -0.4), (0.38, 0.15, -0.04, 0.1),
    (0.07, -1.5, 0.33, 0.0), (0.0, 1.4, 0.01, 0.3), (0.02, -1.6, 0.07, -0.1),
]
TIP = [0.03, -0.02, 0.11]


def cases() -> list[Case]:
    return [
        planar_tip(), chain_tip(arm.R, 6), chain_tip(arm.P, 3), phantom_tip(), planar_inverse("POSITIVE"),
        planar_inverse("NEGATIVE"), phantom_inverse(), planar_gravity(), phantom_gravity(), planar_torque(),
        phantom_torque(), planar_collision(), phantom_collision(),
    ]


def per_axis(module: str, parameter: str, values: list[float]) -> str:
    return "".join(f"{module} {parameter}[{axis}] {value!r}\n" for axis, value in enumerate(values))


def planar_model(step_s: float = TICK_S) -> mujoco.MjModel:
    links = [
        arm.link(arm.R, (before, 0.0, 0.0, 0.0), mass, [centre, 0.0, 0.0], [inertia / 2, inertia / 2, inertia, 0, 0, 0], motor, viscous, 0.0)
        for before, (mass, _, centre, inertia), motor, viscous in zip([0.0, *(link[1] for link in LINKS)], LINKS, MOTORS, VISCOUS)
    ]
    model = arm.model([LINKS[-1][1], 0.0, 0.0], links, step_s)
    model.opt.gravity[:] = [1.5, -9.0, 0.0]
    return model


def planar_rows(module: str, has_motors: bool) -> str:
    masses, lengths, centres, inertias = map(list, zip(*LINKS))
    rows = per_axis(module, "MASS", masses) + per_axis(module, "LENGTH", lengths) + per_axis(module, "CENTRE", centres)
    rows += per_axis(module, "INERTIA", inertias) + f"{module} GRAVITY_X 1.5\n{module} GRAVITY_Y -9\n"
    if has_motors:
        rows += per_axis(module, "MOTOR_INERTIA", MOTORS) + per_axis(module, "VISCOUS", VISCOUS)
    return rows


def states(axes: int) -> tuple[Array, Array]:
    return noise(TICKS, axes, seed=1, amplitude=3.0), noise(TICKS, axes, seed=2, amplitude=4.0)


def padded(values: list[Array], axes: int) -> Array:
    """x, y, z on the existing axes, 0 on further ones."""
    return np.pad(np.array(values), ((0, 0), (0, max(0, axes - 3))))[:, :axes]


def of_chain(model: mujoco.MjModel, position: Array, velocity: Array, force: Array) -> dict[str, Array]:
    """What MuJoCo finds of the tip: place, velocity, and a force at it on the joints."""
    data, axes = mujoco.MjData(model), model.nq
    places, speeds, torques = [], [], []
    for q, v, f in zip(position, velocity, force):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        jacobian = np.zeros((3, axes))
        mujoco.mj_jacSite(model, data, jacobian, None, 0)
        places.append(data.site_xpos[0].copy())
        speeds.append(jacobian @ v)
        torques.append(jacobian.T @ f[:3])
    return {"TIP_POSITION": padded(places, axes), "TIP_VELOCITY": padded(speeds, axes), "DES_FORCE": np.array(torques)}


def tip_case(module: str, name: str, oracle: str, rows: str, inputs: tuple[Array, Array, Array], expected: dict[str, Array], axis: str = "rotary") -> Case:
    position, velocity, force = inputs
    return Case(
        module=module, name=name, oracle=oracle, rows=f"{module} VELOCITY ON\n" + rows,
        inputs={"POSITION": position, "VELOCITY": velocity, "DES_TIP_FORCE": force}, expected=expected, axis=axis,
    )


def planar_tip() -> Case:
    inputs = (*states(3), noise(TICKS, 3, seed=3, amplitude=20.0))
    rows = per_axis("PLANAR_TIP_MOD", "LENGTH", [link[1] for link in LINKS])
    return tip_case("PLANAR_TIP_MOD", "three links", "mujoco", rows, inputs, of_chain(planar_model(), *inputs))


def chain_tip(kind: str, axes: int) -> Case:
    module = "DH_TIP_MOD"
    links = [arm.link(kind, row, 1.0, [0.0] * 3, [0.1] * 3 + [0.0] * 3, 0.0, 0.0, 0.0) for row in ROWS[:axes]]
    inputs = (*states(axes), noise(TICKS, axes, seed=3, amplitude=20.0))
    rows = "".join(per_axis(module, f"DH_{name}", [row[place] for row in ROWS[:axes]]) for place, name in enumerate(["A", "ALPHA", "D", "THETA"]))
    rows += "".join(f"{module} TIP_{name} {value}\n" for name, value in zip("XYZ", TIP))
    expected = of_chain(arm.model(TIP, links, TICK_S), *inputs)
    turns = kind == arm.R
    name = f"{axes} joints that {'turn' if turns else 'slide'}"
    return tip_case(module, name, "mujoco", rows, inputs, expected, "rotary" if turns else "linear")


def phantom_tip() -> Case:
    position, velocity = states(3)
    force = noise(TICKS, 3, seed=3, amplitude=8.0)
    levers = [phantom.jacobian(q) for q in position]
    expected = {
        "TIP_POSITION": phantom.tip(position),
        "TIP_VELOCITY": np.array([j @ v for j, v in zip(levers, velocity)]),
        "DES_FORCE": np.array([j.T @ f for j, f in zip(levers, force)]),
    }
    return tip_case("PHANTOM_TIP_MOD", "all over", "slopes of its geometry", "", (position, velocity, force), expected)


def planar_inverse(elbow: str) -> Case:
    turn = np.random.default_rng(5)
    first, bend = turn.uniform(-1.0, 1.0, TICKS), turn.uniform(0.3, 2.0, TICKS) * (1 if elbow == "POSITIVE" else -1)
    inner, outer = 0.4, 0.3
    tip = rounded(np.stack([inner * np.cos(first) + outer * np.cos(first + bend), inner * np.sin(first) + outer * np.sin(first + bend)], 1))
    return Case(
        module="PLANAR_INVERSE_MOD", name=f"back to the joints that the tip was made of, {elbow.lower()} elbow",
        oracle="closed form", rows=f"PLANAR_INVERSE_MOD INNER_LENGTH 0.4\nPLANAR_INVERSE_MOD OUTER_LENGTH 0.3\nPLANAR_INVERSE_MOD ELBOW {elbow}",
        inputs={"DES_TIP_POSITION": tip}, expected={"DES_POSITION": np.stack([first, bend], 1)},
    )


def phantom_inverse() -> Case:
    turn = np.random.default_rng(6)
    first, inner = turn.uniform(-1.2, 1.2, TICKS), turn.uniform(-0.4, 0.8, TICKS)
    joints = np.stack([first, inner, inner + turn.uniform(-0.9, 0.7, TICKS)], 1)
    return Case(
        module="PHANTOM_INVERSE_MOD", name="back to the joints that the tip was made of", oracle="closed form", rows="",
        inputs={"DES_TIP_POSITION": rounded(phantom.tip(joints))}, expected={"DES_POSITION": joints},
    )


def chain_torques(position: Array, velocity: Array, acceleration: Array) -> Array:
    model = planar_model()
    data, torques = mujoco.MjData(model), []
    for q, v, a in zip(position, velocity, acceleration):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    return np.array(torques)


def phantom_torques(position: Array, velocity: Array, acceleration: Array) -> Array:
    # What the accelerations without any torque lack, times the mass.
    none = np.zeros(3)
    free = [phantom.acceleration(q, v, none, none) for q, v in zip(position, velocity)]
    return np.array([phantom.mass_matrix(q) @ (a - f) for q, a, f in zip(position, acceleration, free)])


def planar_gravity() -> Case:
    position, still = noise(TICKS, 3, seed=1, amplitude=3.0), np.zeros((TICKS, 3))
    return Case(
        module="PLANAR_GRAVITY_MOD", name="three links", oracle="mujoco.mj_inverse", rows=planar_rows("PLANAR_GRAVITY_MOD", False),
        inputs={"POSITION": position}, expected={"FEED_FORCE": chain_torques(position, still, still)},
    )


def phantom_gravity() -> Case:
    position = noise(TICKS, 3, seed=1, amplitude=1.5)
    return Case(
        module="PHANTOM_GRAVITY_MOD", name="all over", oracle="slopes of its bodies' potential energy", rows="",
        inputs={"POSITION": position}, expected={"FEED_FORCE": np.array([phantom.slope(phantom.potential, q) for q in position])},
    )


def torque_case(module: str, oracle: str, rows: str, torques) -> Case:
    position, velocity = states(3)
    wanted, speed, acceleration = (noise(TICKS, 3, seed=seed, amplitude=a) for seed, a in ((7, 3.0), (8, 4.0), (9, 20.0)))
    rate = 2 * pi * 1.5
    total = acceleration + 2 * 0.8 * rate * (speed - velocity) + rate**2 * (wanted - position)
    return Case(
        module=module, name="everywhere, at every speed", oracle=oracle,
        rows=rows + f"{module} BANDWIDTH 1.5\n{module} DAMPING_RATIO 0.8\n",
        inputs={
            "POSITION": position, "VELOCITY": velocity, "DES_POSITION": wanted, "DES_VELOCITY": speed,
            "DES_ACCELERATION": acceleration,
        },
        expected={"DES_FORCE": torques(position, velocity, total)},
    )


def planar_torque() -> Case:
    module = "PLANAR_TORQUE_MOD"
    return torque_case(module, "mujoco.mj_inverse", planar_rows(module, True), chain_torques)


def phantom_torque() -> Case:
    return torque_case("PHANTOM_TORQUE_MOD", "Lagrange's equations of its bodies", "", phantom_torques)


def collision_case(module: str, oracle: str, rows: str, runs: tuple[Array, Array, Array, Array], threshold: float) -> Case:
    position, velocity, command, outside = runs
    bandwidth = 5.0
    share = 2 * pi * bandwidth * TICK_S
    seen = lfilter([0.0, share / (1 + share)], [1.0, -1 / (1 + share)], outside, axis=0)
    return Case(
        module=module, name="pushed while it moves", oracle=oracle,
        rows=rows + f"{module} BANDWIDTH {bandwidth}\n{module} THRESHOLD {threshold}\n",
        inputs={"POSITION": position, "VELOCITY": velocity, "DES_FORCE": command}, expected={"EXTERNAL_FORCE": seen},
        tolerance=2e-3,
        why="the true motion is continuous; the module integrates by the trapezoidal rule, and momenta are differences of rounded values",
    )


def pushed(amplitude: list[float]) -> tuple[Array, Array]:
    """Torques of the motors, and those of the world: one pushes in the middle."""
    time = np.arange(1000)[:, None] * TICK_S
    command = rounded(np.array(amplitude) * np.sin(2 * pi * np.array([0.7, 1.1, 1.6]) * time + 1.0))
    outside = np.where((time > 0.4) & (time < 0.7), np.array(amplitude) * [0.5, -0.4, 0.6], 0.0)
    return command, outside


def planar_collision() -> Case:
    command, outside = pushed([20.0, 10.0, 3.0])
    model = planar_model(TICK_S / 20)
    data, rows = mujoco.MjData(model), []
    data.qpos[:] = [-1.2, 0.4, 0.3]
    mujoco.mj_forward(model, data)
    for torques in command + outside:
        rows.append([*data.qpos, *data.qvel])
        data.qfrc_applied[:] = torques
        for _ in range(20):
            mujoco.mj_step(model, data)
    found = rounded(np.array(rows))
    module = "PLANAR_COLLISION_MOD"
    return collision_case(module, "mujoco, scipy.signal.lfilter", planar_rows(module, True), (found[:, :3], found[:, 3:], command, outside), 2.0)


def phantom_collision() -> Case:
    command, outside = pushed([0.02, 0.03, 0.02])
    state, rows = np.array([0.0, 0.2, 0.1, 0.0, 0.0, 0.0]), []

    def rate(y: Array, torques: Array) -> Array:
        return np.concatenate([y[3:], phantom.acceleration(y[:3], y[3:], torques, np.zeros(3))])

    for torques in command + outside:
        rows.append(state)
        first = rate(state, torques)
        second = rate(state + TICK_S / 2 * first, torques)
        third = rate(state + TICK_S / 2 * second, torques)
        fourth = rate(state + TICK_S * third, torques)
        state = state + TICK_S / 6 * (first + 2 * second + 2 * third + fourth)
    found = rounded(np.array(rows))
    return collision_case("PHANTOM_COLLISION_MOD", "Lagrange's equations of its bodies, scipy.signal.lfilter", "", (found[:, :3], found[:, 3:], command, outside), 0.005)
