"""The two-sided wave-variable loop as interconnected discrete blocks of python-control.

One axis: a hand pushes the master device, a delayed wave line joins it to the slave device.

                hand_force
                    |
    device <- force - PD <- desired position - decoder <- wave_in  <- n2 ticks -+
    (master)          |                                                         |
                      +----- force ----------> encoder -> wave_out -> n1 ticks -> slave, mirrored

Both sides carry the same equations; `force` is what the PD commands to its own device (SI units):

    decoder  p[k]   = p[k-1] + (h/b) (a in[k] - F_dec)           a = sqrt(2 b)
             xd[k]  = p[k] - (h/b) S[k-1]
    settled  S[k]   = S[k-1] + s (F[k] - S[k-1])
    PD       F[k]   = K e[k] + D (e[k] - e[k-1]) / h             e[k] = xd_pd - x[k]
    encoder  out[k] = in[k] - (2/a) F_enc
    device   M x'' + B x' (+ Ke x) = F + hand_force              forces held for one tick

The orders of a tick differ only in who sees a signal one tick late, and in the settled force S:

    order               F_dec     xd_pd     F_enc      s
    split               F[k-1]    xd[k]     F[k]       1/8   decode, PD, encode
    plain_split         F[k-1]    xd[k]     F[k]       S=0   split without S: feels like K/(1 - h K/b)
    implicit            F[k]      xd[k]     F[k]       S=0   an algebraic loop, solved exactly
    printed             F[k]      xd[k-1]   F[k]       S=0   the paper: PD, then wave transformer
    transformer_first   F[k-1]    xd[k]     F[k-1]     S=0   wave transformer, then PD

Waves: Niemeyer and Slotine, IEEE J. Oceanic Engineering 16(1):152-162, 1991.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import control
import numpy as np
from numpy.typing import NDArray

TICK_S = 1e-3
IMPEDANCE_NS_PER_M = 10.0
SETTLING = 1 / 8  # how much of the way the settled force goes to the present one in a tick
NEUTRAL = 1e-9  # rounding allowed around a neutral mode, whose growth per tick is 1

SIGNALS = (
    "master_position_m",
    "slave_position_m",
    "master_desired_position_m",
    "slave_desired_position_m",
    "master_force_n",
    "slave_force_n",
    "master_wave_out_sqrt_w",
    "master_wave_in_sqrt_w",
    "slave_wave_in_sqrt_w",
    "slave_wave_out_sqrt_w",
)

# Blocks are clocked in ticks, so that python-control never rounds a time in seconds.
PER_TICK = True


@dataclass(frozen=True)
class Order:
    """Which signals arrive one tick late inside a side, and whether the settled force is taken off."""

    decoder_force_late: bool
    pd_reference_late: bool
    encoder_force_late: bool
    takes_off_settled_force: bool = False


ORDERS = {
    "split": Order(True, False, False, takes_off_settled_force=True),
    "plain_split": Order(True, False, False),
    "implicit": Order(False, False, False),
    "printed": Order(False, True, False),
    "transformer_first": Order(True, False, True),
}


@dataclass(frozen=True)
class Side:
    """A device and the PD that drives it."""

    mass_kg: float
    device_damping_n_s_per_m: float
    stiffness_n_per_m: float
    pd_damping_n_s_per_m: float = 0.0


@dataclass(frozen=True)
class Loop:
    """All parameters of a two-sided loop. `wall_stiffness_n_per_m`: 0 is free, inf a clamped slave."""

    order: str
    forward_delay_ticks: int
    backward_delay_ticks: int
    master: Side
    slave: Side
    wall_stiffness_n_per_m: float = 0.0
    impedance_n_s_per_m: float = IMPEDANCE_NS_PER_M


def gain(name: str, value: float, source: str, target: str) -> control.StateSpace:
    return control.ss([], [], [], [[value]], PER_TICK, name=name, inputs=[source], outputs=[target])


def delay_line(name: str, ticks: int, source: str, target: str) -> control.StateSpace:
    """A shift register of `ticks` states; 0 ticks is a plain wire."""
    if ticks == 0:
        return gain(name, 1.0, source, target)
    enter, leave = np.zeros((ticks, 1)), np.zeros((1, ticks))
    enter[0, 0], leave[0, -1] = 1.0, 1.0
    shift = np.eye(ticks, k=-1)
    return control.ss(shift, enter, leave, [[0]], PER_TICK, name=name, inputs=[source], outputs=[target])


def device(name: str, side: Side, wall_stiffness_n_per_m: float, forces: list[str]) -> control.StateSpace:
    """Mass, damper and wall spring, discretised exactly for forces held over a tick."""
    position = f"{name}_position_m"
    if wall_stiffness_n_per_m == inf:
        nothing = np.zeros((1, len(forces)))
        return control.ss([], [], [], nothing, PER_TICK, name=f"{name}_device", inputs=forces, outputs=[position])
    continuous = control.ss(
        [[0, 1], [-wall_stiffness_n_per_m / side.mass_kg, -side.device_damping_n_s_per_m / side.mass_kg]],
        [[0] * len(forces), [1 / side.mass_kg] * len(forces)],
        [[1, 0]],
        [[0] * len(forces)],
    )
    held = control.sample_system(continuous, TICK_S, method="zoh")
    return control.ss(
        held.A, held.B, held.C, held.D, PER_TICK, name=f"{name}_device", inputs=forces, outputs=[position]
    )


def pd(name: str, side: Side) -> control.StateSpace:
    k, d = side.stiffness_n_per_m, side.pd_damping_n_s_per_m / TICK_S
    return control.ss(
        [[0]], [[1, -1]], [[-d]], [[k + d, -k - d]], PER_TICK, name=name, inputs=["reference", "position"],
        outputs=["pd_force"],
    )


def decoder(name: str, b: float) -> control.StateSpace:
    wave_step, force_step = TICK_S / b * sqrt(2 * b), TICK_S / b
    return control.ss(
        [[1]], [[wave_step, -force_step, 0]], [[1]], [[wave_step, -force_step, -force_step]], PER_TICK, name=name,
        inputs=["wave_in", "decoder_force", "settled_force"], outputs=["desired"],
    )


def settled_force(name: str, order: Order) -> control.StateSpace:
    """The force of the ticks before this one, without its fast part; nothing where the order takes none off."""
    if not order.takes_off_settled_force:
        return gain(name, 0.0, "force", "settled_force")
    return control.ss(
        [[1 - SETTLING]], [[SETTLING]], [[1]], [[0]], PER_TICK, name=name, inputs=["force"], outputs=["settled_force"]
    )


def encoder(name: str, b: float) -> control.StateSpace:
    return control.ss(
        [], [], [], [[1, -2 / sqrt(2 * b)]], PER_TICK, name=name, inputs=["wave_in", "encoder_force"],
        outputs=["wave_out"],
    )


def port(name: str, side: Side, order: Order, b: float) -> control.StateSpace:
    """PD and wave transformer of one side: (wave in, position) to (desired position, force, wave out).

    The PD's force re-enters through a linear fractional transformation, which solves the algebraic
    loop of the implicit order by a linear solve, not by a formula of ours.
    """
    opened = control.interconnect(
        [
            pd("pd", side),
            decoder("decoder", b),
            settled_force("settled_path", order),
            encoder("encoder", b),
            delay_line("reference_path", int(order.pd_reference_late), "desired", "reference"),
            delay_line("decoder_path", int(order.decoder_force_late), "force", "decoder_force"),
            delay_line("encoder_path", int(order.encoder_force_late), "force", "encoder_force"),
            gain("force_tap", 1.0, "force", "force_out"),
        ],
        inputs=["wave_in", "position", "force"],
        outputs=["desired", "force_out", "wave_out", "pd_force"],
        inplist=[
            "wave_in", "position", ["decoder_path.force", "encoder_path.force", "settled_path.force", "force_tap.force"]
        ],
        outlist=["desired", "force_out", "wave_out", "pd_force"],
    )
    closed = opened.lft(gain("wire", 1.0, "pd_force", "force"), nu=1, ny=1)
    return control.ss(
        closed.A, closed.B, closed.C, closed.D, PER_TICK, name=f"{name}_port",
        inputs=[f"{name}_wave_in_sqrt_w", f"{name}_position_m"],
        outputs=[f"{name}_desired_position_m", f"{name}_force_n", f"{name}_wave_out_sqrt_w"],
    )


def build(loop: Loop) -> control.StateSpace:
    """The whole loop, from `hand_force_n` to `SIGNALS`; blocks are joined by the names of their signals."""
    order = ORDERS[loop.order]
    return control.interconnect(
        [
            device("master", loop.master, 0.0, ["master_force_n", "hand_force_n"]),
            device("slave", loop.slave, loop.wall_stiffness_n_per_m, ["slave_force_n"]),
            port("master", loop.master, order, loop.impedance_n_s_per_m),
            port("slave", loop.slave, order, loop.impedance_n_s_per_m),
            delay_line("forward", loop.forward_delay_ticks, "master_wave_out_sqrt_w", "slave_wave_in_sqrt_w"),
            delay_line("backward", loop.backward_delay_ticks, "slave_wave_out_sqrt_w", "master_wave_in_sqrt_w"),
        ],
        inputs=["hand_force_n"],
        outputs=list(SIGNALS),
        name=loop.order,
    )


def simulate(system: control.StateSpace, hand_force_n: NDArray[np.float64]) -> NDArray[np.float64]:
    """Response from rest; row i is `SIGNALS[i]`, column k is tick k."""
    response = control.forced_response(system, np.arange(len(hand_force_n)), hand_force_n, squeeze=False)
    return np.asarray(response.outputs)


def spectral_radius(system: control.StateSpace) -> float:
    """Largest growth per tick of any mode."""
    return float(np.max(np.abs(np.linalg.eigvals(system.A))))
