//! `[experiment]`: what moves.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// `on` of a move that pushes the axis, not a signal.
pub const LOAD: &str = "load";
/// `on` of a move of where the hand wants to be.
pub const HAND: &str = "hand";

/// `[experiment]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentSection {
    /// Whether the poles, margins and bandwidth of every loop are computed before the run.
    #[serde(default = "yes")]
    pub margins: bool,
    /// A hand that guides, pushes and lets go, at times that follow from the schemes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press: Option<PressSection>,
    /// What moves, all of it at once: moves on the same signal add up.
    #[serde(rename = "move", default)]
    pub moves: Vec<MoveSection>,
}

/// `[experiment.press]`: the hand of a device guides it along a free path, presses what the device at the other end of its
/// links meets, until the contact has settled, and lets go.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PressSection {
    /// The device with the hand.
    pub device: String,
    /// The free path goes to + this, to - this and back to 0, `m` or `rad`.
    pub path: f64,
    /// Constant push per axis, `N` or `N m`; missing entries are 0, and those beyond the axes are not used.
    pub force: Vec<f64>,
}

/// `[[experiment.move]]`: on one signal of one axis, in exactly one form. Sizes are in the unit of the signal.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MoveSection {
    /// The device.
    pub device: String,
    /// The axis, from 0.
    #[serde(default)]
    pub axis: usize,
    /// A reference that the device [measures](super::DeviceSection::measures), [`LOAD`] or [`HAND`].
    pub on: String,
    /// Jumps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Step>,
    /// Goes at an even speed, and stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
    /// Goes with the least jerk, and stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_jerk: Option<MinimumJerk>,
    /// Swings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sine: Option<Sine>,
    /// Swings faster and faster.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chirp: Option<Chirp>,
    /// A pseudo-random binary sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prbs: Option<Prbs>,
    /// What a file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<SamplesFile>,
}

impl MoveSection {
    /// A move without a form.
    pub(crate) fn nothing(device: &str, on: &str) -> Self {
        Self {
            device: device.to_owned(),
            axis: 0,
            on: on.to_owned(),
            step: None,
            ramp: None,
            minimum_jerk: None,
            sine: None,
            chirp: None,
            prbs: None,
            samples: None,
        }
    }

    /// Whether it is on this signal of this device, on any axis.
    #[must_use]
    pub fn moves(&self, device: &str, signal: &str) -> bool {
        self.device == device && self.on == signal
    }

    /// Whether its signal has one value from the start on.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.step.as_ref().is_some_and(|step| step.at_s <= 0.0)
    }

    /// What is wrong with it by itself.
    pub(super) fn problems(&self) -> Vec<String> {
        let mut forms = Vec::new();
        let mut numbers = Vec::new();
        let mut spans = Vec::new();
        if let Some(Step { at_s, size }) = &self.step {
            forms.push("step");
            numbers.extend([("at_s", *at_s), ("size", *size)]);
        }
        if let Some(Ramp { at_s, until_s, size }) = &self.ramp {
            forms.push("ramp");
            numbers.extend([("at_s", *at_s), ("until_s", *until_s), ("size", *size)]);
            spans.push((*at_s, *until_s));
        }
        if let Some(MinimumJerk { at_s, until_s, size }) = &self.minimum_jerk {
            forms.push("minimum_jerk");
            numbers.extend([("at_s", *at_s), ("until_s", *until_s), ("size", *size)]);
            spans.push((*at_s, *until_s));
        }
        if let Some(Sine { at_s, until_s, amplitude, frequency_hz }) = &self.sine {
            forms.push("sine");
            numbers.extend([("at_s", *at_s), ("amplitude", *amplitude), ("frequency_hz", *frequency_hz)]);
            spans.push((*at_s, *until_s));
        }
        if let Some(Chirp { at_s, until_s, amplitude, from_hz, to_hz }) = &self.chirp {
            forms.push("chirp");
            numbers.extend([("at_s", *at_s), ("until_s", *until_s), ("amplitude", *amplitude)]);
            numbers.extend([("from_hz", *from_hz), ("to_hz", *to_hz)]);
            spans.push((*at_s, *until_s));
        }
        let mut problems = Vec::new();
        if let Some(Prbs { at_s, until_s, amplitude, bit_s }) = &self.prbs {
            forms.push("prbs");
            numbers.extend([("at_s", *at_s), ("until_s", *until_s), ("amplitude", *amplitude)]);
            spans.push((*at_s, *until_s));
            if !(*bit_s > 0.0 && (until_s - at_s) / bit_s <= MOST_BITS) {
                problems
                    .push(format!("bit_s is {bit_s}: give it a number > 0, for {MOST_BITS} bits at most"));
            }
        }
        if let Some(SamplesFile { at_s, .. }) = &self.samples {
            forms.push("samples");
            numbers.push(("at_s", *at_s));
        }
        if forms.len() != 1 {
            let has = if forms.is_empty() { "no form".to_owned() } else { forms.join(" and ") };
            problems.push(format!("it has {has}: give it one of {}", FORMS.join(", ")));
        }
        let not_finite = numbers.into_iter().filter(|(_, number)| !number.is_finite());
        problems
            .extend(not_finite.map(|(key, number)| format!("{key} is {number}: give it a finite number")));
        let backwards = spans.into_iter().filter(|(at_s, until_s)| until_s <= at_s);
        problems.extend(
            backwards.map(|(at_s, until_s)| format!("until_s is {until_s}: give it one after {at_s}")),
        );
        problems
    }
}

