//! Plans a press: a hand guides, pushes and releases, at times derived from the schemes.
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

use super::build;
use super::chain::{Chain, Controller};
use super::obstacle::Obstacle;
use crate::experiment::ExperimentError;
use crate::link::round_trip_ticks;
use crate::phases::Phases;
use crate::rig_file::{
    AxisSection, ControllerAxes, HAND, LOAD, MinimumJerk, MoveSection, PressSection, RigFile, Step,
};
use std::ops::Range;

/// Time constants until the contact is settled to 1e-5: `ln(1e5)`.
const TIME_CONSTANTS: f64 = 11.513;
/// Round trips for weakly damped middle frequencies, independent of the hand.
const ROUND_TRIPS: f64 = 55.0;
/// Additional round trips per unit of mismatch.
const ROUND_TRIPS_PER_MISMATCH: f64 = 8.0;
/// Time of a leg of the free path without delay, `s`.
const LEG_S: f64 = 1.2;
/// Rest after the free path without delay, `s`.
const REST_S: f64 = 0.3;
/// Maximum time for the slave to reach the wall without delay, `s`.
const LONGEST_APPROACH_S: f64 = 60.0;
/// Maximum settling time, `s`: without damping or stiffness a contact never settles.
const LONGEST_SETTLING_S: f64 = 600.0;
/// Observation time of the settled contact without delay, `s`.
const WATCH_S: f64 = 0.5;
/// Time after the release without delay, `s`.
const RELEASE_S: f64 = 1.5;

/// A planned press: participants and times.
#[derive(Debug, Clone)]
pub(super) struct Planned {
    pub(super) chain: Chain,
    pub(super) phases: Phases,
    pub(super) link_round_trip_ticks: u32,
    /// Constant force by axis, `N`.
    pub(super) forces_n: Vec<f64>,
}

/// Mass (`kg`) and damping (`N s/m`) of an axis, with those of its hand.
pub(super) fn moved_by(section: &AxisSection) -> (f64, f64) {
    let load = section.plant.as_ref().map(|plant| &plant.load);
    let own = load.map_or((1.0, 0.0), |load| (load.inertia, load.damping));
    section.hand.as_ref().map_or(own, |hand| (own.0 + hand.inertia, own.1 + hand.damping))
}

/// Parameters that determine the times of an axis.
struct PressedAxis {
    force_n: f64,
    /// Hand and master.
    held: (f64, f64),
    other: (f64, f64),
    obstacle: Option<Obstacle>,
}

/// Whether an axis has no obstacle in either direction.
fn meets_nothing(section: &AxisSection) -> bool {
    section.active_wall().is_none() && section.active_spring().is_none()
}

/// Returns the push on each axis; 0 without an obstacle.
pub(super) fn forces_n(press: &PressSection, other: &ControllerAxes<'_>) -> Vec<f64> {
    let wanted = press.force.iter().copied().chain(core::iter::repeat(0.0));
    other
        .sections()
        .zip(wanted)
        .map(|((_, met), force)| if meets_nothing(met) { 0.0 } else { force })
        .collect()
}

/// Plans a press with controllers created from its schemes; `None` without a press.
///
/// # Errors
/// A scheme is invalid, or recorded delays are unreadable.
pub(super) fn planned(file: &RigFile) -> Result<Option<Planned>, ExperimentError> {
    let Some(parts) = file.press_pair() else { return Ok(None) };
    let [hand, other] = &parts;
    let [one, two] = [hand, other]
        .map(|part| build::controller(file, part).map(|mut dimsart| Controller::read(&mut dimsart)));
    planned_with(file, [one?, two?]).map(Some)
}

/// Plans a press with existing controllers.
pub(super) fn planned_with(file: &RigFile, controllers: [Controller; 2]) -> Result<Planned, ExperimentError> {
    let (Some([hand, other]), Some(press)) = (file.press_pair(), &file.experiment.press) else {
        return Ok(Planned::default());
    };
    let forces_n = forces_n(press, &other);
    let [one, two] = controllers;
    let axes: Vec<PressedAxis> = hand
        .sections()
        .zip(other.sections())
        .zip(&forces_n)
        .map(|(((_, held), (_, met)), force_n)| PressedAxis {
            force_n: *force_n,
            held: moved_by(held),
            other: moved_by(met),
            obstacle: Obstacle::of(met, *force_n),
        })
        .collect();
    let obstacles = axes.iter().map(|axis| axis.obstacle).collect();
    let chain = Chain { master: one, slave: two, obstacles };
    let link_round_trip_ticks = round_trip_ticks(file, [hand.name(), other.name()])?;
    let phases = Phases::new(file, &chain, &axes, link_round_trip_ticks);
    Ok(Planned { chain, phases, link_round_trip_ticks, forces_n })
}

/// Returns the part of a controller.
pub(super) fn part<'f>(file: &'f RigFile, name: &str) -> Option<ControllerAxes<'f>> {
    ControllerAxes::all(file).into_iter().find(|part| part.name() == name)
}

