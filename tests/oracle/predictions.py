"""Closed forms of the wave-variable loop, each next to the value python-control computes.

With h the tick, b the wave impedance, kappa = h K / b and T = (n1 + n2) h / 2 the mean one-way delay:

    perceived stiffness       1/K_perceived = 1/Km + 1/Ks + T/b + 1/Ke
    offset at speed V    xm - xs  = F (1/Km + 1/Ks + T/b) + V (n1 - n2) h / 2     F = Bs V
    apparent mass        M        = Mm + Ms + b T - Bs^2 (1/Km + 1/Ks + T/b)

They hold for split and implicit alike: once its settled force has settled, a port of either stretches
by F/K. A plain split decodes with the force of the last tick and takes no settled force off, which
makes it the implicit order with K/(1 - kappa) in place of K (D = 0): it feels too stiff.

The offset between the *decoded* (desired) positions leaves the PDs' own 1/K out. The apparent mass is
the lag of a step response behind its asymptote: x(t) -> V (t - M / (Bm + Bs)). Passivity: `passivity.py`.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from math import inf
from typing import Any

import control
import numpy as np

from check import require, require_close
from loop import IMPEDANCE_NS_PER_M, NEUTRAL, TICK_S, Loop, Side, build, simulate, spectral_radius
from passivity import clamped_rows, damping_bound_rows, needed_damping_rows

MASTER = Side(mass_kg=0.1, device_damping_n_s_per_m=8.0, stiffness_n_per_m=3000.0)
SLAVE = Side(mass_kg=0.5, device_damping_n_s_per_m=8.0, stiffness_n_per_m=5000.0)
CURED = ("split", "implicit")
DIVERGING = ("printed", "transformer_first")
STIFF_WALL_N_PER_M = 1e4

# Growth per tick of the printed order, free, found independently of this script.
KNOWN_GROWTH = {1: 1.40097, 2: 1.20220, 5: 1.08118, 10: 1.04063, 20: 1.02032, 50: 1.00813}


def mean_delay_s(loop: Loop) -> float:
    return (loop.forward_delay_ticks + loop.backward_delay_ticks) * TICK_S / 2


def line_compliance(loop: Loop) -> float:
    """Between the two devices: both PDs and the line."""
    springs = 1 / loop.master.stiffness_n_per_m + 1 / loop.slave.stiffness_n_per_m
    return springs + mean_delay_s(loop) / loop.impedance_n_s_per_m


def perceived_stiffness(loop: Loop) -> float:
    return 1 / (line_compliance(loop) + 1 / loop.wall_stiffness_n_per_m)


def offset_at_speed(loop: Loop, speed_m_per_s: float) -> float:
    asymmetry_s = (loop.forward_delay_ticks - loop.backward_delay_ticks) * TICK_S / 2
    force_n = loop.slave.device_damping_n_s_per_m * speed_m_per_s
    return force_n * line_compliance(loop) + speed_m_per_s * asymmetry_s


def apparent_mass(loop: Loop) -> float:
    masses = loop.master.mass_kg + loop.slave.mass_kg + loop.impedance_n_s_per_m * mean_delay_s(loop)
    return masses - loop.slave.device_damping_n_s_per_m**2 * line_compliance(loop)


def as_implicit(loop: Loop) -> Loop:
    """The implicit loop that makes the same forces as this plain split one: K/(1 - kappa) in place of K."""
    master, slave = (
        replace(side, stiffness_n_per_m=1 / (1 / side.stiffness_n_per_m - TICK_S / loop.impedance_n_s_per_m))
        for side in (loop.master, loop.slave)
    )
    return replace(loop, order="implicit", master=master, slave=slave)


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


def weakly_damped_rows() -> list[dict[str, Any]]:
    """Largest eigenvalue beside the neutral ones, of loops that hardly any damping holds together: many grow in contact."""
    rows = []
    for order in CURED:
        for forward, backward in ((1, 1), (5, 4), (13, 12), (50, 49)):
            for hand, slave_kg, slave_damping, wall in (
                (0.5, 0.05, 2.0, 1e5),
                (0.5, 0.2, 2.0, 1e4),
                (10.0, 0.2, 10.0, 1e4),
                (0.5, 0.1, 1.0, 3e4),
            ):
                master = Side(mass_kg=0.1, device_damping_n_s_per_m=0.5 + hand, stiffness_n_per_m=3000.0)
                slave = Side(mass_kg=slave_kg, device_damping_n_s_per_m=slave_damping, stiffness_n_per_m=5000.0)
                row = {
                    "order": order,
                    "forward_delay_ticks": forward,
                    "backward_delay_ticks": backward,
                    "hand_damping_n_s_per_m": hand,
                    "slave": asdict(slave),
                    "wall_stiffness_n_per_m": wall,
                }
                for name, stiffness in (("free", 0.0), ("contact", wall)):
                    system = build(Loop(order, forward, backward, master, slave, stiffness))
                    sizes = [abs(value) for value in np.linalg.eigvals(system.A) if abs(value - 1) > 1e-5]
                    row[f"{name}_growth_per_tick"] = float(max(sizes))
                rows.append(row)
    return rows


def stiffness_rows(order: str, walls_n_per_m: tuple[float, ...]) -> list[dict[str, Any]]:
    """Perceived stiffness; computed as the response at a frequency so low that the loop only stretches."""
    slow = np.exp(1e-7j)
    rows = []
    for round_trip in (2, 11, 20, 22, 100, 200, 1000):
        for wall in walls_n_per_m:
            back = 1 if round_trip == 11 else round_trip // 2
            loop = Loop(order, round_trip - back, back, MASTER, SLAVE, wall)
            computed = float(1 / np.real(build(loop)(slow)[0, 0]))
            expected = perceived_stiffness(as_implicit(loop) if order == "plain_split" else loop)
            require_close(f"perceived stiffness, {order}, {round_trip} ticks", computed, expected, 1e-6 * expected)
            rows.append(
                {
                    "order": order,
                    "round_trip_ticks": round_trip,
                    "wall_stiffness_n_per_m": None if wall == inf else wall,
                    "perceived_stiffness_n_per_m": expected,
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
    light = replace(SLAVE, device_damping_n_s_per_m=4.0)
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
            damping = master.device_damping_n_s_per_m + slave.device_damping_n_s_per_m
            speed = hand_force_n / damping
            offset, mass = offset_at_speed(loop, speed), apparent_mass(loop)
            springs = 1 / master.stiffness_n_per_m + 1 / slave.stiffness_n_per_m
            decoded = offset - slave.device_damping_n_s_per_m * speed * springs
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


def plain_split() -> dict[str, Any]:
    """What the settled force cures: without it split is implicit with K/(1 - kappa), tick by tick."""
    hand = np.sin(np.arange(3000) * TICK_S * 9.0)
    loop = Loop("plain_split", 10, 1, MASTER, SLAVE, STIFF_WALL_N_PER_M)
    forces, other = (simulate(build(one), hand)[4:6] for one in (loop, as_implicit(loop)))
    difference = float(np.max(np.abs(forces - other)) / np.max(np.abs(forces)))
    require(difference < 1e-10, f"plain split and implicit with K/(1 - kappa) differ by {difference:g} of the force")
    return {
        "difference_from_implicit": difference,
        "perceived_stiffness": stiffness_rows("plain_split", (inf,)),
    }


def all_predictions() -> dict[str, Any]:
    """Everything `predictions.json` holds. Raises SelfCheckError where a closed form and the model disagree."""
    walls = (1e3, STIFF_WALL_N_PER_M, inf)
    sections: dict[str, Any] = {}
    for name, compute in (
        ("growth", growth_rows),
        ("stability", stability_rows),
        ("weakly_damped", weakly_damped_rows),
        ("passivity", lambda: {"clamped_port": clamped_rows(), "side_with_device": needed_damping_rows()}),
        ("damping_bounds", damping_bound_rows),
        ("perceived_stiffness", lambda: [row for order in CURED for row in stiffness_rows(order, walls)]),
        ("plain_split", plain_split),
        ("coasting", coasting_rows),
    ):
        print(f"predictions: {name}", flush=True)
        sections[name] = compute()
    return {
        "tick_s": TICK_S,
        "impedance_n_s_per_m": IMPEDANCE_NS_PER_M,
        "master": asdict(MASTER),
        "slave": asdict(SLAVE),
        "note": "growth, stability, perceived_stiffness and plain_split use `master` and `slave`; damping_bounds has the same"
        " gains and device damping on both sides, 1 to 50 ticks each way; a wall of null is rigid, 0 is none",
        **sections,
    }
