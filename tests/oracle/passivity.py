"""When a side is passive, and how much device damping the two-sided loop really needs.

With h the tick, b the wave impedance, s the settling of `loop.py`, kappa = h K/b, d = D/b, w = 1 - 1/z,
g = kappa + d w and L = s / (1 - (1 - s)/z), the clamped port of split reflects 1 - 2 g / (w + (g/z) (1 + w L)).
That is at most 1 where

    Re(w (1/g - 1 + L/z)) >= 0                   D = 0: Re(w (1 - kappa + kappa L/z)) >= 0

On the unit circle the left side is y m(y) with y = sin^2(theta/2) and the margin

    m(y) = (kappa/2 + d) / (kappa^2/4 + y d (kappa + d)) - 2 + 2 s (2 + s - 4 y) / (s^2 + 4 (1 - s) y)

Plain split is s = 0; implicit keeps the first fraction alone. Both fractions fall with y, so the Nyquist
frequency, y = 1, decides. With k = h K/b + 2 D/b it asks, and that is enough, for

    a clamped port                k <= limit                limit = 1 - s/2 split, 1 plain split, none implicit
    a side with its device        damping >= b/m(y),        at y = 1: b/2 k / (1 - k/limit)

The device moves on while the force is held: it takes in F[k] (x[k+1] - x[k]), of which a damper B turns at
least (B/h) (x[k+1] - x[k])^2 into heat.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import inf, pi, sqrt
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from check import require, require_close
from loop import (
    IMPEDANCE_NS_PER_M,
    NEUTRAL,
    ORDERS,
    SETTLING,
    TICK_S,
    Loop,
    Side,
    build,
    delay_line,
    device,
    port,
    spectral_radius,
)

LIMITS = {"split": 1 - SETTLING / 2, "plain_split": 1.0, "implicit": inf}

# Up to and with the Nyquist frequency; near 0 every port is lossless within rounding.
ANGLES = np.linspace(0.02, pi, 200)
STIFFNESSES_N_PER_M = (3000.0, 5000.0)
MASSES_KG = ((0.01, 0.01), (0.05, 0.5), (0.6, 0.5))
WALLS_N_PER_M = (0.0, 1e4)
DELAYS_TICKS = sorted(range(1, 51), key=lambda n: n % 7)  # mixed, so that the search meets a bad one early
LEAST_DAMPING_NS_PER_M = 0.01


def clamped_side(kappa: float, pd_damping_by_impedance: float) -> Side:
    """A side with these gains; its device does not matter."""
    stiffness, damping = kappa * IMPEDANCE_NS_PER_M / TICK_S, pd_damping_by_impedance * IMPEDANCE_NS_PER_M
    return Side(mass_kg=1.0, device_damping_n_s_per_m=0.0, stiffness_n_per_m=stiffness, pd_damping_n_s_per_m=damping)


def margin(order: str, side: Side, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """m(y) of the head of this file."""
    y = np.sin(angles / 2) ** 2
    kappa, d = TICK_S * side.stiffness_n_per_m / IMPEDANCE_NS_PER_M, side.pd_damping_n_s_per_m / IMPEDANCE_NS_PER_M
    control_part = (kappa / 2 + d) / (kappa**2 / 4 + y * d * (kappa + d))
    if order == "implicit":
        return control_part
    s = SETTLING if ORDERS[order].takes_off_settled_force else 0.0
    return control_part - 2 + 2 * s * (2 + s - 4 * y) / (s**2 + 4 * (1 - s) * y)


def passive_damping(order: str, side: Side) -> float:
    """Device damping that makes a side passive; the gains must be below the limit."""
    k = (TICK_S * side.stiffness_n_per_m + 2 * side.pd_damping_n_s_per_m) / IMPEDANCE_NS_PER_M
    return IMPEDANCE_NS_PER_M / 2 * k / (1 - k / LIMITS[order])


@cache
def device_port(order: str, side: Side) -> control.StateSpace:
    """(wave in, position) to (wave out, force) of one side."""
    return port("side", side, ORDERS[order], IMPEDANCE_NS_PER_M)[[2, 1], [0, 1]]


def reflection_peak(order: str, side: Side) -> float:
    """Largest wave a clamped side sends back, per wave that comes in."""
    return float(np.max(np.abs(device_port(order, side)(np.exp(1j * ANGLES))[0, 0])))


def needed_damping(order: str, side: Side, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least device damping that lets no energy out at a frequency, whatever wave and movement come together.

    The energy balance of a tick is a Hermitian form in the wave and the movement y = x[k+1] - x[k].
    """
    z = np.exp(1j * angles)
    (wave_by_wave, wave_by_position), (force_by_wave, force_by_position) = device_port(order, side)(z)
    wave_by_move, force_by_move = wave_by_position / (z - 1), force_by_position / (z - 1)
    wave_only = TICK_S / 2 * (1 - np.abs(wave_by_wave) ** 2)
    mixed = -TICK_S / 2 * np.conj(wave_by_wave) * wave_by_move - np.conj(force_by_wave) / 2
    move_only = -TICK_S / 2 * np.abs(wave_by_move) ** 2 - np.real(force_by_move)
    needed: NDArray[np.float64] = TICK_S * (np.abs(mixed) ** 2 / wave_only - move_only)
    return needed


