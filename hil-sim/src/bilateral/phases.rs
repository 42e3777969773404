//! When the hand guides, pushes and lets go.
//!
//! With the round trip `T`, wave impedance `b`, moving mass `M`, its damping `B` and controller stiffness `K` of the
//! master, contact settles to 1e-5 of the contact force within
//!
//! `ln(1e5) (2 M/B + 2 Ms/(Bs + Bw) + B/K_perceived + (Bs + Bw)/Ke) + T (55 + 8 max(B/b, b/B, K M/(B b)))`.
//!
//! The first sum is the time constants of master, slave at the wall, hand against the perceived spring `1/K_perceived =
//! 1/K + T/(2 b) + 1/Ks + 1/Ke`, and slave against the wall's own, which counts where that is soft. The second is
//! echoes: an impact leaves a wave between wall and hand, and each round trip it loses what the hand's side does not
//! reflect. That side has the impedance `B` to a slow wave and `K M/B` at the resonance `sqrt(K/M)`; `Z` reflects
//! `(b - Z)/(b + Z)`, so the number of round trips grows with the larger of `Z/b` and `b/Z`. 55 and 8 are an upper
//! envelope over 6088 simulated contacts at 2 to 1000 ticks (b 5 to 20, K and Ks 1000 to 5000, M 0.1 and 0.15 kg, B
//! 5 to 20, Ke 1e3 to rigid, split and implicit form): none took more than 96 % of its time, and the shipped gains
//! and masses take less than half. A hand above 0.2 kg on a rigid wall may need more.
//!
//! Passive to the robot (split form) is what damps each port by at least `h K/(2 (1 - h K/b))`: 2.1 and 5.0 `N s/m`
//! with the paper's gains. The shipped hand and slave have 10.5 and 10.

use std::ops::Range;

use crate::bilateral::chain::{Chain, Controller};
use crate::plant::HandPhase;
use crate::scenario::Scenario;

/// Settled means within 1e-5: `ln(1e5)` time constants.
const TIME_CONSTANTS: f64 = 11.513;
/// Round trips that the weakly damped middle frequencies need, whatever the hand.
const ROUND_TRIPS: f64 = 55.0;
/// Further round trips per unit of mismatch.
const ROUND_TRIPS_PER_MISMATCH: f64 = 8.0;
/// One leg of the free path without delay, `s`.
const LEG_S: f64 = 1.2;
/// At rest after the free path, without delay, `s`.
const REST_S: f64 = 0.3;
/// Longest wait for the slave to reach the wall without delay, `s`: a feeble push is not worth more.
const LONGEST_APPROACH_S: f64 = 60.0;
/// Longest settling that is waited for, `s`: without damping or stiffness nothing settles at all.
const LONGEST_SETTLING_S: f64 = 600.0;
/// How long the settled contact is watched, without delay, `s`.
const WATCH_S: f64 = 0.5;
/// Released, without delay, `s`.
const RELEASE_S: f64 = 1.5;

/// The phases of a run, each from the end of the one before it, `s`.
#[derive(Debug, Clone, PartialEq)]
pub struct Phases {
    /// One leg of the free path: the hand goes out, across and back.
    pub leg_s: f64,
    /// The hand's push begins.
    pub contact_start_s: f64,
    /// The contact force has settled.
    pub settled_s: f64,
    /// The hand lets go.
    pub release_s: f64,
    /// Nothing more happens.
    pub end_s: f64,
}

impl Phases {
    /// The phases of a scenario whose schemes make this chain, over a link of this round trip.
    #[must_use]
    pub fn new(scenario: &Scenario, chain: &Chain, link_round_trip_ticks: u32) -> Self {
        let Scenario { link, .. } = scenario;
        let late_ticks = [link.jitter_ticks.saturating_mul(2), chain.delay_ticks().unwrap_or(0)]
            .into_iter()
            .fold(link_round_trip_ticks, u32::saturating_add);
        let round_trip_s = f64::from(late_ticks) * scenario.sample_period_s;
        let leg_s = LEG_S + round_trip_s;
        let contact_start_s = 3.0 * leg_s + REST_S + 2.0 * round_trip_s;
        let settled_s = contact_start_s
            + approach_s(scenario, chain, round_trip_s)
            + settling_s(scenario, chain, round_trip_s);
        let release_s = settled_s + WATCH_S + round_trip_s;
        Self {
            leg_s,
            contact_start_s,
            settled_s,
            release_s,
            end_s: release_s + RELEASE_S + 4.0 * round_trip_s,
        }
    }

    /// When the settled contact can be measured, `s`.
    #[must_use]
    pub fn settled(&self) -> Range<f64> {
        self.settled_s..self.release_s
    }

