//! The figures of a rig's run, for people and for programs.

use serde::Serialize;

use super::{LoopFigures, Saturation};
use crate::bilateral::border::Border;
use crate::bus::Traffic;
use crate::limit_cycle::LimitCycle;
use crate::outcome::Received;

/// What a run came to; printed whole by `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Whether every loop is stable, everything stayed in its declared range, nothing grew without bound, and nothing went on swinging by more
    /// than a hundredth of what it was moved.
    pub stable: bool,
    /// Ticks that were run.
    pub ticks: u64,
    /// Virtual time that was run, `s`.
    pub simulated_s: f64,
    /// Time it took from the reading of the input files on; as the command prints it, with its report, `s`.
    pub wall_s: f64,
    /// Virtual time over the time it took.
    pub realtime_factor: f64,
    /// What each controlled axis came to.
    pub axes: Vec<AxisOutcome>,
    /// What hands feel of what other devices meet.
    pub perceived: Vec<PerceivedStiffness>,
    /// Smallest energy that the devices gave the controllers and links on any axis, `J`; below 0 these are active. None where
    /// a reference moves, for it brings energy.
    pub energy_ports_min_j: Option<f64>,
    /// What went on swinging when nothing moved it any more.
    pub limit_cycles: Vec<LimitCycle>,
    /// How long actuators were saturated; those that never were are left out.
    pub saturated: Vec<Saturation>,
    /// Where theory has a coupling of two robots become unstable, or active; `None` where no theory is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theory: Option<Border>,
    /// What the simulated media came to.
    pub media: Vec<Traffic>,
    /// What the receivers missed, by device.
    pub received: Vec<Received>,
    /// Of all receivers: packets that were missing when a newer one came.
    pub lost_packets: u64,
    /// Of all receivers: packets that came together with a newer one.
    pub superseded_packets: u64,
    /// Of all receivers: packets refused.
    pub refused_packets: u64,
    /// What went wrong, in words.
    pub faults: Vec<String>,
    /// What cannot be decided, and what a decision needs; the run is not reported as stable.
    pub undecided: Vec<String>,
}

impl Outcome {
    /// Sets the time it took, with what came after the run.
    pub fn set_wall_s(&mut self, wall_s: f64) {
        self.wall_s = wall_s;
        self.realtime_factor = self.simulated_s / wall_s.max(f64::MIN_POSITIVE);
    }
}

/// How an axis followed one of its references. Figures of a step are of the first one, until something else moves the
/// axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisOutcome {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// What it was to follow.
    pub reference: &'static str,
    /// Unit of the errors.
    pub unit: &'static str,
    /// From a tenth to nine tenths of the step, `s`; none without a step, or when it has not come that far.
    pub rise_time_s: Option<f64>,
    /// By which part of the step it went too far at most; none without a step.
    pub overshoot: Option<f64>,
    /// From the step until it stays within 2 % of it, `s`; none when it does not.
    pub settling_time_s: Option<f64>,
    /// Root of the mean square of what it was off by.
    pub rms_error: f64,
    /// The most it was off by.
    pub peak_error: f64,
    /// The loop around it, as it stands at the start; none when it is not linear there.
    #[serde(flatten)]
    pub loop_figures: Option<LoopFigures>,
    /// Growth per tick of a disturbance while every axis is held by its wall; none without one, and when nothing is left
    /// of it.
    pub contact_growth_per_tick: Option<f64>,
}

/// What a hand felt the last time it held something against an obstacle while nothing moved: force of the device on it over
/// how far it was beyond the obstacle's surface, or its spring's rest. Of several that were met, from the first one on;
/// positions are taken to be the same at both ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PerceivedStiffness {
    /// The device with the hand.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// The device that met the obstacle.
    pub met_by: String,
    /// `N/m` or `N m/rad`.
    pub unit: &'static str,
    /// How stiff it feels.
    pub stiffness: f64,
    /// Why the figure is not to be believed, in words: it was still on its way. None when it had settled.
    pub unsettled: Option<String>,
}
