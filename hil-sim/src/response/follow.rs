//! Watches how an axis follows its reference.

use dimsart_core::{DataType, types};

use super::loop_gain::LoopFigures;
use super::motion::{Motion, sum_at};
use super::outcome::AxisOutcome;
use super::step_response::{StepFigures, StepResponse};
use crate::plant::MAX_QUANTITIES;
use crate::rig::{Probe, Station};

/// Which quantity of an axis follows which reference.
pub(super) const FOLLOWS: [(&DataType, usize); 2] = [(types::DES_POSITION, 0), (types::DES_VELOCITY, 1)];

/// A reference that is followed, and the place of what follows it among what is known of an axis.
pub(super) fn followed(reference: &DataType) -> Option<(&'static DataType, usize)> {
    FOLLOWS.into_iter().find(|(known, _)| known.id == reference.id)
}

/// One axis and one reference.
#[derive(Debug)]
pub(super) struct Follow {
    pub(super) station: usize,
    pub(super) axis: usize,
    pub(super) reference: &'static DataType,
    pub(super) unit: &'static str,
    /// Of what follows it.
    pub(super) quantity: usize,
    motions: Vec<Motion>,
    /// Where the scheme has a reference that nothing moves from outside: from a link, or a module.
    of_scheme: Option<Probe>,
    step: Option<StepResponse>,
    squares: f64,
    peak: f64,
    ticks: u64,
}

impl Follow {
    /// `others` are when anything else begins to move the axis, `s`.
    pub(super) fn new(
        place: (usize, usize),
        reference: &'static DataType,
        unit: &'static str,
        quantity: usize,
        motions: Vec<Motion>,
        others_s: &[f64],
    ) -> Self {
        // One before the beginning is where the reference stands at first.
        let is_answered = |motion: &&Motion| matches!(motion, Motion::Step(_)) && motion.start_s() >= 0.0;
        let step = motions.iter().find(is_answered);
        let step = step.map(|motion| {
            let at_s = motion.start_s();
            let until_s = others_s.iter().copied().filter(|other_s| *other_s > at_s);
            let until_s = until_s.fold(f64::INFINITY, f64::min);
            let after = sum_at(&motions, at_s);
            StepResponse::new(at_s, until_s, after - motion.at(at_s), after)
        });
        let (station, axis) = place;
        let of_scheme = motions.is_empty().then(|| Probe::new(reference.first()));
        Self {
            station,
            axis,
            reference,
            unit,
            quantity,
            motions,
            of_scheme,
            step,
            squares: 0.0,
            peak: 0.0,
            ticks: 0,
        }
    }

    /// Whether there ever was a reference.
    pub(super) fn has_followed(&self) -> bool {
        self.ticks > 0
    }

    /// Looks at the present tick of its station.
    pub(super) fn add(&mut self, time_s: f64, station: &Station) {
        let mut values = [f64::NAN; MAX_QUANTITIES];
        station.plant.look(self.axis, &mut values);
        let value = values.get(self.quantity).copied().unwrap_or(f64::NAN);
        let wanted = match &mut self.of_scheme {
            Some(probe) => probe.values(station).nth(self.axis),
            None => Some(sum_at(&self.motions, time_s)),
        };
        let Some(wanted) = wanted else { return };
        let error = wanted - value;
        self.squares += error * error;
        self.peak = self.peak.max(error.abs());
        self.ticks += 1;
        if let Some(step) = &mut self.step {
            step.add(time_s, value);
        }
    }

    /// What came of it.
    pub(super) fn outcome(&self, device: &str, loop_figures: Option<LoopFigures>) -> AxisOutcome {
        let figures = self.step.as_ref().map(StepResponse::figures);
        let of_step = |figure: fn(&StepFigures) -> Option<f64>| figures.as_ref().and_then(figure);
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let ticks = self.ticks.max(1) as f64;
        AxisOutcome {
            device: device.to_owned(),
            axis: self.axis,
            reference: self.reference.name,
            unit: self.unit,
            rise_time_s: of_step(|figures| figures.rise_time_s),
            overshoot: of_step(|figures| Some(figures.overshoot)),
            settling_time_s: of_step(|figures| figures.settling_time_s),
            rms_error: (self.squares / ticks).sqrt(),
            peak_error: self.peak,
            loop_figures,
            contact_growth_per_tick: None,
        }
    }
}