/// Returns the release times of the pressing hand by axis, `s`; empty without a press.
pub(super) fn release_times_s(planned: Option<&Planned>) -> Vec<f64> {
    planned.map_or_else(Vec::new, Planned::let_go_s)
}

impl Default for Planned {
    fn default() -> Self {
        let phases =
            Phases { path_leg_s: 0.0, contact_start_s: 0.0, settled_s: 0.0, release_s: 0.0, end_s: 0.0 };
        Self { chain: Chain::default(), phases, link_round_trip_ticks: 0, forces_n: Vec::new() }
    }
}

impl Planned {
    /// Returns the file with the motion of the hand as moves, and the length of the run.
    pub(super) fn moved(&self, file: &RigFile) -> RigFile {
        let mut file = file.clone();
        let Some(press) = file.experiment.press.clone() else { return file };
        let Phases { path_leg_s, contact_start_s, release_s, end_s, .. } = self.phases;
        let out = press.path;
        for (axis, force_n) in self.forces_n.iter().enumerate() {
            let on = |on: &str| MoveSection { axis, ..MoveSection::nothing(&press.device, on) };
            let leg = |number: f64, amplitude: f64| MoveSection {
                minimum_jerk: Some(MinimumJerk {
                    at_s: number * path_leg_s,
                    until_s: (number + 1.0) * path_leg_s,
                    amplitude,
                }),
                ..on(HAND)
            };
            let step =
                |at_s: f64, amplitude: f64| MoveSection { step: Some(Step { at_s, amplitude }), ..on(LOAD) };
            file.experiment.moves.extend([leg(0.0, out), leg(1.0, -2.0 * out), leg(2.0, out)]);
            if force_n.abs() > 0.0 {
                file.experiment.moves.extend([step(contact_start_s, *force_n), step(release_s, -force_n)]);
            }
        }
        if file.duration_s.is_infinite() {
            file.duration_s = end_s;
        }
        file
    }

    /// Returns the release times by axis, `s`.
    pub(super) fn let_go_s(&self) -> Vec<f64> {
        let of =
            |force_n: &f64| if force_n.abs() > 0.0 { self.phases.contact_start_s } else { f64::INFINITY };
        self.forces_n.iter().map(of).collect()
    }
}

impl Phases {
    /// Computes the phases of a press for a chain and the link's round trip, aligned to ticks.
    fn new(file: &RigFile, chain: &Chain, axes: &[PressedAxis], link_round_trip_ticks: u32) -> Self {
        let jitter_ticks = file.links.iter().map(|link| link.carrier.jitter_ticks).max().unwrap_or_default();
        let late_ticks = [jitter_ticks.saturating_mul(2), chain.delay_ticks().unwrap_or(0)]
            .into_iter()
            .fold(link_round_trip_ticks, u32::saturating_add);
        let round_trip_s = f64::from(late_ticks) * file.sample_period_s;
        let whole = |time_s: f64| (time_s / file.sample_period_s).round() * file.sample_period_s;
        let path_leg_s = LEG_S + round_trip_s;
        let contact_start_s = whole(3.0 * path_leg_s + REST_S + 2.0 * round_trip_s);
        let settled_s =
            contact_start_s + approach_s(axes, round_trip_s) + settling_s(axes, chain, round_trip_s);
        let release_s = whole(settled_s + WATCH_S + round_trip_s);
        Self {
            path_leg_s,
            contact_start_s,
            settled_s,
            release_s,
            end_s: release_s + RELEASE_S + 4.0 * round_trip_s,
        }
    }

    /// Interval of the settled contact, `s`.
    #[must_use]
    pub fn settled_interval_s(&self) -> Range<f64> {
        self.settled_s..self.release_s
    }
}

/// Time from the push until all pushed axes reach the obstacle, at the speed `F/(B + Bs)`.
fn approach_s(axes: &[PressedAxis], round_trip_s: f64) -> f64 {
    let start_s = |axis: &PressedAxis| 2.0 * ratio(axis.held.0, axis.held.1);
    let crossed_s = |axis: &PressedAxis| {
        let distance_m = axis.obstacle?.surface_m * axis.force_n.signum();
        let drag_n_s_per_m = axis.held.1 + axis.other.1;
        let crossing_s = distance_m.max(0.0) * drag_n_s_per_m / axis.force_n.abs();
        (axis.force_n.abs() > 0.0).then(|| start_s(axis) + crossing_s)
    };
    let first_s = axes.iter().map(start_s).fold(0.0, f64::max);
    axes.iter().filter_map(crossed_s).fold(first_s, f64::max).min(LONGEST_APPROACH_S) + 3.0 * round_trip_s
}

/// Settling time by the formula of the module docs, for the slowest axis.
fn settling_s(axes: &[PressedAxis], chain: &Chain, round_trip_s: f64) -> f64 {
    let longest_s = axes.iter().enumerate().map(|(axis, of)| axis_settling_s(of, chain, axis, round_trip_s));
    longest_s.fold(0.0, f64::max).min(LONGEST_SETTLING_S)
}