    /// What the hand does on `axis` of `scenario`. An axis without a contact force is held after the free path.
    #[must_use]
    pub fn hand(&self, scenario: &Scenario, axis: usize) -> Vec<HandPhase> {
        let Self { leg_s, contact_start_s, release_s, end_s, .. } = *self;
        let out_m = scenario.hand.path_amplitude_m;
        let leg = |number: f64, from_m: f64, to_m: f64| HandPhase::Move {
            start_s: number * leg_s,
            end_s: (number + 1.0) * leg_s,
            from_m,
            to_m,
        };
        let mut phases = vec![leg(0.0, 0.0, out_m), leg(1.0, out_m, -out_m), leg(2.0, -out_m, 0.0)];
        let rest_s = 3.0 * leg_s;
        let force_n = scenario.contact_force_n(axis);
        if force_n.abs() > 0.0 {
            phases.push(HandPhase::Hold { start_s: rest_s, end_s: contact_start_s, target_m: 0.0 });
            phases.push(HandPhase::Push { start_s: contact_start_s, end_s: release_s, force_n });
            phases.push(HandPhase::Release { start_s: release_s, end_s });
        } else {
            phases.push(HandPhase::Hold { start_s: rest_s, end_s, target_m: 0.0 });
        }
        phases
    }
}

/// Moving mass (`kg`) and damping (`N s/m`) of the hand and what it holds.
fn held(scenario: &Scenario) -> (f64, f64) {
    let (hand, device) = (&scenario.hand, &scenario.master.device);
    (hand.mass_kg + device.mass_kg, hand.damping_ns_per_m + device.damping_ns_per_m)
}

/// From the first push until every pushed axis has crossed to what it meets, at the speed `F/(B + Bs)`.
fn approach_s(scenario: &Scenario, chain: &Chain, round_trip_s: f64) -> f64 {
    let (mass_kg, damping_ns_per_m) = held(scenario);
    let drag_ns_per_m = damping_ns_per_m + scenario.slave.device.damping_ns_per_m;
    let crossing_s = chain.obstacles.iter().enumerate().filter_map(|(axis, obstacle)| {
        let force_n = scenario.contact_force_n(axis);
        let distance_m = obstacle.as_ref()?.surface_m * force_n.signum();
        (force_n.abs() > 0.0).then(|| distance_m.max(0.0) * drag_ns_per_m / force_n.abs())
    });
    let start_s = 2.0 * ratio(mass_kg, damping_ns_per_m);
    crossing_s.fold(start_s, |longest_s, s| longest_s.max(start_s + s)).min(LONGEST_APPROACH_S)
        + 3.0 * round_trip_s
}

/// The formula at the head of this file, for the axis that takes longest.
fn settling_s(scenario: &Scenario, chain: &Chain, round_trip_s: f64) -> f64 {
    let longest_s = (0..scenario.dof).map(|axis| axis_settling_s(scenario, chain, axis, round_trip_s));
    longest_s.fold(0.0, f64::max).min(LONGEST_SETTLING_S)
}

/// What a chain lacks adds nothing; without waves, echoes die as on a matched line.
fn axis_settling_s(scenario: &Scenario, chain: &Chain, axis: usize, round_trip_s: f64) -> f64 {
    let (mass_kg, damping_ns_per_m) = held(scenario);
    let stiffness = |controller: &Controller| controller.stiffness_n_per_m.get(axis).copied();
    let (master, slave) = (stiffness(&chain.master), stiffness(&chain.slave));
    let obstacle = chain.obstacles.get(axis).copied().flatten();
    let impedance_ns_per_m = chain.master.impedance_ns_per_m;
    let springs = [master, slave, obstacle.map(|obstacle| obstacle.stiffness_n_per_m)];
    let springs_m_per_n: f64 = springs.into_iter().flatten().map(|n_per_m| ratio(1.0, n_per_m)).sum();
    let perceived_m_per_n = springs_m_per_n + impedance_ns_per_m.map_or(0.0, |b| 0.5 * round_trip_s / b);
    let slave_damping_ns_per_m =
        scenario.slave.device.damping_ns_per_m + obstacle.map_or(0.0, |obstacle| obstacle.damping_ns_per_m);
    let time_constants_s = 2.0 * ratio(mass_kg, damping_ns_per_m)
        + 2.0 * ratio(scenario.slave.device.mass_kg, slave_damping_ns_per_m)
        + damping_ns_per_m * perceived_m_per_n
        + obstacle.map_or(0.0, |obstacle| ratio(slave_damping_ns_per_m, obstacle.stiffness_n_per_m));
    let mismatch = impedance_ns_per_m.map_or(1.0, |b| {
        let slow = ratio(damping_ns_per_m, b);
        let resonant = ratio(master.unwrap_or(0.0) * mass_kg, damping_ns_per_m * b);
        slow.max(ratio(1.0, slow)).max(resonant)
    });
    let echoes_s = round_trip_s * (ROUND_TRIPS + ROUND_TRIPS_PER_MISMATCH * mismatch);
    TIME_CONSTANTS * time_constants_s + echoes_s
}