const FORMS: [&str; 7] = ["step", "ramp", "minimum_jerk", "sine", "chirp", "prbs", "samples"];
/// Of a pseudo-random sequence.
const MOST_BITS: f64 = 1e6;

/// By `size` from `at_s` on.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// When, `s`.
    pub at_s: f64,
    /// By how much.
    pub size: f64,
}

/// By `size` from `at_s` to `until_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Ramp {
    /// When it begins, `s`.
    pub at_s: f64,
    /// When it is there, `s`.
    pub until_s: f64,
    /// By how much.
    pub size: f64,
}

/// By `size (10 t³ - 15 t⁴ + 6 t⁵)`, `t` from 0 at `at_s` to 1 at `until_s` (Flash and Hogan 1985).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MinimumJerk {
    /// When it begins, `s`.
    pub at_s: f64,
    /// When it is there, `s`.
    pub until_s: f64,
    /// By how much.
    pub size: f64,
}

/// `amplitude sin(2 π frequency_hz (t - at_s))` from `at_s` to `until_s`, 0 before and after.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// When it begins, `s`.
    pub at_s: f64,
    /// When it ends, `s`.
    #[serde(default = "for_ever")]
    pub until_s: f64,
    /// Half of how far it swings.
    pub amplitude: f64,
    /// How often a second.
    pub frequency_hz: f64,
}

/// A sine whose frequency rises evenly from `from_hz` at `at_s` to `to_hz` at `until_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Chirp {
    /// When it begins, `s`.
    pub at_s: f64,
    /// When it ends, `s`.
    pub until_s: f64,
    /// Half of how far it swings.
    pub amplitude: f64,
    /// Frequency at first.
    pub from_hz: f64,
    /// Frequency at last.
    pub to_hz: f64,
}

/// `± amplitude`, a bit of the maximum-length sequence of `x¹⁵ + x¹⁴ + 1` every `bit_s`, from `at_s` to `until_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Prbs {
    /// When it begins, `s`.
    pub at_s: f64,
    /// When it ends, `s`.
    pub until_s: f64,
    /// Size of both values.
    pub amplitude: f64,
    /// Length of a bit, `s`.
    pub bit_s: f64,
}

/// Lines between the rows of a CSV file: time since `at_s` in s, and value. A first row that is no number is a header.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SamplesFile {
    /// When its time begins, `s`.
    #[serde(default)]
    pub at_s: f64,
    /// The file.
    pub file: PathBuf,
}

const fn yes() -> bool {
    true
}

fn for_ever() -> f64 {
    f64::INFINITY
}
