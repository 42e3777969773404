//! A sensor: what it shows of a quantity, and what goes wrong with it.
//!
//! `shown = floor((gain · truth + offset + noise) / step) · step`: an encoder counts whole steps, so it is up to one step
//! behind; its quantisation is white noise of `step²/12` once it moves by many.

use serde::{Deserialize, Serialize};

use super::parameter::{ParameterError, finite, not_negative};
use crate::bus::Random;

/// An encoder, a tachometer, a torque or current sensor. All numbers are in the unit of what it shows.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorParameters {
    /// What one unit of the truth shows as.
    pub gain: f64,
    /// Shown at zero; of an encoder, where its index is.
    pub offset: f64,
    /// Standard deviation of the noise in every sample, >= 0.
    pub noise: f64,
    /// One count, >= 0; 0 shows every value.
    pub step: f64,
    /// From when on it shows what it showed then, `s`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stuck_at_s: Option<f64>,
    /// From when on it shows so much more, `s`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jump_at_s: Option<f64>,
    /// By how much it jumps then.
    pub jump: f64,
}

impl Default for SensorParameters {
    /// The truth.
    fn default() -> Self {
        Self { gain: 1.0, offset: 0.0, noise: 0.0, step: 0.0, stuck_at_s: None, jump_at_s: None, jump: 0.0 }
    }
}

impl SensorParameters {
    /// Says whether a sensor like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        finite("gain", self.gain)?;
        finite("offset", self.offset)?;
        not_negative("noise", self.noise)?;
        not_negative("step", self.step)?;
        finite("jump", self.jump)
    }

    /// One whose noise comes from `seed`.
    #[must_use]
    pub fn build(&self, seed: u64) -> Sensor {
        Sensor { parameters: self.clone(), random: Random::new(seed), shown: f64::NAN }
    }
}

/// One sensor. The same seed gives the same noise.
#[derive(Debug)]
pub struct Sensor {
    parameters: SensorParameters,
    random: Random,
    shown: f64,
}

impl Sensor {
    /// What it shows at a time, `s`, of the truth.
    pub fn show(&mut self, time_s: f64, truth: f64) -> f64 {
        let SensorParameters { gain, offset, noise, step, stuck_at_s, jump_at_s, jump } = self.parameters;
        let is_after = |at_s: Option<f64>| at_s.is_some_and(|at_s| time_s >= at_s - TICK_ROUNDING_S);
        if is_after(stuck_at_s) && !self.shown.is_nan() {
            return self.shown;
        }
        let noise = if noise > 0.0 { noise * self.random.normal() } else { 0.0 };
        let jump = if is_after(jump_at_s) { jump } else { 0.0 };
        let value = gain * truth + offset + noise + jump;
        self.shown = if step > 0.0 { (value / step).floor() * step } else { value };
        self.shown
    }
}

/// What a tick's time may be less than a multiple of the period by rounding, `s`.
const TICK_ROUNDING_S: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(text: &str) -> Sensor {
        let parameters: SensorParameters = toml::from_str(text).unwrap();
        parameters.check().unwrap();
        parameters.build(7)
    }

    #[test]
    fn an_encoder_is_behind_by_less_than_a_count_and_by_half_of_one_on_average() {
        let mut encoder = sensor("step = 0.01");
        let behind = |n: i32| f64::from(n) * 1e-4 - encoder.show(0.0, f64::from(n) * 1e-4);
        let behind: Vec<f64> = (-5000..5000).map(behind).collect();
        assert!(behind.iter().all(|off| (-1e-12..0.01).contains(off)));
        let mean = behind.iter().sum::<f64>() / 1e4;
        assert!((mean - 0.005).abs() < 1e-4, "{mean}");
        let variance = behind.iter().map(|off| (off - mean) * (off - mean)).sum::<f64>() / 1e4;
        assert!((variance / (1e-4 / 12.0) - 1.0).abs() < 0.01, "{variance}");
    }

    /// Within four standard deviations of both estimates.
    #[test]
    fn noise_has_its_mean_and_its_deviation() {
        let mut tachometer = sensor("noise = 0.2\ngain = 2.0\noffset = 0.5");
        let shown: Vec<f64> = (0..40_000).map(|_| tachometer.show(0.0, 1.0)).collect();
        let mean = shown.iter().sum::<f64>() / 4e4;
        let variance = shown.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / 4e4;
        assert!((mean - 2.5).abs() < 4.0 * 0.2 / 200.0, "{mean}");
        assert!((variance / 0.04 - 1.0).abs() < 4.0 * libm::sqrt(2.0 / 4e4), "{variance}");
        let near = shown.iter().filter(|value| (*value - 2.5).abs() < 0.2).count();
        assert!((27_000..27_700).contains(&near), "a normal one has 68.3 % within its deviation: {near}");
    }

    #[test]
    fn it_jumps_and_sticks_when_told_to() {
        let mut encoder = sensor("jump_at_s = 1.0\njump = 5.0\nstuck_at_s = 2.0");
        let shown = [0.0, 0.999, 1.0, 1.5, 2.0, 9.0].map(|time_s| encoder.show(time_s, time_s));
        assert_eq!(shown.map(f64::to_bits), [0.0, 0.999, 6.0, 6.5, 6.5, 6.5].map(f64::to_bits));
    }
}