/// A quotient that is a number even for 0/0.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    numerator / denominator.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "neighbouring phases share the number")]
mod tests {
    use super::{Chain, Controller, HandPhase, Phases, Scenario};
    use crate::link::Carrier;

    /// The shipped gains, without delay modules.
    fn phases(scenario: &Scenario) -> Phases {
        let controller = |stiffness_n_per_m| Controller {
            stiffness_n_per_m: vec![stiffness_n_per_m; scenario.dof],
            impedance_ns_per_m: Some(10.0),
            delay_ticks: Some(0),
            playout_ticks: 0,
            losing_policy: None,
        };
        let chain = Chain::new(scenario, controller(3000.0), controller(5000.0)).unwrap();
        Phases::new(scenario, &chain, Carrier::new(scenario).unwrap().round_trip_ticks())
    }

    fn with_round_trip(ticks: u32) -> Scenario {
        let mut scenario = Scenario::default();
        scenario.link.forward_delay_ticks = ticks / 2;
        scenario.link.backward_delay_ticks = ticks - ticks / 2;
        scenario
    }

    #[test]
    fn the_usual_run_is_short_and_a_second_of_delay_stretches_it() {
        let usual_s = phases(&with_round_trip(22)).end_s;
        assert!((8.0..15.0).contains(&usual_s), "{usual_s}");
        let ends: Vec<f64> =
            [2, 11, 20, 22, 100, 200, 1000].map(|ticks| phases(&with_round_trip(ticks)).end_s).to_vec();
        assert!(ends.is_sorted(), "{ends:?}");
        assert!(ends.iter().all(|end_s| *end_s < 120.0), "{ends:?}");
    }

    /// Seconds from the push to 1e-5 of settled, simulated outside this program: the shipped gains and masses, 2 N,
    /// wall of 1e3, 1e4 and rigid.
    #[test]
    fn the_settled_phase_begins_after_simulated_contacts_have_settled() {
        let simulated = [(22, [1.30, 1.14, 1.50]), (200, [5.93, 5.43, 7.40]), (1000, [28.3, 24.3, 35.3])];
        for (ticks, settled_s) in simulated {
            for (stiffness_n_per_m, settled_s) in [1e3, 1e4, f64::INFINITY].into_iter().zip(settled_s) {
                let mut scenario = with_round_trip(ticks);
                scenario.environments.wall.stiffness_n_per_m = stiffness_n_per_m;
                let phases = phases(&scenario);
                let given_s = phases.settled_s - phases.contact_start_s;
                assert!(given_s > settled_s, "{ticks} ticks: {given_s} s for {settled_s} s");
            }
        }
    }

    #[test]
    fn nothing_that_never_settles_makes_a_run_endless() {
        let mut scenario = Scenario::default();
        scenario.hand.damping_ns_per_m = 0.0;
        scenario.master.device.damping_ns_per_m = 0.0;
        scenario.hand.contact_force_n = vec![1e-9];
        let limp = Controller { stiffness_n_per_m: vec![0.0], ..Controller::default() };
        let chain = Chain::new(&scenario, limp.clone(), limp).unwrap();
        let end_s = Phases::new(&scenario, &chain, 2).end_s;
        assert!(end_s < 700.0, "{end_s}");
    }

    #[test]
    fn the_hand_acts_without_a_gap_and_pushes_only_where_it_should() {
        let scenario = Scenario::default();
        let phases = phases(&scenario);
        let push = |axis: usize| {
            phases.hand(&scenario, axis).into_iter().find_map(|phase| match phase {
                HandPhase::Push { start_s, end_s, force_n } => Some((start_s, end_s, force_n)),
                _ => None,
            })
        };
        assert_eq!(push(0), Some((phases.contact_start_s, phases.release_s, 2.0)));
        assert_eq!(push(1), Some((phases.contact_start_s, phases.release_s, 1.0)));
        assert_eq!(push(2), None);
        for axis in 0..scenario.dof {
            let mut at_s = 0.0;
            for phase in phases.hand(&scenario, axis) {
                let (start_s, end_s) = phase.span_s();
                assert_eq!(start_s, at_s);
                assert!(end_s > start_s);
                at_s = end_s;
            }
            assert_eq!(at_s, phases.end_s);
        }
    }
}
