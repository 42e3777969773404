//! Environment of an axis of a machine: load and hand.

use drive::DriveReading;

use crate::motion::{LATE_S, Motion, sum_at};
use crate::plant::Repetition;
use crate::rig_file::{AxisHand, AxisSection};

/// True state of an axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AxisState {
    pub(super) position: f64,
    pub(super) velocity: f64,
    pub(super) force: f64,
    /// Current, voltage and winding temperature of its motor.
    pub(super) motor: Option<[f64; 3]>,
    /// Readings of its drive, in place of sensors.
    pub(super) reading: Option<DriveReading>,
    /// Angle and speed of a joint, if the axis is a direction of the tip.
    pub(super) joint: Option<[f64; 2]>,
}

/// Environment of an axis.
#[derive(Debug)]
pub(super) struct Axis {
    pub(super) section: AxisSection,
    pub(super) load: Vec<Motion>,
    /// Intended position of its hand.
    pub(super) hand: Vec<Motion>,
    /// Intended position of its hand that a user sets, in place of `hand`.
    pub(super) held_hand: Option<f64>,
    /// Release time of its hand, `s`: afterwards the hand only adds its inertia and damping.
    pub(super) let_go_s: f64,
    pub(super) has_let_go: bool,
    /// Time-dependent force, and the end of its constant phase.
    pub(super) still: Option<(f64, f64)>,
}

impl Axis {
    pub(super) fn new(section: AxisSection, load: Vec<Motion>, hand: Vec<Motion>, let_go_s: f64) -> Self {
        Self { section, load, hand, held_hand: None, let_go_s, has_let_go: false, still: None }
    }

    /// Time-dependent force: load, and the hand's spring for its intended position.
    pub(super) fn outside(&self, repetition: Repetition, time_s: f64) -> f64 {
        let at = |motions: &[Motion]| match motions {
            [] => 0.0,
            motions => repetition.value(time_s, |time_s| sum_at(motions, time_s)),
        };
        if self.has_let_go {
            return at(&self.load);
        }
        at(&self.load) + self.section.hand_stiffness() * self.held_hand.unwrap_or_else(|| at(&self.hand))
    }

    /// [`outside`](Self::outside), cached while constant.
    #[inline]
    pub(super) fn still_outside(
        &mut self,
        repetition: Repetition,
        start_s: f64,
        period_s: f64,
    ) -> Option<f64> {
        let end_s = start_s + period_s;
        if let Some((force, until_s)) = self.still
            && end_s <= until_s
        {
            return Some(force);
        }
        self.still = None;
        let mut motions = self.load.iter().chain(&self.hand);
        if repetition != Repetition::ONCE || !motions.clone().all(|motion| motion.is_still(start_s, end_s)) {
            return None;
        }
        let next_s = motions.by_ref().map(Motion::start_s).filter(|at_s| *at_s >= end_s - LATE_S);
        let until_s = next_s.fold(f64::INFINITY, f64::min) + LATE_S;
        let force = self.outside(repetition, start_s);
        self.still = Some((force, until_s));
        Some(force)
    }

    /// Load and hand spring.
    pub(super) fn pushed_by(&self, repetition: Repetition, time_s: f64, position: f64) -> f64 {
        let held = if self.has_let_go { 0.0 } else { self.section.hand_stiffness() * position };
        self.outside(repetition, time_s) - held
    }

    /// Force of the hand on its device, including its inertia, as measured by a sensor between them.
    pub(super) fn hand_force(
        &self,
        repetition: Repetition,
        time_s: f64,
        state: &AxisState,
        acceleration: f64,
    ) -> f64 {
        let Some(AxisHand { inertia, damping, .. }) = self.section.hand else { return 0.0 };
        self.pushed_by(repetition, time_s, state.position) - damping * state.velocity - inertia * acceleration
    }
}
