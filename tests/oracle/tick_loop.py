"""The same loop as a plain loop over ticks: self-check of the python-control model.

Nothing is shared with `loop.py` but the parameters: the devices step by the closed-form solution
of M x'' + B x' + Ke x = f for constant f, and the implicit order by its solved formula

    F[k] = (G (xs - x[k]) - (D/h) e[k-1]) / (1 + G h/b)     xs = xd[k-1] + (h/b) a in[k],  G = K + D/h
"""

from __future__ import annotations

from cmath import exp as complex_exp
from cmath import sqrt as complex_sqrt
from collections.abc import Callable
from math import expm1, sqrt

import numpy as np
from numpy.typing import NDArray

from loop import SETTLING, SIGNALS, TICK_S, Loop, Side

State = tuple[float, float]


def device_step(side: Side, wall_stiffness_n_per_m: float) -> Callable[[State, float], State]:
    """The exact map of (position, velocity) over one tick under a constant force."""
    m, b, ke, h = side.mass_kg, side.device_damping_n_s_per_m, wall_stiffness_n_per_m, TICK_S
    if ke == 0.0:
        lost = -expm1(-b * h / m)

        def coast(state: State, force_n: float) -> State:
            position, velocity = state
            settled = force_n / b
            return (
                position + settled * h + (velocity - settled) * lost * m / b,
                velocity + (settled - velocity) * lost,
            )

        return coast

    split = complex_sqrt(b * b - 4 * m * ke)
    fast, slow = (-b + split) / (2 * m), (-b - split) / (2 * m)
    fast_h, slow_h = complex_exp(fast * h), complex_exp(slow * h)
    keep = ((fast * slow_h - slow * fast_h) / (fast - slow)).real
    glide = ((fast_h - slow_h) / (fast - slow)).real
    pull = (fast * slow * (slow_h - fast_h) / (fast - slow)).real
    hold = ((fast * fast_h - slow * slow_h) / (fast - slow)).real

    def swing(state: State, force_n: float) -> State:
        stretch = state[0] - force_n / ke
        return (force_n / ke + keep * stretch + glide * state[1], pull * stretch + hold * state[1])

    return swing


class Port:
    """PD and wave transformer of one side in a given order."""

    def __init__(self, order: str, side: Side, b: float) -> None:
        self.tick = {
            "split": self.split,
            "plain_split": self.split,
            "implicit": self.implicit,
            "printed": self.printed,
            "transformer_first": self.transformer_first,
        }[order]
        self.k, self.d = side.stiffness_n_per_m, side.pd_damping_n_s_per_m / TICK_S
        self.a, self.per_b = sqrt(2 * b), TICK_S / b
        self.desired, self.force, self.error = 0.0, 0.0, 0.0
        self.settling = SETTLING if order == "split" else 0.0
        self.integral, self.settled_force = 0.0, 0.0

    def pd(self, error: float) -> float:
        force = self.k * error + self.d * (error - self.error)
        self.error = error
        return force

    def split(self, wave: float, position: float) -> float:
        self.integral += self.per_b * (self.a * wave - self.force)
        self.desired = self.integral - self.per_b * self.settled_force
        self.force = self.pd(self.desired - position)
        self.settled_force += self.settling * (self.force - self.settled_force)
        return wave - 2 / self.a * self.force

    def implicit(self, wave: float, position: float) -> float:
        reach, g = self.desired + self.per_b * self.a * wave, self.k + self.d
        self.force = (g * (reach - position) - self.d * self.error) / (1 + g * self.per_b)
        self.desired = reach - self.per_b * self.force
        self.error = self.desired - position
        return wave - 2 / self.a * self.force

    def printed(self, wave: float, position: float) -> float:
        self.force = self.pd(self.desired - position)
        self.desired += self.per_b * (self.a * wave - self.force)
        return wave - 2 / self.a * self.force

    def transformer_first(self, wave: float, position: float) -> float:
        self.desired += self.per_b * (self.a * wave - self.force)
        wave_out = wave - 2 / self.a * self.force
        self.force = self.pd(self.desired - position)
        return wave_out


def simulate_ticks(loop: Loop, hand_force_n: NDArray[np.float64]) -> NDArray[np.float64]:
    """Response from rest; row i is `SIGNALS[i]`, column k is tick k. Both delays are at least one tick."""
    move_master = device_step(loop.master, 0.0)
    move_slave = device_step(loop.slave, loop.wall_stiffness_n_per_m)
    master = Port(loop.order, loop.master, loop.impedance_n_s_per_m)
    slave = Port(loop.order, loop.slave, loop.impedance_n_s_per_m)
    forward, backward = [0.0] * loop.forward_delay_ticks, [0.0] * loop.backward_delay_ticks
    master_state, slave_state = (0.0, 0.0), (0.0, 0.0)
    rows = np.empty((len(hand_force_n), len(SIGNALS)))
    for k, hand in enumerate(hand_force_n.tolist()):
        to_slave, to_master = forward[-loop.forward_delay_ticks], backward[-loop.backward_delay_ticks]
        forward.append(master.tick(to_master, master_state[0]))
        backward.append(slave.tick(to_slave, slave_state[0]))
        rows[k] = (
            master_state[0], slave_state[0], master.desired, slave.desired, master.force, slave.force,
            forward[-1], to_master, to_slave, backward[-1],
        )
        master_state = move_master(master_state, master.force + hand)
        slave_state = move_slave(slave_state, slave.force)
    return rows.T
