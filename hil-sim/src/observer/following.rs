//! Tracking of references, and the loops of the axes.

use core::ops::ControlFlow;

use dimsart_core::{DataType, types};

use super::Observer;
use super::step_response::{StepFigures, StepResponse};
use crate::loop_figures::{AxisLoop, UNDECIDED};
use crate::motion::{Motion, sum_at};
use crate::outcome::{AxisOutcome, Following, Outcome};
use crate::plant::MAX_QUANTITIES;
use crate::rig::{Probe, Rig, Station};

/// Quantity of an axis that follows each reference.
pub(crate) const FOLLOWS: [(&DataType, usize); 2] = [(types::DES_POSITION, 0), (types::DES_VELOCITY, 1)];

/// Finds a reference and the index of the quantity that follows it.
pub(crate) fn followed(reference: &DataType) -> Option<(&'static DataType, usize)> {
    FOLLOWS.into_iter().find(|(known, _)| known.id == reference.id)
}

/// All axes with references, and all loops.
#[derive(Debug)]
pub(crate) struct TrackingObserver {
    follows: Vec<Follow>,
    loops: Vec<AxisLoop>,
}

impl TrackingObserver {
    pub(crate) fn new(follows: Vec<Follow>, loops: Vec<AxisLoop>) -> Self {
        Self { follows, loops }
    }

    /// Reports unstable and undecided loops.
    fn report_loops(&self, rig: &Rig, outcome: &mut Outcome) {
        for of in &self.loops {
            for (figures, place) in [(of.free, ""), (of.in_contact, " in contact")] {
                let Some(growth) = figures.and_then(|figures| figures.growth_per_tick) else { continue };
                let the_loop = format!("the loop of axis {} of {}{place}", of.axis, name(rig, of.station));
                if growth > 1.0 + UNDECIDED {
                    outcome.fail(format!(
                        "{the_loop} is unstable: disturbances grow by a factor of {growth:.5} per \
                        tick"
                    ));
                } else if growth >= 1.0 - UNDECIDED {
                    outcome.undecided.push(format!(
                        "{the_loop} is at its stability limit (growth within 1e-5 per tick): change a gain for \
                        a clear result"
                    ));
                }
            }
        }
    }
}

impl Observer for TrackingObserver {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        let time_s = rig.time_s();
        for follow in &mut self.follows {
            if let Some(station) = rig.stations().get(follow.station) {
                follow.add(time_s, station);
            }
        }
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        self.report_loops(rig, outcome);
        for follow in self.follows.iter().filter(|follow| follow.has_followed()) {
            let is_around = |of: &&AxisLoop| (of.station, of.axis) == (follow.station, follow.axis);
            let found = self.loops.iter().find(is_around);
            let in_contact = found.and_then(|of| of.in_contact);
            outcome.axes.push(AxisOutcome {
                device: name(rig, follow.station).to_owned(),
                axis: follow.axis,
                following: Some(follow.figures()),
                contact: None,
                loop_figures: found.and_then(|of| of.free),
                contact_growth_per_tick: in_contact.and_then(|figures| figures.growth_per_tick),
            });
        }
    }
}

fn name(rig: &Rig, station: usize) -> &str {
    rig.stations().get(station).map_or("", |station| &station.name)
}

/// One reference of an axis.
#[derive(Debug)]
pub(crate) struct Follow {
    station: usize,
    axis: usize,
    reference: &'static DataType,
    unit: &'static str,
    /// Index of the quantity that follows it.
    quantity: usize,
    motions: Vec<Motion>,
    /// Reference in the scheme that is not moved by the experiment: from a link or a module.
    of_scheme: Option<Probe>,
    step: Option<StepResponse>,
    squares: f64,
    peak: f64,
    ticks: u64,
}

impl Follow {
    /// `others`: times at which other signals start to move the axis, `s`.
    pub(crate) fn new(
        place: (usize, usize),
        reference: &'static DataType,
        unit: &'static str,
        quantity: usize,
        motions: Vec<Motion>,
        others_s: &[f64],
    ) -> Self {
        // A step before the start is the initial value of the reference.
        let has_session = |motion: &&Motion| matches!(motion, Motion::Step(_)) && motion.start_s() >= 0.0;
        let step = motions.iter().find(has_session);
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

    /// Whether a reference existed.
    fn has_followed(&self) -> bool {
        self.ticks > 0
    }

    /// Observes the present tick of its station.
    fn add(&mut self, time_s: f64, station: &Station) {
        let value = match self.quantity {
            0 => station.plant.position(self.axis),
            quantity => {
                let mut values = [f64::NAN; MAX_QUANTITIES];
                station.plant.read_quantities(self.axis, &mut values);
                values.get(quantity).copied().unwrap_or(f64::NAN)
            }
        };
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

    fn figures(&self) -> Following {
        let figures = self.step.as_ref().map(StepResponse::figures);
        let of_step = |figure: fn(&StepFigures) -> Option<f64>| figures.as_ref().and_then(figure);
        #[expect(clippy::cast_precision_loss, reason = "far fewer ticks than 2^53")]
        let ticks = self.ticks.max(1) as f64;
        Following {
            reference: self.reference.name,
            unit: self.unit,
            rise_time_s: of_step(|figures| figures.rise_time_s),
            overshoot: of_step(|figures| Some(figures.overshoot)),
            settling_time_s: of_step(|figures| figures.settling_time_s),
            rms_error: (self.squares / ticks).sqrt(),
            peak_error: self.peak,
        }
    }
}
