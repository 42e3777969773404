//! Identification of a joint from rows of the scope, and trials of gains in a simulation.

use std::collections::BTreeMap;

use dimsart_core::ModuleKinds;
use hil_sim::experiment;
use hil_sim::identify::{
    Experiment, ForceTiming, FrequencyPoint, LoopMargins, frequency_response, identify, loop_margins,
};
use hil_sim::rig_file::RigFile;
use serde::{Deserialize, Serialize};

use crate::replay::{RecordedSignal, RecordedSignals};

/// Maximum number of rows.
const MAX_ROWS: usize = 100_000;
/// Number of frequencies of a response.
const POINTS: usize = 80;
/// Segments of a response: a recording has at least three half-overlapping ones.
const SEGMENT_SHARE: usize = 3;
/// Duration of a trial, `s`, and of the rest before the step.
const TRIAL_S: f64 = 1.5;
const BEFORE_S: f64 = 0.1;

/// Rows of a joint.
#[derive(Debug, Deserialize)]
pub(super) struct Rows {
    period_s: f64,
    is_rotary: bool,
    /// Whether the force was measured, not commanded.
    is_measured: bool,
    /// Delay from command to force, ticks.
    delay_ticks: f64,
    position: Vec<f64>,
    force: Vec<f64>,
    /// Empty without a reference.
    reference: Vec<f64>,
}

/// Result of an identification.
#[derive(Debug, Serialize)]
pub(super) struct Identified {
    estimates: Vec<EstimateText>,
    /// RMS share of the force that the model does not explain.
    unexplained: Option<f64>,
    /// Reason why nothing was estimated.
    refused: Option<String>,
    /// Response from reference to position.
    closed_loop: Vec<FrequencyPoint>,
    margins: LoopMargins,
}

#[derive(Debug, Serialize)]
struct EstimateText {
    /// Name for programs.
    quantity: hil_sim::identify::Quantity,
    name: String,
    unit: &'static str,
    /// Value and half width of the 95 % confidence interval.
    value: Option<(f64, f64)>,
}

impl Rows {
    /// Estimates inertia, friction and weight, and the response of the closed loop.
    pub(super) fn identify(&self) -> Result<Identified, String> {
        let rows = self.position.len();
        if rows > MAX_ROWS
            || self.force.len() != rows
            || !(self.reference.is_empty() || self.reference.len() == rows)
        {
            return Err(format!(
                "invalid rows: give up to {MAX_ROWS} positions, as many forces and references"
            ));
        }
        if !(1e-6..=1.0).contains(&self.period_s) {
            return Err(format!("invalid sample period {} s", self.period_s));
        }
        let force_timing = match self.is_measured {
            true => ForceTiming::Measured,
            false => ForceTiming::Held { delay_ticks: self.delay_ticks.clamp(0.0, 10.0) },
        };
        let (period_s, turns) = (self.period_s, self.is_rotary);
        let found = identify(&Experiment {
            period_s,
            position: &self.position,
            force: &self.force,
            force_timing,
            turns,
            others: &[],
        });
        let segment = (rows / SEGMENT_SHARE + 1).next_power_of_two() / 2;
        let closed_loop = frequency_response(period_s, &self.reference, &self.position, segment, POINTS)
            .unwrap_or_default();
        let (identified, refused) = match found {
            Ok(identified) => (Some(identified), None),
            Err(error) => (None, Some(error.to_string())),
        };
        let estimates =
            identified.iter().flat_map(|identified| &identified.estimates).map(|estimate| EstimateText {
                quantity: estimate.quantity,
                name: estimate.quantity.to_string(),
                unit: estimate.quantity.unit(turns),
                value: estimate.value,
            });
        Ok(Identified {
            estimates: estimates.collect(),
            unexplained: identified.as_ref().map(|identified| identified.unexplained),
            refused,
            margins: loop_margins(&closed_loop),
            closed_loop,
        })
    }
}

/// A trial of a scheme with an identified joint.
#[derive(Debug, Deserialize)]
pub(super) struct Trial {
    name: String,
    period_s: f64,
    is_rotary: bool,
    delay_ticks: f64,
    inertia: f64,
    viscous: f64,
    coulomb: f64,
    /// Size of the step of the reference.
    step: f64,
    /// Scheme as rows.
    rows: String,
    /// Changed parameters, by module and name.
    set: BTreeMap<String, BTreeMap<String, f64>>,
}

