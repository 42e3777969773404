"""Controllers of joints, observers and compensation: scipy.signal, control, numpy."""

from __future__ import annotations

import control
import numpy as np
from scipy import signal

from module_case import TICK_S, Case, noise, rounded, times

TICKS = 2000


def cases() -> list[Case]:
    return [
        pi(),
        pid2(),
        pid2_fed(),
        cascade(),
        cascade_fed(),
        state_feedback(),
        lead(),
        lag(),
        impedance(),
        impedance_with_inertia(),
        *(admittance(name, *law) for name, law in ADMITTANCES.items()),
        disturbance_observer("FIRST", 1),
        disturbance_observer("SECOND", 2),
        disturbance(),
        feed_forward(),
        friction(),
        cogging(),
    ]


def pi() -> Case:
    velocity, desired = noise(TICKS, seed=30), rounded(0.3 + noise(TICKS, seed=31))
    error = desired - velocity
    return Case(
        module="PI_MOD",
        name="noise with a mean error",
        oracle="scipy.signal.lfilter",
        rows="PI_MOD K_PARAM 3\nPI_MOD I_PARAM 40",
        inputs={"VELOCITY": velocity, "DES_VELOCITY": desired},
        expected={"DES_FORCE": 3 * error + signal.lfilter([40 * TICK_S], [1.0, -1.0], error)},
    )


PID2_ROWS = """PID2_MOD K_PARAM 20
PID2_MOD I_PARAM 50
PID2_MOD D_PARAM 2
PID2_MOD FILTER_TIME 0.01
PID2_MOD SETPOINT_WEIGHT 0.6
PID2_MOD DERIVATIVE_WEIGHT 0.25"""


def pid2_force(position, desired):
    share = TICK_S / (TICK_S + 0.01)
    weighed = 0.25 * desired - position
    slope = signal.lfilter([1 / TICK_S, -1 / TICK_S], [1.0], weighed, zi=[-weighed[0] / TICK_S])[0]
    integral = 50 * TICK_S * np.cumsum(desired - position)
    return 20 * (0.6 * desired - position) + integral + 2 * signal.lfilter([share], [1.0, share - 1.0], slope)


def pid2() -> Case:
    time = times(TICKS)
    desired = rounded(0.2 + 0.2 * np.sin(2 * np.pi * 1.5 * time))
    position = rounded(0.1 * np.sin(2 * np.pi * 2.5 * time + 1))
    return Case(
        module="PID2_MOD",
        name="two sines, weights of the reference",
        oracle="scipy.signal.lfilter, numpy.cumsum",
        rows=PID2_ROWS,
        inputs={"POSITION": position, "DES_POSITION": desired},
        expected={"DES_FORCE": pid2_force(position, desired)},
    )


def pid2_fed() -> Case:
    desired, position = np.full(TICKS, 0.25), np.zeros(TICKS)
    feed = noise(TICKS, seed=32, amplitude=5)
    return Case(
        module="PID2_MOD",
        name="with feed-forward",
        oracle="scipy.signal.lfilter, numpy.cumsum",
        rows=PID2_ROWS + "\nPID2_MOD FEED_FORWARD ON",
        inputs={"POSITION": position, "DES_POSITION": desired, "FEED_FORCE": feed},
        expected={"DES_FORCE": pid2_force(position, desired) + feed},
    )


CASCADE_ROWS = """CASCADE_MOD POSITION_GAIN 12
CASCADE_MOD VELOCITY_LIMIT 1.5
CASCADE_MOD K_PARAM 4
CASCADE_MOD I_PARAM 30"""


def cascade() -> Case:
    position, velocity, desired = (noise(TICKS, seed=seed, amplitude=0.2) for seed in (33, 34, 35))
    error = np.clip(12 * (desired - position), -1.5, 1.5) - velocity
    return Case(
        module="CASCADE_MOD",
        name="noise through the velocity limit",
        oracle="numpy.clip, numpy.cumsum",
        rows=CASCADE_ROWS,
        inputs={"POSITION": position, "VELOCITY": velocity, "DES_POSITION": desired},
        expected={"DES_FORCE": 4 * error + 30 * TICK_S * np.cumsum(error)},
    )


