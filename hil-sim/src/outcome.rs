//! The figures of a run, for people and for programs: what its [observers](crate::observer) found.

use serde::Serialize;

use crate::bus::Traffic;
pub use crate::observer::limit_cycles::LimitCycle;
pub use crate::observer::perceived::PerceivedStiffness;
pub use crate::observer::reception::Received;
pub use crate::observer::saturation::Saturation;
pub use crate::response::{Border, LinearLoop, LoopFigures};

/// The figures of a run; `--json` prints all of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Whether every loop is stable, all signals stayed in their declared range, none grew without bound, and no axis kept
    /// oscillating by more than a hundredth of its motion.
    pub stable: bool,
    /// Ticks that were run.
    pub ticks: u64,
    /// Virtual time that was run, `s`.
    pub simulated_s: f64,
    /// Time it took from the reading of the input files on; as the command prints it, with its report, `s`.
    pub wall_s: f64,
    /// Virtual time over the time it took.
    pub realtime_factor: f64,
    /// Minimum energy in the channel of any axis over the run, `J`: below 0, the channel was not passive. None
    /// where it is not observed, when there are no waves, and when one station only was run: it takes those of both.
    pub energy_min_j: Option<f64>,
    /// Minimum energy that the devices gave controllers and links on any axis, `J`; below 0 these are active. None where
    /// a reference moves, for it brings energy, and for one station alone.
    pub energy_ports_min_j: Option<f64>,
    /// The linear loops of two stations, guided, free and in contact, by their largest eigenvalues.
    pub loops: Vec<LinearLoop>,
    /// Sustained oscillations of what nothing moved any more.
    pub limit_cycles: Vec<LimitCycle>,
    /// Bound of how fast rounding lets a hand in contact creep, `m/h`; none where a station has no waves.
    pub rounding_creep_m_per_h: Option<f64>,
    /// Ticks there and back: the link's as measured, and on top the samples of the delay modules on the way.
    /// None when nothing came back, and when one station was run and the other one's scheme is not known.
    pub round_trip_ticks: Option<u32>,
    /// Perceived stiffness by axis, `N/m`; none for an axis that was not in settled contact.
    pub k_perceived_n_per_m: Vec<Option<f64>>,
    /// The static chain's stiffness for the measured round trip, by axis, `N/m`.
    pub k_predicted_n_per_m: Vec<Option<f64>>,
    /// What each axis came to.
    pub axes: Vec<AxisOutcome>,
    /// What hands feel of what other devices meet.
    pub perceived: Vec<PerceivedStiffness>,
    /// How long actuators were saturated; those that never were are left out.
    pub saturated: Vec<Saturation>,
    /// Where theory has a coupling of two robots become unstable, or active; `None` where no theory is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theory: Option<Border>,
    /// What the simulated media came to.
    pub media: Vec<Traffic>,
    /// What the receivers missed, by station.
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
    /// What makes figures mean less than they seem to, in words.
    pub warnings: Vec<String>,
    /// None unless one station was run in real time.
    pub real_time: Option<RealTime>,
    /// Whether the run reached its end.
    #[serde(skip)]
    pub is_complete: bool,
}

/// What an axis came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisOutcome {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// How it followed a reference, if it had one.
    #[serde(flatten)]
    pub following: Option<Following>,
    /// How stiff a hand felt what it met, if it was to meet something.
    #[serde(flatten)]
    pub contact: Option<ContactStiffness>,
    /// The loop around it, as it stands at the start; none when it is not linear there.
    #[serde(flatten)]
    pub loop_figures: Option<LoopFigures>,
    /// Growth per tick of a disturbance while every axis is held by its wall; none without one, and when nothing is left
    /// of it.
    pub contact_growth_per_tick: Option<f64>,
}

/// How an axis followed one of its references. Figures of a step are of the first one, until something else moves the
/// axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Following {
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
    /// Root of the mean square of the error.
    pub rms_error: f64,
    /// Maximum of the error's size.
    pub peak_error: f64,
}

/// Stiffness that a hand perceives of an obstacle, and what theory predicts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactStiffness {
    /// Perceived stiffness in the settled contact, `N/m`; none when not in contact.
    pub k_perceived_n_per_m: Option<f64>,
    /// The static chain's stiffness, `N/m`.
    pub k_predicted_n_per_m: Option<f64>,
}

/// What the clock did to the run of one station.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RealTime {
    /// The station that was run here.
    pub side: String,
    /// Ticks that came more than a period late.
    pub late_ticks: u64,
    /// How late the latest tick came, `s`.
    pub worst_lateness_s: f64,
}

impl Default for Outcome {
    /// Of a run in which nothing has happened yet: stable.
    fn default() -> Self {
        Self {
            stable: true,
            ticks: 0,
            simulated_s: 0.0,
            wall_s: 0.0,
            realtime_factor: 0.0,
            energy_min_j: None,
            energy_ports_min_j: None,
            loops: Vec::new(),
            limit_cycles: Vec::new(),
            rounding_creep_m_per_h: None,
            round_trip_ticks: None,
            k_perceived_n_per_m: Vec::new(),
            k_predicted_n_per_m: Vec::new(),
            axes: Vec::new(),
            perceived: Vec::new(),
            saturated: Vec::new(),
            theory: None,
            media: Vec::new(),
            received: Vec::new(),
            lost_packets: 0,
            superseded_packets: 0,
            refused_packets: 0,
            faults: Vec::new(),
            undecided: Vec::new(),
            warnings: Vec::new(),
            real_time: None,
            is_complete: false,
        }
    }
}

impl Outcome {
    /// Sets the time it took, with what came after the run.
    pub fn set_wall_s(&mut self, wall_s: f64) {
        self.wall_s = wall_s;
        self.realtime_factor = self.simulated_s / wall_s.max(f64::MIN_POSITIVE);
    }

    /// Adds a fault of a run that is not stable.
    pub(crate) fn fail(&mut self, fault: String) {
        self.stable = false;
        self.faults.push(fault);
    }

    /// Takes back the predicted stiffness of all axes.
    pub(crate) fn predict_nothing(&mut self) {
        self.k_predicted_n_per_m.fill(None);
        for contact in self.axes.iter_mut().filter_map(|axis| axis.contact.as_mut()) {
            contact.k_predicted_n_per_m = None;
        }
    }
}