/// Missing parts add 0; without waves, echoes decay as on a matched line.
fn axis_settling_s(of: &PressedAxis, chain: &Chain, axis: usize, round_trip_s: f64) -> f64 {
    let PressedAxis {
        held: (mass_kg, damping_n_s_per_m), other: (other_kg, other_n_s_per_m), obstacle, ..
    } = *of;
    let stiffness = |controller: &Controller| controller.stiffness_n_per_m.get(axis).copied();
    let (master, slave) = (stiffness(&chain.master), stiffness(&chain.slave));
    let impedance_n_s_per_m = chain.master.impedance_n_s_per_m;
    let springs = [master, slave, obstacle.map(|obstacle| obstacle.stiffness_n_per_m)];
    let springs_m_per_n: f64 = springs.into_iter().flatten().map(|n_per_m| ratio(1.0, n_per_m)).sum();
    let perceived_m_per_n = springs_m_per_n + impedance_n_s_per_m.map_or(0.0, |b| 0.5 * round_trip_s / b);
    let slave_damping_n_s_per_m =
        other_n_s_per_m + obstacle.map_or(0.0, |obstacle| obstacle.damping_n_s_per_m);
    let time_constants_s = 2.0 * ratio(mass_kg, damping_n_s_per_m)
        + 2.0 * ratio(other_kg, slave_damping_n_s_per_m)
        + damping_n_s_per_m * perceived_m_per_n
        + obstacle.map_or(0.0, |obstacle| ratio(slave_damping_n_s_per_m, obstacle.stiffness_n_per_m));
    let mismatch = impedance_n_s_per_m.map_or(1.0, |b| {
        let slow = ratio(damping_n_s_per_m, b);
        let resonant = ratio(master.unwrap_or(0.0) * mass_kg, damping_n_s_per_m * b);
        slow.max(ratio(1.0, slow)).max(resonant)
    });
    let echoes_s = round_trip_s * (ROUND_TRIPS + ROUND_TRIPS_PER_MISMATCH * mismatch);
    TIME_CONSTANTS * time_constants_s + echoes_s
}

/// Quotient with a defined value for 0/0.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    numerator / denominator.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shipped gains, without delay modules.
    fn phases(sets: &[String]) -> Phases {
        let file = RigFile::from_shipped("bilateral", sets).unwrap();
        let controller = |stiffness_n_per_m| Controller {
            stiffness_n_per_m: vec![stiffness_n_per_m; 3],
            impedance_n_s_per_m: Some(10.0),
            delay_ticks: Some(0),
            every_ticks: 1,
            playout_ticks: 0,
            lossy_policy: None,
        };
        planned_with(&file, [controller(3000.0), controller(5000.0)]).unwrap().phases
    }

    fn with_round_trip(ticks: u32) -> Vec<String> {
        let (forward, backward) = (ticks / 2, ticks - ticks / 2);
        vec![format!("link.forward_delay_ticks={forward}"), format!("link.backward_delay_ticks={backward}")]
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
            for (stiffness_n_per_m, settled_s) in ["1e3", "1e4", "inf"].into_iter().zip(settled_s) {
                let mut sets = with_round_trip(ticks);
                sets.push(format!("wall.stiffness_n_per_m={stiffness_n_per_m}"));
                let phases = phases(&sets);
                let given_s = phases.settled_s - phases.contact_start_s;
                assert!(given_s > settled_s, "{ticks} ticks: {given_s} s for {settled_s} s");
            }
        }
    }

    #[test]
    fn nothing_that_never_settles_makes_a_run_endless() {
        let sets = [
            "hand.damping_n_s_per_m=0",
            "master.device.damping_n_s_per_m=0",
            "hand.contact_force_n=[1e-9]",
            "master.stiffness_n_per_m=0",
            "slave.stiffness_n_per_m=0",
        ];
        let end_s = phases(&sets.map(str::to_owned)).end_s;
        assert!(end_s < 700.0, "{end_s}");
    }

    #[test]
    fn the_hand_pushes_only_where_it_should() {
        let file = RigFile::from_shipped("bilateral", &[]).unwrap();
        let planned = planned(&file).unwrap().unwrap();
        let moved = planned.moved(&file);
        let pushes = |axis: usize| -> Vec<Step> {
            let on_axis = |moved: &&MoveSection| moved.axis == axis && moved.on == LOAD;
            moved.experiment.moves.iter().filter(on_axis).filter_map(|moved| moved.step.clone()).collect()
        };
        let Phases { contact_start_s, release_s, .. } = planned.phases;
        for (axis, amplitude) in [(0, 2.0), (1, 1.0)] {
            let [push, release] = &pushes(axis)[..] else { panic!("{:?}", pushes(axis)) };
            assert_eq!(push, &Step { at_s: contact_start_s, amplitude });
            assert_eq!(release, &Step { at_s: release_s, amplitude: -amplitude });
        }
        assert_eq!(pushes(2), []);
        assert_eq!(planned.let_go_s(), [contact_start_s, contact_start_s, f64::INFINITY]);
    }
}
