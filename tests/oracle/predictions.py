"""Closed forms of the wave-variable loop, each next to the value python-control computes.

With h the tick, b the wave impedance, kappa = h K / b and T = (n1 + n2) h / 2 the mean one-way delay:

    port compliance      c = 1/K        implicit
                         c = 1/K - h/b  split: it decodes with the force of the last tick, which makes
                                        it the implicit order with K/(1 - kappa) in place of K (D = 0)
    felt stiffness       1/K_felt = cm + cs + T/b + 1/Ke
    offset at speed V    xm - xs  = F (cm + cs + T/b) + V (n1 - n2) h / 2         F = Bs V
    apparent mass        M        = Mm + Ms + b T - Bs^2 (cm + cs + T/b)
    passive if           device damping >= h / (2 c)  on both sides               (D = 0)

The offset between the *decoded* positions leaves the PDs' own 1/K out: F (T/b) for implicit and
F (T/b - 2 h/b) for split. The apparent mass is the lag of a step response behind its asymptote:
x(t) -> V (t - M / (Bm + Bs)).
"""

from __future__ import annotations

from dataclasses import asdict, replace
from math import inf
from typing import Any

import control
import numpy as np

from check import require, require_close
from loop import IMPEDANCE_NS_PER_M, TICK_S, Loop, Side, build, simulate, spectral_radius

MASTER = Side(mass_kg=0.1, device_damping_ns_per_m=8.0, stiffness_n_per_m=3000.0)
SLAVE = Side(mass_kg=0.5, device_damping_ns_per_m=8.0, stiffness_n_per_m=5000.0)
CURED = ("split", "implicit")
DIVERGING = ("printed", "transformer_first")
STIFF_WALL_N_PER_M = 1e4
NEUTRAL = 1e-9  # rounding allowed around the neutral mode at 1

# Growth per tick of the printed order, free, found independently of this script.
KNOWN_GROWTH = {1: 1.40097, 2: 1.20220, 5: 1.08118, 10: 1.04063, 20: 1.02032, 50: 1.00813}


def port_compliance(order: str, stiffness_n_per_m: float) -> float:
    late_force = TICK_S / IMPEDANCE_NS_PER_M if order == "split" else 0.0
    return 1 / stiffness_n_per_m - late_force


def line_compliance(loop: Loop) -> float:
    """Between the two devices: both PDs and the line."""
    mean_delay_s = (loop.forward_delay_ticks + loop.backward_delay_ticks) * TICK_S / 2
    ports = sum(port_compliance(loop.order, side.stiffness_n_per_m) for side in (loop.master, loop.slave))
    return ports + mean_delay_s / loop.impedance_ns_per_m


def felt_stiffness(loop: Loop) -> float:
    return 1 / (line_compliance(loop) + 1 / loop.wall_stiffness_n_per_m)


def offset_at_speed(loop: Loop, speed_m_per_s: float) -> float:
    asymmetry_s = (loop.forward_delay_ticks - loop.backward_delay_ticks) * TICK_S / 2
    force_n = loop.slave.device_damping_ns_per_m * speed_m_per_s
    return force_n * line_compliance(loop) + speed_m_per_s * asymmetry_s


def apparent_mass(loop: Loop) -> float:
    mean_delay_s = (loop.forward_delay_ticks + loop.backward_delay_ticks) * TICK_S / 2
    masses = loop.master.mass_kg + loop.slave.mass_kg + loop.impedance_ns_per_m * mean_delay_s
    return masses - loop.slave.device_damping_ns_per_m**2 * line_compliance(loop)


def passive_damping(order: str, side: Side) -> float:
    return TICK_S / 2 / port_compliance(order, side.stiffness_n_per_m)


def growth_rows() -> list[dict[str, Any]]:
    """Spectral radius of the two orders that diverge, free and in contact."""
    rows = []
    for order in DIVERGING:
        for n, known in KNOWN_GROWTH.items():
            for wall in (0.0, STIFF_WALL_N_PER_M):
                radius = spectral_radius(build(Loop(order, n, n, MASTER, SLAVE, wall)))
                require_close(f"growth per tick, {order}, {n} ticks each way", radius, known, 6e-6)
                rows.append(
                    {"order": order, "delay_ticks": n, "wall_stiffness_n_per_m": wall, "growth_per_tick": radius}
                )
    return rows


def stability_rows() -> list[dict[str, Any]]:
    """Spectral radius of the two orders that do not, up to one second of round trip."""
    rows = []
    for order in CURED:
        for n in (1, 2, 5, 10, 20, 50, 100, 200, 500):
            for wall in (0.0, STIFF_WALL_N_PER_M):
                radius = spectral_radius(build(Loop(order, n, n, MASTER, SLAVE, wall)))
                require_close(f"spectral radius, {order}, {n} ticks each way, wall {wall} N/m", radius, 1.0, NEUTRAL)
                rows.append(
                    {"order": order, "delay_ticks": n, "wall_stiffness_n_per_m": wall, "spectral_radius": radius}
                )
    return rows


def damping_bound_rows() -> list[dict[str, Any]]:
    """Device damping h/(2c) on both sides is enough; a third of it is not, for at least one delay."""
    rows = []
    for order in CURED:
        for share in (1.0, 1 / 3):
            master, slave = (
                replace(side, device_damping_ns_per_m=share * passive_damping(order, side)) for side in (MASTER, SLAVE)
            )
            radii = {n: spectral_radius(build(Loop(order, n, n, master, slave))) for n in (1, 2, 5, 10, 50)}
            worst = max(radii.values())
            require(
                abs(worst - 1) <= NEUTRAL if share == 1.0 else worst > 1 + 1e-6,
                f"{order}: spectral radius {worst!r} at {share:.3f} of the passive damping",
            )
            rows.append(
                {
                    "order": order,
                    "share_of_bound": share,
                    "master_damping_ns_per_m": master.device_damping_ns_per_m,
                    "slave_damping_ns_per_m": slave.device_damping_ns_per_m,
                    "spectral_radius_by_delay_ticks": radii,
                }
            )
    return rows