def cascade_fed() -> Case:
    position, velocity, desired, desired_velocity, feed = (
        noise(TICKS, seed=seed, amplitude=0.2) for seed in (36, 37, 38, 39, 40)
    )
    error = np.clip(12 * (desired - position) + desired_velocity, -1.5, 1.5) - velocity
    return Case(
        module="CASCADE_MOD",
        name="with feed-forward",
        oracle="numpy.clip, numpy.cumsum",
        rows=CASCADE_ROWS + "\nCASCADE_MOD FEED_FORWARD ON",
        inputs={
            "POSITION": position,
            "VELOCITY": velocity,
            "DES_POSITION": desired,
            "DES_VELOCITY": desired_velocity,
            "FEED_FORCE": feed,
        },
        expected={"DES_FORCE": 4 * error + 30 * TICK_S * np.cumsum(error) + feed},
    )


def state_feedback() -> Case:
    """The joint of an optimal regulator follows a step: its forces, in the closed loop."""
    inertia = 0.2
    model, push, *_ = signal.cont2discrete(
        (np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1 / inertia]]), np.eye(2), np.zeros((2, 1))),
        TICK_S,
        "zoh",
    )
    # With the sum of the errors, of which the force has the newest one.
    full = np.block([[model, np.zeros((2, 1))], [-np.array([[1.0, 0.0]]) @ model, np.eye(1)]])
    full_push = np.vstack([push, -push[:1]])
    gain, _, _ = control.dlqr(full, full_push, np.diag([4.0, 0.01, 1e-4]), np.eye(1) * 1e-4)
    k1, k2, sum_gain = rounded([gain[0, 0], gain[0, 1], -gain[0, 2] / TICK_S])
    desired = np.where(times(TICKS) < 0.1, 0.0, 0.5)
    states, forces, total = np.zeros((TICKS, 2)), np.zeros(TICKS), 0.0
    state = np.zeros(2)
    for tick in range(TICKS):
        x, v = states[tick] = rounded(state)
        total += desired[tick] - x
        forces[tick] = -k1 * x - k2 * v + sum_gain * TICK_S * total
        state = model @ state + push[:, 0] * forces[tick]
    assert abs(states[-1, 0] - 0.5) < 1e-3
    return Case(
        module="STATE_FEEDBACK_MOD",
        name="an optimal regulator with integral action, in its loop",
        oracle="control.dlqr, scipy.signal.cont2discrete",
        rows="\n".join(
            f"STATE_FEEDBACK_MOD {name} {value:.9g}"
            for name, value in (("K1_PARAM", k1), ("K2_PARAM", k2), ("I_PARAM", sum_gain))
        ),
        inputs={"POSITION": states[:, 0], "VELOCITY": states[:, 1], "DES_POSITION": desired},
        expected={"DES_FORCE": forces},
    )


def lead_lag(name: str, zero_hz: float, pole_hz: float, gain: float) -> Case:
    zero, pole = 2 * np.pi * zero_hz, 2 * np.pi * pole_hz
    law = control.sample_system(control.tf([gain / zero, gain], [1 / pole, 1]), TICK_S, method="tustin")
    numerator, denominator = law.num[0][0], law.den[0][0]
    x = rounded(1 + noise(TICKS, seed=41))
    rest = signal.lfilter_zi(numerator, denominator) * x[0]
    return Case(
        module="LEAD_LAG_MOD",
        name=name,
        oracle="control.sample_system, scipy.signal.lfilter",
        rows=f"LEAD_LAG_MOD ZERO {zero_hz}\nLEAD_LAG_MOD POLE {pole_hz}\nLEAD_LAG_MOD GAIN {gain}",
        inputs={"SIGNAL": x},
        expected={"SIGNAL_OUT": signal.lfilter(numerator, denominator, x, zi=rest)[0]},
    )


def lead() -> Case:
    return lead_lag("lead, 8 to 70 Hz", 8.0, 70.0, 0.5)


def lag() -> Case:
    return lead_lag("lag, 2 to 0.1 Hz", 2.0, 0.1, 30.0)