impl Trial {
    /// Simulates a step of the reference; returns the signals of the controller.
    pub(super) fn run(&self, kinds: ModuleKinds) -> Result<RecordedSignals, String> {
        let folder =
            tempfile::tempdir().map_err(|error| format!("cannot create a temporary folder: {error}"))?;
        std::fs::write(folder.path().join("trial.scheme"), &self.rows).map_err(|error| error.to_string())?;
        let mut file = RigFile::read(&self.rig()?, "the trial", folder.path().to_owned(), &[])
            .map_err(|error| error.to_string())?;
        file.kinds = kinds;
        let run = experiment::run(&file).map_err(|error| error.to_string())?;
        let recording = &run.recording;
        let mut signals = Vec::new();
        let mut columns = Vec::new();
        for (place, column) in
            recording.columns().iter().enumerate().filter(|(_, column)| column.source == "joint")
        {
            let name = format!("{}{}", column.signal, hil_sim::recording::format_indices(&column.indices));
            // A single axis: the first word has the plain name, as on the page.
            let name = name.strip_suffix("[0]").unwrap_or(&name).to_owned();
            signals.push(RecordedSignal { name, unit: column.unit.clone(), words: 1 });
            #[expect(clippy::cast_possible_truncation, reason = "to be drawn")]
            columns.push(recording.column(place).map(|value| value as f32).collect());
        }
        let times_s: Vec<f64> = recording.time_s().iter().map(|time_s| time_s - BEFORE_S).collect();
        let mut found = RecordedSignals::default();
        found.name.clone_from(&self.name);
        found.ticks = (0..times_s.len() as u64).collect();
        (found.signals, found.times_s, found.columns) = (signals, times_s, columns);
        Ok(found)
    }

    /// Returns the rig file of the trial.
    fn rig(&self) -> Result<String, String> {
        let numbers = [self.period_s, self.delay_ticks, self.inertia, self.viscous, self.coulomb, self.step];
        let sets = self.set.values().flat_map(BTreeMap::values);
        if !numbers.iter().chain(sets).all(|number| number.is_finite()) {
            return Err("invalid trial: a number is NaN or infinite".to_owned());
        }
        let unit = if self.is_rotary { "rad" } else { "m" };
        let set: toml::Table = self
            .set
            .iter()
            .map(|(module, values)| {
                let values = values.iter().map(|(name, value)| (name.clone(), toml::Value::Float(*value)));
                (module.clone(), toml::Value::Table(values.collect()))
            })
            .collect();
        let set = toml::Value::Table(set);
        Ok(format!(
            "duration_s = {TRIAL_S:?}
sample_period_s = {:?}

[[device]]
name = \"joint\"
measures = [\"POSITION\", \"DES_POSITION\"]
delay_ticks = {:?}

[[device.axis]]
unit = \"{unit}\"
plant.load = {{ inertia = {:?}, damping = {:?} }}
plant.friction = {{ coulomb = {:?} }}

[[controller]]
device = \"joint\"
scheme = \"trial.scheme\"
set = {set}

[[experiment.move]]
device = \"joint\"
on = \"DES_POSITION\"
step = {{ at_s = {BEFORE_S:?}, amplitude = {:?} }}
",
            self.period_s,
            self.delay_ticks.clamp(0.0, 3.0),
            self.inertia,
            self.viscous.max(0.0),
            self.coulomb.max(0.0),
            self.step
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(rows: &str) -> Trial {
        Trial {
            name: "trial".to_owned(),
            period_s: 1e-3,
            is_rotary: true,
            delay_ticks: 0.0,
            inertia: 0.1,
            viscous: 0.0,
            coulomb: 0.0,
            step: 0.5,
            rows: rows.to_owned(),
            set: BTreeMap::from([(
                "PDCTRL_MOD".to_owned(),
                BTreeMap::from([("K_PARAM".to_owned(), 40.0), ("D_PARAM".to_owned(), 2.0)]),
            )]),
        }
    }

    #[test]
    fn a_trial_follows_the_closed_form_of_its_joint() {
        let rows = "all PDCTRL_MOD K_PARAM 1\nall MOD_ENG MOD_ON PDCTRL_MOD\nall MOD_ENG MATCHING_CHECK\n";
        let signals = trial(rows).run(dimsart_modules::ALL).unwrap();
        let place = signals.signals.iter().position(|signal| signal.name == "POSITION").unwrap();
        // x'' = 400 (r - x) + 20 (r - x)': a step of r adds 20 * step to the speed, so x = r (1 - e^(-10 t) (cos wt - 10/w sin wt)).
        let w = (400.0_f64 - 100.0).sqrt();
        for (time_s, found) in signals.times_s.iter().zip(&signals.columns[place]) {
            let t = time_s.max(0.0);
            let expected = 0.5 * (1.0 - (-10.0 * t).exp() * ((w * t).cos() - 10.0 / w * (w * t).sin()));
            assert!((f64::from(*found) - expected).abs() < 0.012, "{time_s} s: {found} {expected}");
        }
    }

    #[test]
    fn an_invalid_trial_is_refused_with_its_reason() {
        let error = trial("all NO_MOD K_PARAM 1\n").run(dimsart_modules::ALL).unwrap_err();
        assert!(error.contains("NO_MOD"), "{error}");
        let error = Trial { inertia: f64::NAN, ..trial("") }.run(dimsart_modules::ALL).unwrap_err();
        assert!(error.contains("NaN"), "{error}");
    }
}