def stiffness_rows() -> list[dict[str, Any]]:
    """Felt stiffness; computed as the response at a frequency so low that the loop only stretches."""
    slow = np.exp(1e-7j)
    rows = []
    for order in CURED:
        for round_trip in (2, 11, 20, 22, 100, 200, 1000):
            for wall in (1e3, STIFF_WALL_N_PER_M, inf):
                back = 1 if round_trip == 11 else round_trip // 2
                loop = Loop(order, round_trip - back, back, MASTER, SLAVE, wall)
                computed = float(1 / np.real(build(loop)(slow)[0, 0]))
                expected = felt_stiffness(loop)
                require_close(f"felt stiffness, {order}, {round_trip} ticks", computed, expected, 1e-6 * expected)
                rows.append(
                    {
                        "order": order,
                        "round_trip_ticks": round_trip,
                        "wall_stiffness_n_per_m": None if wall == inf else wall,
                        "felt_stiffness_n_per_m": expected,
                        "computed_n_per_m": computed,
                    }
                )
    return rows


def settling_ticks(system: control.StateSpace) -> int:
    """Ticks until the slowest mode that decays at all is down to 1e-10."""
    sizes = np.abs(np.linalg.eigvals(system.A))
    return int(np.ceil(np.log(1e-10) / np.log(np.max(sizes[sizes < 1 - NEUTRAL]))))


def coasting_rows() -> list[dict[str, Any]]:
    """A constant hand force in free space: offset at speed, and apparent mass from the lag of the start."""
    hand_force_n = 1.0
    light = replace(SLAVE, device_damping_ns_per_m=4.0)
    held = replace(MASTER, mass_kg=0.6)
    rows = []
    for order in CURED:
        for forward, backward, master, slave in (
            (40, 4, MASTER, light),
            (5, 30, MASTER, light),
            (10, 1, held, SLAVE),
            (11, 11, held, SLAVE),
            (20, 20, held, SLAVE),
        ):
            loop = Loop(order, forward, backward, master, slave)
            system = build(loop)
            ticks = settling_ticks(system)
            signals = simulate(system, np.full(ticks + 1, hand_force_n))[:, -1]
            damping = master.device_damping_ns_per_m + slave.device_damping_ns_per_m
            speed = hand_force_n / damping
            offset, mass = offset_at_speed(loop, speed), apparent_mass(loop)
            decoded = offset - slave.device_damping_ns_per_m * speed * (
                1 / master.stiffness_n_per_m + 1 / slave.stiffness_n_per_m
            )
            computed_mass = float(damping * (ticks * TICK_S - signals[0] / speed))
            what = f"{order}, {forward}+{backward} ticks"
            require_close(f"offset at speed, {what}", float(signals[0] - signals[1]), offset, 1e-10)
            require_close(f"decoded offset at speed, {what}", float(signals[2] - signals[3]), decoded, 1e-10)
            require_close(f"apparent mass, {what}", computed_mass, mass, 1e-8)
            rows.append(
                {
                    "order": order,
                    "forward_delay_ticks": forward,
                    "backward_delay_ticks": backward,
                    "master": asdict(master),
                    "slave": asdict(slave),
                    "hand_force_n": hand_force_n,
                    "speed_m_per_s": speed,
                    "settled_after_ticks": ticks,
                    "position_offset_m": offset,
                    "decoded_offset_m": decoded,
                    "apparent_mass_kg": mass,
                    "computed_decoded_offset_m": float(signals[2] - signals[3]),
                    "computed_apparent_mass_kg": computed_mass,
                }
            )
    return rows


def require_orders_equivalent() -> float:
    """Split with gain K is implicit with K/(1 - kappa): same forces, tick by tick. Returns the difference."""
    hand = np.sin(np.arange(3000) * TICK_S * 9.0)
    split = Loop("split", 10, 1, MASTER, SLAVE, STIFF_WALL_N_PER_M)
    stiffer = [replace(s, stiffness_n_per_m=1 / port_compliance("split", s.stiffness_n_per_m)) for s in (MASTER, SLAVE)]
    forces = simulate(build(split), hand)[4:6]
    other = simulate(build(replace(split, order="implicit", master=stiffer[0], slave=stiffer[1])), hand)[4:6]
    difference = float(np.max(np.abs(forces - other)) / np.max(np.abs(forces)))
    require(difference < 1e-10, f"split and implicit with K/(1 - kappa) differ by {difference:g} of the force")
    return difference


def all_predictions() -> dict[str, Any]:
    """Everything `predictions.json` holds. Raises SelfCheckError where a closed form and the model disagree."""
    sections = {}
    for name, compute in (
        ("split_as_implicit_difference", require_orders_equivalent),
        ("growth", growth_rows),
        ("stability", stability_rows),
        ("damping_bounds", damping_bound_rows),
        ("felt_stiffness", stiffness_rows),
        ("coasting", coasting_rows),
    ):
        print(f"predictions: {name}", flush=True)
        sections[name] = compute()
    return {
        "tick_s": TICK_S,
        "impedance_ns_per_m": IMPEDANCE_NS_PER_M,
        "master": asdict(MASTER),
        "slave": asdict(SLAVE),
        "note": "growth, stability and felt_stiffness use `master` and `slave`; a wall of null is rigid, 0 is none",
        **sections,
    }