def threshold(is_above: Callable[[float], bool], low: float, high: float, precision: float) -> float:
    """The least value where `is_above` holds, by bisection of the ratio; it must hold at `high` and not at `low`."""
    while high > low * (1 + precision):
        middle = sqrt(low * high)
        low, high = (low, middle) if is_above(middle) else (middle, high)
    return high


def clamped_rows() -> list[dict[str, Any]]:
    """Largest h K/b for which the clamped port is passive, over the PD's damping."""
    rows = []
    for order in ("split", "plain_split"):
        for share in (0.0, 0.1, 0.2, 0.3, 0.4):

            def is_active(kappa: float, order: str = order, share: float = share) -> bool:
                return reflection_peak(order, clamped_side(kappa, share)) > 1 + 1e-12

            computed, expected = threshold(is_active, 0.01, 2.0, 1e-7), LIMITS[order] - 2 * share
            require_close(f"largest passive h K/b, {order}, D/b = {share}", computed, expected, 1e-6)
            rows.append(
                {
                    "order": order,
                    "pd_damping_by_impedance": share,
                    "largest_kappa": expected,
                    "computed_largest_kappa": computed,
                }
            )
    for kappa in (0.01, 0.1, 1.0, 10.0, 100.0):
        for share in (0.0, 1.0, 10.0):
            peak = reflection_peak("implicit", clamped_side(kappa, share))
            require(peak <= 1 + NEUTRAL, f"implicit reflects {peak!r} at h K/b = {kappa}, D/b = {share}")
    return rows


def needed_damping_rows() -> list[dict[str, Any]]:
    """Device damping for passivity: the most over all frequencies, and at some of them."""
    frequencies_hz = np.array([10.0, 50.0, 80.0, 100.0, 200.0, 300.0, 400.0, 500.0])
    rows = []
    for order in LIMITS:
        for stiffness in STIFFNESSES_N_PER_M:
            for damping in (0.0, 1.0):
                side = Side(1.0, 0.0, stiffness, damping)
                what = f"{order}, K {stiffness}, D {damping}"
                needed, expected = needed_damping(order, side, ANGLES), passive_damping(order, side)
                difference = float(np.max(np.abs(needed - IMPEDANCE_NS_PER_M / margin(order, side, ANGLES))))
                require_close(f"needed damping at every frequency, {what}", difference, 0.0, 1e-6)
                require_close(f"needed damping, {what}", float(np.max(needed)), expected, 1e-6)
                rows.append(
                    {
                        "order": order,
                        "stiffness_n_per_m": stiffness,
                        "pd_damping_n_s_per_m": damping,
                        "passive_damping_n_s_per_m": expected,
                        "computed_passive_damping_n_s_per_m": float(np.max(needed)),
                        "frequencies_hz": frequencies_hz.tolist(),
                        "needed_damping_n_s_per_m": needed_damping(
                            order, side, 2 * pi * TICK_S * frequencies_hz
                        ).tolist(),
                    }
                )
    return rows


