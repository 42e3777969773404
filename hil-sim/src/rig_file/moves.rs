//! `[experiment]`: moves of references, loads and hands.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Value of `on` for a load on the axis instead of a signal.
pub const LOAD: &str = "load";
/// Value of `on` for the intended position of the hand.
pub const HAND: &str = "hand";

/// `[experiment]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentSection {
    /// Whether poles, margins and bandwidth of all loops are computed before the run.
    #[serde(default = "yes")]
    pub margins: bool,
    /// Hand that guides, presses and releases, at times derived from the schemes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press: Option<PressSection>,
    /// Simultaneous moves; moves of the same signal add up.
    #[serde(rename = "move", default)]
    pub moves: Vec<MoveSection>,
}

/// `[experiment.press]`: the hand of a device moves along a free path, presses against the environment of the linked
/// device until the contact has settled, and releases.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PressSection {
    /// The device with the hand.
    pub device: String,
    /// Amplitude of the free path: to +path, to -path and back to 0, `m` or `rad`.
    pub path: f64,
    /// Constant force per axis, `N` or `N m`; missing entries are 0, surplus entries are ignored.
    pub force: Vec<f64>,
}

/// `[[experiment.move]]`: one waveform on one signal of one axis. Sizes are in the unit of the signal.
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
    /// Step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Step>,
    /// Ramp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
    /// Minimum-jerk motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_jerk: Option<MinimumJerk>,
    /// Sine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sine: Option<Sine>,
    /// Chirp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chirp: Option<Chirp>,
    /// Pseudo-random binary sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prbs: Option<Prbs>,
    /// Samples of a CSV file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<SamplesFile>,
}

impl MoveSection {
    /// Creates a move without a waveform.
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

    /// Whether it moves this signal of this device, on any axis.
    #[must_use]
    pub fn moves(&self, device: &str, signal: &str) -> bool {
        self.device == device && self.on == signal
    }

    /// Whether its signal is constant from the start.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.step.as_ref().is_some_and(|step| step.at_s <= 0.0)
    }

    /// Returns its errors, without those that depend on the rest of the file.
    pub(super) fn problems(&self) -> Vec<String> {
        let mut forms = Vec::new();
        let mut numbers = Vec::new();
        let mut spans = Vec::new();
        if let Some(Step { at_s, amplitude }) = &self.step {
            forms.push("step");
            numbers.extend([("at_s", *at_s), ("amplitude", *amplitude)]);
        }
        if let Some(Ramp { at_s, until_s, amplitude }) = &self.ramp {
            forms.push("ramp");
            numbers.extend([("at_s", *at_s), ("until_s", *until_s), ("amplitude", *amplitude)]);
            spans.push((*at_s, *until_s));
        }
        if let Some(MinimumJerk { at_s, until_s, amplitude }) = &self.minimum_jerk {
            forms.push("minimum_jerk");
            numbers.extend([("at_s", *at_s), ("until_s", *until_s), ("amplitude", *amplitude)]);
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
            if !(*bit_s > 0.0 && (until_s - at_s) / bit_s <= MAX_BITS) {
                problems
                    .push(format!("bit_s is {bit_s} s, must be > 0 s and produce at most {MAX_BITS} bits"));
            }
        }
        if let Some(SamplesFile { at_s, .. }) = &self.samples {
            forms.push("samples");
            numbers.push(("at_s", *at_s));
        }
        if forms.len() != 1 {
            let has = if forms.is_empty() { "no waveform".to_owned() } else { forms.join(" and ") };
            problems.push(format!("has {has}: set exactly one of {}", FORMS.join(", ")));
        }
        let not_finite = numbers.into_iter().filter(|(_, number)| !number.is_finite());
        problems.extend(not_finite.map(|(key, number)| format!("{key} is {number}, must be finite")));
        let backwards = spans.into_iter().filter(|(at_s, until_s)| until_s <= at_s);
        problems.extend(
            backwards.map(|(at_s, until_s)| format!("until_s is {until_s} s, must be after at_s, {at_s} s")),
        );
        problems
    }
}

const FORMS: [&str; 7] = ["step", "ramp", "minimum_jerk", "sine", "chirp", "prbs", "samples"];
/// Maximum bits of a pseudo-random sequence.
const MAX_BITS: f64 = 1e6;

/// Step by `amplitude` at `at_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Time, `s`.
    pub at_s: f64,
    /// Size.
    pub amplitude: f64,
}

/// Ramp by `amplitude` from `at_s` to `until_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Ramp {
    /// Start time, `s`.
    pub at_s: f64,
    /// End time, `s`.
    pub until_s: f64,
    /// Size.
    pub amplitude: f64,
}

/// Minimum-jerk motion by `amplitude (10 t³ - 15 t⁴ + 6 t⁵)`, `t` from 0 at `at_s` to 1 at `until_s` (Flash and Hogan
/// 1985).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MinimumJerk {
    /// Start time, `s`.
    pub at_s: f64,
    /// End time, `s`.
    pub until_s: f64,
    /// Size.
    pub amplitude: f64,
}

/// `amplitude sin(2 π frequency_hz (t - at_s))` from `at_s` to `until_s`, 0 before and after.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// Start time, `s`.
    pub at_s: f64,
    /// End time, `s`.
    #[serde(default = "for_ever")]
    pub until_s: f64,
    /// Amplitude.
    pub amplitude: f64,
    /// Frequency, `Hz`.
    pub frequency_hz: f64,
}

/// Sine with a frequency that rises linearly from `from_hz` at `at_s` to `to_hz` at `until_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Chirp {
    /// Start time, `s`.
    pub at_s: f64,
    /// End time, `s`.
    pub until_s: f64,
    /// Amplitude.
    pub amplitude: f64,
    /// Start frequency, `Hz`.
    pub from_hz: f64,
    /// End frequency, `Hz`.
    pub to_hz: f64,
}

/// `± amplitude`, one bit of the maximum-length sequence of `x¹⁵ + x¹⁴ + 1` every `bit_s`, from `at_s` to `until_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Prbs {
    /// Start time, `s`.
    pub at_s: f64,
    /// End time, `s`.
    pub until_s: f64,
    /// Amplitude.
    pub amplitude: f64,
    /// Length of a bit, `s`.
    pub bit_s: f64,
}

/// Linear interpolation between the rows of a CSV file: time since `at_s` in s, and value. A non-numeric first row is
/// a header.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SamplesFile {
    /// Start time, `s`.
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
