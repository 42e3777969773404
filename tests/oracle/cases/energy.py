"""Waves and energy: transfer functions by python-control and `scipy.signal.lfilter`, energies added up in `f64`."""

from __future__ import annotations

from math import floor, pi, sqrt

import control
import numpy as np
from scipy.signal import lfilter

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 2000
B_NS_PER_M = 10.0
A = sqrt(2 * B_NS_PER_M)
COUNTS_PER_J = 2.0**24
PORT = "CH2_WAVES"


def cases() -> list[Case]:
    forms = [clamped(form) for form in ("SPLIT", "IMPLICIT", "PRINTED")]
    waves = [clamped_line(), delay(), wave_filter(), matched_port(), drift(), *scaling()]
    energies = [published_wall(), admittance(), impedance_link(), motion_link(0.1), motion_link(0.002), tank(0.0), tank(0.05)]
    return [*forms, *waves, *energies, four_channels(), clutch(), shared()]


def clamped(form: str) -> Case:
    """What a transformer with a P controller reflects of a device that is held: `kappa = h K/b`."""
    stiffness = 3000.0
    kappa = TICK_S * stiffness / B_NS_PER_M
    one = control.tf([1], [1], TICK_S)
    last = control.tf([1], [1, 0], TICK_S)
    sum_of = 1 / (one - last)
    if form == "SPLIT":
        settled = 0.125 * one / (one - 0.875 * last)
        force_per_force = kappa * last * sum_of + kappa * last * settled
    else:
        force_per_force = kappa * sum_of * (last if form == "PRINTED" else one)
    # F (1 + force_per_force) = kappa sum_of a u, and out = u - 2/a F.
    drive = kappa * sum_of * (last if form == "PRINTED" else one)
    reflected = control.minreal(one - 2 * drive / (one + force_per_force), verbose=False)
    wave = noise(TICKS, seed=21)
    wave[:3] = 0.0
    # The listing of the paper has the controller first.
    order = ["PDCTRL_MOD", "WTRANSF_MOD"] if form == "PRINTED" else ["WTRANSF_MOD", "PDCTRL_MOD"]
    return Case(
        module="WTRANSF_MOD",
        name=f"what comes back from a held device, {form}",
        oracle="python-control, scipy.signal.lfilter",
        rows=f"WTRANSF_MOD FORM {form}\nPDCTRL_MOD K_PARAM 3000"
        + ("\nPDCTRL_MOD LAW_OUTPUT ON" if form == "IMPLICIT" else "")
        + "".join(f"\nMOD_ENG MOD_ON {module}" for module in order)
        + "\n",
        inputs={PORT: wave, "POSITION": np.zeros(TICKS)},
        expected={"CH1_WAVES": lfilter(*coefficients(reflected), wave)},
        axis="linear",
    )


def coefficients(transfer: control.TransferFunction) -> tuple[np.ndarray, np.ndarray]:
    numerator, denominator = transfer.num[0][0], transfer.den[0][0]
    return np.concatenate([np.zeros(len(denominator) - len(numerator)), numerator]), denominator


def clamped_line() -> Case:
    """`Z = b (1 + z^-n)/(1 - z^-n)`: what a velocity meets at a line whose far end is held."""
    round_trip = 20
    velocity = noise(400, seed=22, amplitude=0.1)
    force = lfilter(*tails(round_trip, 1.0, B_NS_PER_M), velocity)
    # The line's wave: what left a round trip ago, sign changed.
    back = np.zeros(400)
    for tick in range(round_trip, 400):
        back[tick] = -(A * velocity[tick - round_trip] - back[tick - round_trip])
    return Case(
        module="WIMPEDANCE_MOD",
        name="the impedance of a line whose far end is held",
        oracle="scipy.signal.lfilter",
        rows="",
        inputs={"VELOCITY": velocity, PORT: rounded(back)},
        expected={"DES_FORCE": -force, "CH1_WAVES": A * velocity - back},
        axis="linear",
    )


def tails(delay_ticks: int, sign: float, scale: float) -> tuple[np.ndarray, np.ndarray]:
    numerator, denominator = np.zeros(delay_ticks + 1), np.zeros(delay_ticks + 1)
    numerator[[0, -1]] = scale, sign * scale
    denominator[[0, -1]] = 1.0, -sign
    return numerator, denominator