@cache
def reflection(order: str, side: Side, wall_stiffness_n_per_m: float) -> control.StateSpace:
    """Wave in to wave out of a side with its device."""
    moved = device("side", side, wall_stiffness_n_per_m, ["force"])
    without_device_damping = replace(side, device_damping_n_s_per_m=0.0)
    return device_port(order, without_device_damping).lft(moved, nu=1, ny=1)


def growth_per_tick(loop: Loop) -> float:
    """The spectral radius of `build(loop)`, faster: two reflections joined by the line."""
    forward = delay_line("forward", loop.forward_delay_ticks, "sent", "received")
    backward = delay_line("backward", loop.backward_delay_ticks, "sent", "received")
    master = reflection(loop.order, loop.master, 0.0)
    slave = reflection(loop.order, loop.slave, loop.wall_stiffness_n_per_m)
    return spectral_radius(control.feedback(forward * master, backward * slave, sign=1))


def damped(loop: Loop, damping_n_s_per_m: float, delay_ticks: int) -> Loop:
    """The loop with this device damping on both sides and this delay each way."""
    return replace(
        loop,
        forward_delay_ticks=delay_ticks,
        backward_delay_ticks=delay_ticks,
        master=replace(loop.master, device_damping_n_s_per_m=damping_n_s_per_m),
        slave=replace(loop.slave, device_damping_n_s_per_m=damping_n_s_per_m),
    )


def smallest_damping(loop: Loop, enough_n_s_per_m: float) -> tuple[float, int]:
    """Least device damping on both sides that keeps the loop from growing, and the delay that asks for it."""
    smallest, worst = LEAST_DAMPING_NS_PER_M, 0
    for n in DELAYS_TICKS:

        def is_stable(damping: float, n: int = n) -> bool:
            return growth_per_tick(damped(loop, damping, n)) <= 1 + NEUTRAL

        if not is_stable(smallest):
            require(is_stable(enough_n_s_per_m), f"{loop.order}, {n} ticks: grows with {enough_n_s_per_m} N s/m")
            near = min(1.1 * smallest, enough_n_s_per_m)
            smallest, worst = threshold(is_stable, smallest, near if is_stable(near) else enough_n_s_per_m, 1e-3), n
    require(worst > 0, f"{loop.order}: stable with next to no device damping")
    for share, grows in ((1.0, False), (0.99, True)):
        radius = spectral_radius(build(damped(loop, share * smallest, worst)))
        require(
            (radius > 1 + NEUTRAL) == grows,
            f"{loop.order}, {worst} ticks: spectral radius {radius!r} at {share} of the smallest damping",
        )
    return smallest, worst


def damping_bound_rows() -> list[dict[str, Any]]:
    """The device damping the loop needs, next to the damping that makes it passive."""
    rows = []
    for order in LIMITS:
        for stiffness in STIFFNESSES_N_PER_M:
            for master_kg, slave_kg in MASSES_KG:
                for wall in WALLS_N_PER_M:
                    master, slave = (Side(mass, 0.0, stiffness) for mass in (master_kg, slave_kg))
                    passive = passive_damping(order, master)
                    smallest, worst = smallest_damping(Loop(order, 1, 1, master, slave, wall), passive)
                    rows.append(
                        {
                            "order": order,
                            "stiffness_n_per_m": stiffness,
                            "master_mass_kg": master_kg,
                            "slave_mass_kg": slave_kg,
                            "wall_stiffness_n_per_m": wall,
                            "smallest_damping_n_s_per_m": smallest,
                            "at_delay_ticks": worst,
                            "passive_damping_n_s_per_m": passive,
                        }
                    )
    return rows
