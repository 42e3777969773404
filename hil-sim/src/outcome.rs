//! The figures of a run, for people and for programs.

use serde::Serialize;

use crate::bilateral::linear_loop::LinearLoop;
use crate::bus::Traffic;
use crate::limit_cycle::LimitCycle;

/// What a run came to; printed whole by `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Whether no linear loop grows, every position, force and wave stayed in its declared range, none grew without bound,
    /// and no axis went on swinging in contact by a hundredth of its motion or on and off the wall.
    pub stable: bool,
    /// Ticks that were run.
    pub ticks: u64,
    /// Virtual time that was run, `s`.
    pub simulated_s: f64,
    /// Time it took from the reading of the input files on; as the command prints it, with its report, `s`.
    pub wall_s: f64,
    /// Virtual time over the time it took.
    pub realtime_factor: f64,
    /// Smallest energy in the channel of any axis over the run, `J`: below 0, the channel was not passive. None
    /// when no tick was run, when there are no waves, and when one side only was run: it takes those of both.
    pub energy_min_j: Option<f64>,
    /// Smallest energy that the robots gave controllers and line on any axis over the run, `J`: below 0, these gave out
    /// more than they got, they are active. None for one side alone.
    pub energy_ports_min_j: Option<f64>,
    /// The linear loops, guided, free and in contact, by their largest eigenvalues; empty for one side alone.
    pub loops: Vec<LinearLoop>,
    /// What went on swinging in contact though nothing moved it.
    pub limit_cycles: Vec<LimitCycle>,
    /// Bound of how fast rounding lets a hand in contact creep, `m/h`; none where a side has no waves.
    pub rounding_creep_m_per_h: Option<f64>,
    /// Ticks there and back: the link's as measured, and on top the samples of the delay modules on the way.
    /// None when nothing came back, or when one side was run and the other one's scheme is not known.
    pub round_trip_ticks: Option<u32>,
    /// Perceived stiffness by axis, `N/m`; none for an axis that was not in settled contact.
    pub k_perceived_n_per_m: Vec<Option<f64>>,
    /// The static chain's stiffness for the measured round trip, by axis, `N/m`.
    pub k_predicted_n_per_m: Vec<Option<f64>>,
    /// The same, an object per axis.
    pub axes: Vec<AxisOutcome>,
    /// What the simulated media came to; empty over an ideal carrier and for one side alone.
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
    /// What makes figures mean less than they seem to, in words.
    pub warnings: Vec<String>,
    /// None unless one side was run in real time.
    pub real_time: Option<RealTime>,
}

/// What the clock and the other process did to one side's run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RealTime {
    /// The side that was run here.
    pub side: &'static str,
    /// Ticks that came more than a period late.
    pub late_ticks: u64,
    /// How late the latest tick came, `s`.
    pub worst_lateness_s: f64,
}

/// What a station made of the packets that were sent to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Received {
    /// Its name.
    pub station: String,
    /// Packets that were missing when a newer one came.
    pub lost: u32,
    /// Packets that came together with a newer one: a tick uses one.
    pub superseded: u32,
    /// Packets refused: damaged, old, repeated, or of another content.
    pub refused: u32,
}

impl Received {
    /// Lost, superseded and refused packets of all.
    #[must_use]
    pub fn sums(received: &[Self]) -> [u64; 3] {
        let sum = |count: fn(&Self) -> u32| received.iter().map(|each| u64::from(count(each))).sum();
        [sum(|each| each.lost), sum(|each| each.superseded), sum(|each| each.refused)]
    }
}

/// What a run came to on one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisOutcome {
    /// The axis, from 0.
    pub axis: usize,
    /// Perceived stiffness in the settled contact, `N/m`; none when not in contact.
    pub k_perceived_n_per_m: Option<f64>,
    /// The static chain's stiffness, `N/m`.
    pub k_predicted_n_per_m: Option<f64>,
}

impl Outcome {
    /// Sets the time it took, with what came after the run.
    pub fn set_wall_s(&mut self, wall_s: f64) {
        self.wall_s = wall_s;
        self.realtime_factor = self.simulated_s / wall_s.max(f64::MIN_POSITIVE);
    }

    /// The same with what the receivers missed.
    #[must_use]
    pub(crate) fn with_received(self, received: Vec<Received>) -> Self {
        let [lost_packets, superseded_packets, refused_packets] = Received::sums(&received);
        Self { received, lost_packets, superseded_packets, refused_packets, ..self }
    }

    /// The same where no stiffness can be predicted.
    #[must_use]
    pub(crate) fn without_prediction(mut self) -> Self {
        self.k_predicted_n_per_m.fill(None);
        for axis in &mut self.axes {
            axis.k_predicted_n_per_m = None;
        }
        self
    }

    /// The figures; what follows from others is worked out.
    #[expect(clippy::too_many_arguments, reason = "the fields, one by one")]
    #[must_use]
    pub fn new(
        ticks: u64,
        simulated_s: f64,
        wall_s: f64,
        stable: bool,
        energy_min_j: Option<f64>,
        round_trip_ticks: Option<u32>,
        axes: Vec<AxisOutcome>,
        faults: Vec<String>,
    ) -> Self {
        Self {
            stable,
            ticks,
            simulated_s,
            wall_s,
            realtime_factor: simulated_s / wall_s.max(f64::MIN_POSITIVE),
            energy_min_j,
            energy_ports_min_j: None,
            loops: Vec::new(),
            limit_cycles: Vec::new(),
            rounding_creep_m_per_h: None,
            round_trip_ticks,
            k_perceived_n_per_m: axes.iter().map(|axis| axis.k_perceived_n_per_m).collect(),
            k_predicted_n_per_m: axes.iter().map(|axis| axis.k_predicted_n_per_m).collect(),
            axes,
            media: Vec::new(),
            received: Vec::new(),
            lost_packets: 0,
            superseded_packets: 0,
            refused_packets: 0,
            faults,
            warnings: Vec::new(),
            real_time: None,
        }
    }
}