def impedance() -> Case:
    position, velocity, desired, desired_velocity = (noise(TICKS, seed=seed) for seed in (42, 43, 44, 45))
    return Case(
        module="IMPEDANCE_MOD",
        name="spring and damper that moves along",
        oracle="numpy",
        rows="IMPEDANCE_MOD K_PARAM 150\nIMPEDANCE_MOD D_PARAM 6\nIMPEDANCE_MOD FOLLOWS_VELOCITY ON",
        inputs={
            "POSITION": position,
            "VELOCITY": velocity,
            "DES_POSITION": desired,
            "DES_VELOCITY": desired_velocity,
        },
        expected={"DES_FORCE": 150 * (desired - position) + 6 * (desired_velocity - velocity)},
    )


def impedance_with_inertia() -> Case:
    """A joint of 0.5 kg m² under the law moves as one of 2 kg m² with spring and damper does."""
    felt, stiffness, damping, inertia = 2.0, 50.0, 10.0, 0.5
    external = rounded(3 * np.sin(2 * np.pi * 0.7 * times(TICKS)))
    wanted = control.tf([1.0], [felt, damping, stiffness])
    _, states = control.forced_response(control.ss(wanted), times(TICKS), external, return_x=False)[:2]
    position = rounded(states)
    velocity = rounded(np.gradient(states, TICK_S))
    acceleration = (external - damping * velocity - stiffness * position) / felt
    return Case(
        module="IMPEDANCE_MOD",
        name="with another inertia than the joint's",
        oracle="control.forced_response, Newton's law",
        rows="""IMPEDANCE_MOD K_PARAM 50
IMPEDANCE_MOD D_PARAM 10
IMPEDANCE_MOD M_PARAM 2
IMPEDANCE_MOD INERTIA 0.5
IMPEDANCE_MOD SHAPES_INERTIA ON""",
        inputs={
            "POSITION": position,
            "VELOCITY": velocity,
            "DES_POSITION": np.zeros(TICKS),
            "EXTERNAL_FORCE": external,
        },
        expected={"DES_FORCE": inertia * acceleration - external},
    )


ADMITTANCES = {
    "swings": (0.8, 2.0, 400.0),
    "critically damped": (1.0, 20.0, 100.0),
    "overdamped": (0.5, 60.0, 100.0),
    "damped, without a spring": (2.0, 8.0, 0.0),
    "poles that are over within a tick": (0.001, 20.0, 100.0),
}


def admittance(name: str, mass: float, damping: float, stiffness: float) -> Case:
    mass = float(np.float32(mass))
    time = times(TICKS)
    force = rounded(np.where(time < 0.2, 5.0, -2.0) + noise(TICKS, seed=46))
    position = np.full(TICKS, 0.25)
    law = signal.cont2discrete(
        (
            np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]]),
            np.array([[0.0], [1 / mass]]),
            np.eye(2),
            np.zeros((2, 1)),
        ),
        TICK_S,
        "zoh",
    )
    # The state behind a tick is what the tick gives out.
    _, _, states = signal.dlsim(law, np.r_[force, 0.0])
    return Case(
        module="ADMITTANCE_MOD",
        name=name,
        oracle="scipy.signal.cont2discrete, dlsim",
        rows=f"ADMITTANCE_MOD M_PARAM {mass:.9g}\nADMITTANCE_MOD D_PARAM {damping}\nADMITTANCE_MOD K_PARAM {stiffness}",
        inputs={"POSITION": position, "EXTERNAL_FORCE": force},
        expected={"DES_POSITION": 0.25 + states[1:, 0], "DES_VELOCITY": states[1:, 1]},
    )


def disturbance_observer(order: str, poles: int) -> Case:
    inertia, pole = 0.5, np.exp(-2 * np.pi * 15 * TICK_S)
    velocity = rounded(0.3 * np.sin(2 * np.pi * 2 * times(TICKS)))
    force = noise(TICKS, seed=47, amplitude=4)
    # The first tick has nothing to compare with, and keeps the estimate of 0.
    raw = inertia / TICK_S * np.diff(velocity, prepend=0.0) - force
    raw[0] = 0.0
    for _ in range(poles):
        raw = signal.lfilter([1 - pole], [1.0, -pole], raw)
    return Case(
        module="DISTURBANCE_OBSERVER_MOD",
        name=f"{order.lower()} order, noise",
        oracle="scipy.signal.lfilter",
        rows=f"""DISTURBANCE_OBSERVER_MOD INERTIA {inertia}
DISTURBANCE_OBSERVER_MOD FREQUENCY 15
DISTURBANCE_OBSERVER_MOD ORDER {order}
DISTURBANCE_OBSERVER_MOD COMPENSATION 0.5
DISTURBANCE_OBSERVER_MOD LIMIT 1""",
        inputs={"VELOCITY": velocity, "DES_FORCE": force},
        expected={"EXTERNAL_FORCE": raw, "FEED_FORCE": np.clip(-0.5 * raw, -1, 1)},
    )