def delay() -> Case:
    wave = noise(300, 3, seed=23)
    return Case(
        module="TIMEDELAY_MOD",
        name="three axes, 37 ticks",
        oracle="scipy.signal.lfilter",
        rows="TIMEDELAY_MOD TD_PARAM 37",
        inputs={"CH1_WAVES": wave},
        expected={"CH1_TD_WAVES": lfilter(np.eye(38)[37], [1.0], wave, axis=0)},
        axis="linear",
    )


def wave_filter() -> Case:
    wave = noise(TICKS, seed=24)
    pole = np.exp(-2 * pi * 80.0 * TICK_S)
    filtered, _ = lfilter([1 - pole], [1.0, -pole], wave, zi=[pole * wave[0]])
    return Case(
        module="WFILTER_MOD",
        name="noise",
        oracle="scipy.signal.lfilter",
        rows="WFILTER_MOD CUTOFF 80",
        inputs={PORT: wave},
        expected={"CH2_TD_WAVES": filtered},
    )


def matched_port() -> Case:
    """Line and controller as two equations for velocity and force, solved numerically in every tick."""
    mass, bandwidth = 0.4, 2 * pi * 3.0
    damping, stiffness = bandwidth * mass, bandwidth**2 * mass
    rest = B_NS_PER_M - damping
    wave = noise(TICKS, seed=25, amplitude=0.5)
    position, velocity = noise(TICKS, seed=26, amplitude=0.02), noise(TICKS, seed=27, amplitude=0.1)
    desired = position[0]
    out, where, force = [], [], []
    for u, x, v in zip(wave, position, velocity, strict=True):
        # xd' and F_c: b xd' + F_c = a u;  (R + B + h K) xd' - F_c = B v - K (xd - x).
        equations = [[B_NS_PER_M, 1.0], [rest + damping + TICK_S * stiffness, -1.0]]
        known = [A * u, damping * v - stiffness * (desired - x)]
        speed, port = np.linalg.solve(equations, known)
        desired += TICK_S * speed
        out.append(u - 2 / A * port)
        where.append(desired)
        force.append(-damping * v + damping * (speed - v) + stiffness * (desired - x))
    return Case(
        module="WMATCH_MOD",
        name="noise on wave and robot",
        oracle="numpy.linalg.solve",
        rows="WMATCH_MOD MASS 0.4",
        inputs={PORT: wave, "POSITION": position, "VELOCITY": velocity},
        expected={"CH1_WAVES": np.array(out), "DES_POSITION": np.array(where), "DES_FORCE": np.array(force)},
        axis="linear",
    )


def drift() -> Case:
    wave, own, far = (noise(TICKS, seed=seed) for seed in (28, 29, 30))
    excess = A * 0.2 * (far - own)
    toward = np.sign(wave) * np.clip(np.abs(wave) - np.abs(excess), 0.0, None)
    return Case(
        module="WDRIFT_MOD",
        name="noise",
        oracle="numpy",
        rows="WDRIFT_MOD RATE 0.2",
        inputs={"CH1_WAVES": wave, "DES_POSITION": own, "FAR_POSITION": far},
        expected={"CH1_TD_WAVES": np.where(excess * wave > 0, toward, wave)},
        axis="linear",
    )


