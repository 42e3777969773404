//! The figures of a run, collected by its [observers](crate::observer).

use serde::Serialize;

use crate::bus::Traffic;
pub use crate::loop_figures::LoopFigures;
pub use crate::observer::limit_cycles::LimitCycle;
pub use crate::observer::perceived::PerceivedStiffness;
pub use crate::observer::reception::Received;
pub use crate::observer::saturation::Saturation;
pub use crate::response::{LinearLoop, StabilityLimit};

/// All figures of a run, as printed by `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Whether every loop is stable, all signals stay in range without growth, and no axis oscillates by more than 1
    /// % of its motion.
    pub stable: bool,
    /// Number of ticks.
    pub ticks: u64,
    /// Virtual time, `s`.
    pub simulated_s: f64,
    /// Elapsed time from reading the input files, `s`; the command includes the report.
    pub wall_s: f64,
    /// Virtual time divided by elapsed time.
    pub realtime_factor: f64,
    /// Minimum energy in the channel of any axis, `J`; below 0, the channel was not passive. `None` if not observed,
    /// without waves, or for a single station, as both stations are required.
    pub energy_min_j: Option<f64>,
    /// Minimum energy that the devices supply to controllers and links on any axis, `J`; below 0 these are active.
    /// `None` if a reference moves, which supplies energy, or for a single station.
    pub energy_ports_min_j: Option<f64>,
    /// Linear loops of two stations (guided, free, in contact), with their largest eigenvalues.
    pub loops: Vec<LinearLoop>,
    /// Sustained oscillations at rest.
    pub limit_cycles: Vec<LimitCycle>,
    /// Maximum creep of a hand in contact by rounding, `m/h`; `None` if a station has no waves.
    pub rounding_creep_m_per_h: Option<f64>,
    /// Round trip in ticks: measured on the link, plus the samples of the delay modules. `None` without a reply, or
    /// for a single station if the peer's scheme is unknown.
    pub round_trip_ticks: Option<u32>,
    /// Perceived stiffness by axis, `N/m`; `None` for an axis without a settled contact.
    pub k_perceived_n_per_m: Vec<Option<f64>>,
    /// Predicted stiffness of the static chain for the measured round trip, by axis, `N/m`.
    pub k_predicted_n_per_m: Vec<Option<f64>>,
    /// Results by axis.
    pub axes: Vec<AxisOutcome>,
    /// Perceived stiffness of the environments of other devices.
    pub perceived: Vec<PerceivedStiffness>,
    /// Saturated actuators and their saturation times.
    pub saturated: Vec<Saturation>,
    /// Predicted stability and passivity limits of a two-robot coupling; `None` if no theory applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theory: Option<StabilityLimit>,
    /// Reports of the simulated media.
    pub media: Vec<Traffic>,
    /// Packet counters of the receivers, by station.
    pub received: Vec<Received>,
    /// Lost packets of all receivers: missing when a newer packet arrived.
    pub lost_packets: u64,
    /// Superseded packets of all receivers: arrived in the same tick as a newer packet.
    pub superseded_packets: u64,
    /// Refused packets of all receivers.
    pub refused_packets: u64,
    /// Faults.
    pub faults: Vec<String>,
    /// Undecided results and the run needed to decide them; the run is not reported as stable.
    pub undecided: Vec<String>,
    /// Warnings about the validity of figures.
    pub warnings: Vec<String>,
    /// Timing; `None` unless a single station runs in real time.
    pub real_time: Option<RealTime>,
    /// Whether the run completed.
    #[serde(skip)]
    pub is_complete: bool,
}

/// Results of an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisOutcome {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// Tracking of its reference, if any.
    #[serde(flatten)]
    pub following: Option<Following>,
    /// Perceived stiffness of its obstacle, if any.
    #[serde(flatten)]
    pub contact: Option<ContactStiffness>,
    /// Figures of its loop at the start position; `None` if the loop is not linear there.
    #[serde(flatten)]
    pub loop_figures: Option<LoopFigures>,
    /// Growth per tick of a disturbance while all walls are in contact; `None` without a wall, or if the disturbance
    /// vanishes.
    pub contact_growth_per_tick: Option<f64>,
}

/// Tracking of a reference. Step figures refer to the first step, until the axis is otherwise moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Following {
    /// Reference.
    pub reference: &'static str,
    /// Unit of the errors.
    pub unit: &'static str,
    /// Rise time, 10 % to 90 % of the step, `s`; `None` without a step, or if 90 % is not reached.
    pub rise_time_s: Option<f64>,
    /// Overshoot as a share of the step; `None` without a step.
    pub overshoot: Option<f64>,
    /// Settling time to 2 % of the step, `s`; `None` if not settled.
    pub settling_time_s: Option<f64>,
    /// RMS error.
    pub rms_error: f64,
    /// Maximum absolute error.
    pub peak_error: f64,
}

/// Perceived stiffness of an obstacle, and its prediction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactStiffness {
    /// Perceived stiffness in the settled contact, `N/m`; `None` without contact.
    pub k_perceived_n_per_m: Option<f64>,
    /// Predicted stiffness of the static chain, `N/m`.
    pub k_predicted_n_per_m: Option<f64>,
}

/// Timing of a single station in real time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RealTime {
    /// Station.
    pub side: String,
    /// Ticks that came more than a period late.
    pub late_ticks: u64,
    /// Maximum delay of a tick, `s`.
    pub worst_lateness_s: f64,
}

impl Default for Outcome {
    /// Outcome of an empty run: stable.
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
    /// Sets the elapsed time, including work after the run.
    pub fn set_wall_s(&mut self, wall_s: f64) {
        self.wall_s = wall_s;
        self.realtime_factor = self.simulated_s / wall_s.max(f64::MIN_POSITIVE);
    }

    /// Adds a fault and marks the run as unstable.
    pub(crate) fn fail(&mut self, fault: String) {
        self.stable = false;
        self.faults.push(fault);
    }

    /// Removes the predicted stiffness of all axes.
    pub(crate) fn predict_nothing(&mut self) {
        self.k_predicted_n_per_m.fill(None);
        for contact in self.axes.iter_mut().filter_map(|axis| axis.contact.as_mut()) {
            contact.k_predicted_n_per_m = None;
        }
    }
}