def disturbance() -> Case:
    """A joint that is pushed, in f64: the estimate is the push through the observer's low-pass."""
    inertia, pole = 0.5, np.exp(-2 * np.pi * 15 * TICK_S)
    time = times(TICKS)
    force, push = 2 * np.sin(2 * np.pi * 3 * time), np.where(time < 0.3, 0.0, 1.5)
    velocity = np.r_[0.0, np.cumsum((force + push)[:-1])] * TICK_S / inertia
    return Case(
        module="DISTURBANCE_OBSERVER_MOD",
        name="finds a load of 1.5 N m",
        oracle="numpy.cumsum, scipy.signal.lfilter",
        rows=f"DISTURBANCE_OBSERVER_MOD INERTIA {inertia}\nDISTURBANCE_OBSERVER_MOD FREQUENCY 15",
        inputs={"VELOCITY": rounded(velocity), "DES_FORCE": rounded(np.r_[0.0, force[:-1]])},
        expected={"EXTERNAL_FORCE": signal.lfilter([1 - pole], [1.0, -pole], np.r_[0.0, push[:-1]])},
    )


def feed_forward() -> Case:
    velocity, acceleration = noise(TICKS, seed=48, amplitude=0.1), noise(TICKS, seed=49, amplitude=20)
    sign = np.interp(velocity, [-0.02, 0.02], [-1.0, 1.0])
    return Case(
        module="FEED_FORWARD_MOD",
        name="all of its terms",
        oracle="numpy.interp",
        rows="""FEED_FORWARD_MOD INERTIA 0.05
FEED_FORWARD_MOD VISCOUS 0.5
FEED_FORWARD_MOD COULOMB 0.75
FEED_FORWARD_MOD COULOMB_VELOCITY 0.02
FEED_FORWARD_MOD GRAVITY -1.25""",
        inputs={"DES_VELOCITY": velocity, "DES_ACCELERATION": acceleration},
        expected={"FEED_FORCE": 0.05 * acceleration + 0.5 * velocity + 0.75 * sign - 1.25},
    )


def friction() -> Case:
    velocity = noise(TICKS, seed=50, amplitude=0.3)
    dry = 2.0 + (3.5 - 2.0) * np.exp(-((velocity / 0.04) ** 2))
    sign = np.interp(velocity, [-0.005, 0.005], [-1.0, 1.0])
    return Case(
        module="FRICTION_MOD",
        name="Stribeck's curve of the measured velocity",
        oracle="numpy.exp, numpy.interp",
        rows="""FRICTION_MOD PORT_VELOCITY VELOCITY
FRICTION_MOD COULOMB 2
FRICTION_MOD BREAKAWAY 3.5
FRICTION_MOD STRIBECK_VELOCITY 0.04
FRICTION_MOD VISCOUS 4
FRICTION_MOD SIGN_VELOCITY 0.005
FRICTION_MOD COMPENSATION 0.9""",
        inputs={"VELOCITY": velocity},
        expected={"FEED_FORCE": 0.9 * (dry * sign + 4 * velocity)},
    )


def cogging() -> Case:
    entries = noise(16, seed=51)
    position = rounded(4 * np.sin(2 * np.pi * 0.5 * times(TICKS)))
    rows = [f"COGGING_MOD TABLE[0][{place}] {value:.9g}" for place, value in enumerate(entries)]
    return Case(
        module="COGGING_MOD",
        name="to and fro over several turns",
        oracle="numpy.interp",
        rows="\n".join(["COGGING_MOD PERIOD 1.5", *rows]),
        inputs={"POSITION": position},
        expected={"FEED_FORCE": np.interp(position, np.arange(16) * 1.5 / 16, entries, period=1.5)},
    )