def scaling() -> list[Case]:
    """Waves of the master's port and those of the same motion and force, scaled, at a port of `b f/p`."""
    position_scale, force_scale = 0.3, 7.0
    velocity, force = noise(TICKS, seed=31), noise(TICKS, seed=32, amplitude=20.0)
    far_b = B_NS_PER_M * force_scale / position_scale

    def waves(b: float, v: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (b * v + f) / sqrt(2 * b), (b * v - f) / sqrt(2 * b)

    (down, up), (far_down, far_up) = (
        waves(B_NS_PER_M, velocity, force),
        waves(far_b, position_scale * velocity, force_scale * force),
    )
    return [
        Case(
            module="WSCALE_MOD",
            name="motion 0.3 times, force 7 times",
            oracle="numpy, by the definition of waves",
            rows="WSCALE_MOD POSITION_SCALE 0.3\nWSCALE_MOD FORCE_SCALE 7",
            inputs={PORT: rounded(down), "CH1_WAVES": rounded(far_up)},
            expected={"CH2_TD_WAVES": far_down, "CH1_TD_WAVES": up},
            axis="linear",
        )
    ]


def published_wall() -> Case:
    """A hand pushes a device of 40 g against a wall of 2500 N/m, through an encoder; the cap is 0.8 N s/m."""
    step = 2 * pi * 0.010 / 1024
    x, v, held, energy, last = 0.029, 0.0, 0.0, 0.0, None
    positions, pushes, forces, energies = [], [], [], []
    for _ in range(1500):
        seen = floor(x / step) * step
        moved = 0.0 if last is None else seen - last
        last = seen
        energy -= held * moved
        wall = -2500.0 * max(0.0, seen - 0.030)
        held = wall
        if energy < 0.0 and moved != 0.0:
            held -= min(-energy * TICK_S / moved**2, 0.8) * moved / TICK_S
        held = min(max(held, -2.0), 2.0)
        for signal, value in ((positions, seen), (pushes, wall), (forces, held), (energies, energy)):
            signal.append(value)
        for _ in range(40):
            v += TICK_S / 40 * (held + 400 * (0.033 - x) - 0.8 * v) / 0.04
            x += TICK_S / 40 * v
    return Case(
        module="PASSIVITY_MOD",
        name="a hand at a stiff wall, through an encoder",
        oracle="numpy",
        rows="PASSIVITY_MOD DAMPER 0.8\nPASSIVITY_MOD LIMIT 2\nPASSIVITY_MOD PORT_FORCE_IN FEED_FORCE",
        inputs={"POSITION": np.array(positions), "FEED_FORCE": np.array(pushes)},
        expected={"DES_FORCE": np.array(forces), "PORT_ENERGY": np.array(energies)},
        axis="linear",
    )


def admittance() -> Case:
    wanted = rounded(0.05 * np.sin(2 * pi * 2.0 * times(TICKS)))
    force = rounded(3.0 * np.sin(2 * pi * 2.0 * times(TICKS) + 2.0))
    desired, energy, held, last = 0.0, 0.0, 0.0, wanted[0]
    where, energies = [], []
    for target, now in zip(wanted, force, strict=True):
        paying = min(-energy / (TICK_S * held**2), 0.02) if energy < 0 and held != 0 else 0.0
        step = target - last - TICK_S * paying * held
        last = target
        desired += step
        held = now
        energy = min(energy - held * step, 0.02)
        where.append(desired)
        energies.append(energy)
    return Case(
        module="PASSIVITY_MOD",
        name="a force that goes before the motion, ADMITTANCE",
        oracle="numpy",
        rows="PASSIVITY_MOD CAUSALITY ADMITTANCE\nPASSIVITY_MOD DAMPER 50\nPASSIVITY_MOD ENERGY_LIMIT 0.02\n"
        "PASSIVITY_MOD PORT_POSITION_IN FAR_POSITION",
        inputs={"POSITION": np.zeros(TICKS), "FAR_POSITION": wanted, "DES_FORCE": force},
        expected={"DES_POSITION": np.array(where), "PORT_ENERGY": np.array(energies)},
        axis="linear",
    )


def reported(ticks: int, power_w: float) -> np.ndarray:
    """Counter of a side that takes in so much."""
    return np.floor(np.arange(ticks) * TICK_S * power_w * COUNTS_PER_J)


def impedance_link() -> Case:
    position = rounded(0.05 * np.sin(2 * pi * 3.0 * times(TICKS)))
    wanted = rounded(4.0 * np.sin(2 * pi * 3.0 * times(TICKS) + 1.0))
    far = reported(TICKS, 0.05)
    balance, given, held, last_far, last = 0.0, 0.0, 0.0, 0.0, position[0]
    forces, sent, energies = [], [], []
    for x, push, count in zip(position, wanted, far, strict=True):
        taken = -held * (x - last)
        balance = min(balance + (count - last_far) / COUNTS_PER_J, 10.0)
        kept = min(taken, max(-balance, 0.0))
        balance, given = balance + kept, given + taken - kept
        speed = (x - last) / TICK_S
        damper = min(-balance / (TICK_S * speed**2), 10.0) if balance < 0 and speed != 0 else 0.0
        held = push - damper * speed
        # With debts a force counts what it moves, too: at 10 N s/m it adds a tick's worth of 1/10 m/s per N.
        held = affordable(held, x - last, 0.0, max(balance + 0.1, 0.0), TICK_S / 10.0 if balance < 0 else 0.0)
        last, last_far = x, count
        forces.append(held)
        sent.append(np.floor(given * COUNTS_PER_J))
        energies.append(balance)
    return Case(
        module="TDPA_MOD",
        name="more comes out than the other side reports",
        oracle="numpy",
        rows="TDPA_MOD PORT_FORCE_IN FAR_FORCE",
        inputs={"POSITION": position, "FAR_FORCE": wanted, "FAR_ENERGY": far},
        expected={"DES_FORCE": np.array(forces), "LINE_ENERGY": np.array(sent), "PORT_ENERGY": np.array(energies)},
        axis="linear",
    )


def affordable(step: float, force: float, moved: float, budget_j: float, stiffness: float) -> float:
    """As much of a step that costs the budget, with the force and what the step adds to it at this stiffness."""
    way, force = abs(step), force * np.sign(step)
    costs = (force + stiffness * max(way - moved, 0.0)) * way
    if costs <= budget_j:
        return step
    roots = [budget_j / force] if force > 0 else []
    if stiffness > 0:
        roots.append(float(np.max(np.roots([stiffness, force - stiffness * moved, -budget_j]).real)))
    return min(*roots, way) * np.sign(step)


def motion_link(credit_j: float) -> Case:
    wanted = rounded(0.05 * np.sin(2 * pi * 2.0 * times(TICKS)))
    force = rounded(3.0 * np.sin(2 * pi * 2.0 * times(TICKS) + 1.2))
    far = reported(TICKS, 0.2)
    balance, given, held, last_far, last, desired, stretch = 0.0, 0.0, 0.0, 0.0, wanted[0], 0.0, 0.0
    where, sent, energies = [], [], []
    for target, now, count in zip(wanted, force, far, strict=True):
        balance = min(balance + (count - last_far) / COUNTS_PER_J, 10.0)
        step = target - last + 5.0 * TICK_S * (last - desired)
        missing = held * step - balance
        if missing > 0 and held != 0:
            step -= TICK_S * min(missing / (TICK_S * held**2), 1.0) * held
        # The longest step that costs what there is and the credit, with the force that it adds at 1 / TICK_S.
        moved = min(stretch * np.sign(step), 0.0)
        step = stretch = affordable(step, held, moved, max(balance + credit_j, 0.0), 1 / TICK_S)
        last, last_far = target, count
        desired += step
        held = now
        kept = min(-held * step, max(-balance, 0.0))
        balance, given = balance + kept, given - held * step - kept
        where.append(desired)
        sent.append(np.floor(given * COUNTS_PER_J))
        energies.append(balance)
    return Case(
        module="TDPA_MOD",
        name=f"motion that the other side has not paid for, ADMITTANCE, {credit_j} J of credit",
        oracle="numpy.roots",
        rows=f"TDPA_MOD CAUSALITY ADMITTANCE\nTDPA_MOD DAMPER 1\nTDPA_MOD DRIFT_RATE 5\nTDPA_MOD CREDIT {credit_j}",
        inputs={"POSITION": np.zeros(TICKS), "FAR_POSITION": wanted, "FAR_ENERGY": far, "DES_FORCE": force},
        expected={"DES_POSITION": np.array(where), "LINE_ENERGY": np.array(sent), "PORT_ENERGY": np.array(energies)},
        axis="linear",
    )


def tank(level_j: float) -> Case:
    position = rounded(0.05 * np.sin(2 * pi * 3.0 * times(TICKS)))
    wanted = rounded(4.0 * np.sin(2 * pi * 3.0 * times(TICKS) + 0.6))
    far = reported(TICKS, 0.1)
    level, given, held, last_far, last = 0.0, 0.0, 0.0, 0.0, position[0]
    forces, sent, levels = [], [], []
    for x, push, count in zip(position, wanted, far, strict=True):
        step = x - last
        level = min(min(level + (count - last_far) / COUNTS_PER_J, 0.04) - held * step, 0.04)
        share = 0.01 * max(level, 0.0)
        level, given = level - share, given + share
        most = 0.0 if level <= 0 else (np.inf if step == 0 else level / abs(step))
        filling = np.clip(6.0 * (1 - level / level_j), 0.0, 6.0) if level_j else 0.0
        held = np.clip(push, -most, most) - filling * step / TICK_S
        last, last_far = x, count
        forces.append(held)
        sent.append(np.floor(given * COUNTS_PER_J))
        levels.append(level)
    return Case(
        module="TANK_MOD",
        name="the operator fills it" if level_j else "only the link fills it",
        oracle="numpy",
        rows=f"TANK_MOD PORT_FORCE_IN FAR_FORCE\nTANK_MOD ENERGY_LIMIT 0.04\nTANK_MOD LEVEL {level_j}\nTANK_MOD D_PARAM 6",
        inputs={"POSITION": position, "FAR_FORCE": wanted, "FAR_ENERGY": far},
        expected={"DES_FORCE": np.array(forces), "LINE_ENERGY": np.array(sent), "PORT_ENERGY": np.array(levels)},
        axis="linear",
    )


def four_channels() -> Case:
    own, far = noise(TICKS, seed=33, amplitude=0.02), noise(TICKS, seed=34, amplitude=0.02)
    own_force, far_force = noise(TICKS, seed=35, amplitude=5.0), noise(TICKS, seed=36, amplitude=5.0)
    error = far - own
    coupling = lfilter([800.0 + 3.0 / TICK_S, -3.0 / TICK_S], [1.0], error)
    coupling[0] = 800.0 * error[0]
    return Case(
        module="FOURCHANNEL_MOD",
        name="noise on all four",
        oracle="scipy.signal.lfilter",
        rows="FOURCHANNEL_MOD K_PARAM 800\nFOURCHANNEL_MOD D_PARAM 3\nFOURCHANNEL_MOD FAR_GAIN 0.9\n"
        "FOURCHANNEL_MOD OWN_GAIN 0.25",
        inputs={"POSITION": own, "FAR_POSITION": far, "FORCE": own_force, "FAR_FORCE": far_force},
        expected={"DES_FORCE": coupling + 0.9 * far_force + 0.25 * own_force},
        axis="linear",
    )


def clutch() -> Case:
    wanted = rounded(0.1 * np.cumsum(noise(TICKS, seed=37, amplitude=0.1)))
    closed = (np.sin(2 * pi * 3.0 * times(TICKS)) > 0).astype(float)
    return Case(
        module="CLUTCH_MOD",
        name="opened and closed while the master moves",
        oracle="numpy.cumsum",
        rows="CLUTCH_MOD SCALE 0.5",
        inputs={"POSITION": np.full(TICKS, 0.25), "FAR_POSITION": wanted, "CONDITION": closed},
        expected={"DES_POSITION": 0.25 + np.cumsum(0.5 * closed * np.diff(wanted, prepend=wanted[0]))},
    )


def shared() -> Case:
    operator, program = noise(TICKS, seed=38), noise(TICKS, seed=39)
    share = np.interp(np.arange(TICKS), [99, 499, 1199, 1399], [0.0, 0.8, 0.8, 0.4])
    return Case(
        module="SHARED_MOD",
        name="authority changes hands",
        oracle="numpy.interp",
        rows="SHARED_MOD RATE 2\nSHARED_MOD PORT_OPERATOR DES_POSITION\nSHARED_MOD PORT_PROGRAM FAR_POSITION",
        inputs={"DES_POSITION": operator, "FAR_POSITION": program},
        expected={"SIGNAL_OUT": (1 - share) * operator + share * program},
        commands={100: "SHARED_MOD SHARE 0.8", 1200: "SHARED_MOD SHARE 0.4"},
    )
