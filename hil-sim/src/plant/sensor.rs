//! Sensors: encoder, tachometer, current or torque sensor, and their faults.
//!
//! `shown = counted(gain · truth + offset + noise + jump)`, rounded down to counts for an encoder.

use super::parameter::{ParameterError, finite, not_negative, require};
use crate::bus::Random;
use serde::{Deserialize, Serialize};

/// Parameters of a sensor. `unit` is the unit of its quantity: `rad`, `m/s`, `A`, `N m`, ...
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorParameters {
    /// Gain; 1 is ideal.
    pub gain: f64,
    /// Offset, unit; of an encoder: offset of its index.
    pub offset: f64,
    /// Counts per unit, >= 0; 0: no quantisation. Shows completed counts, up to one count below the true value.
    pub counts_per_unit: f64,
    /// Size of a count, unit, >= 0, instead of `counts_per_unit`; 0: no quantisation.
    pub step: f64,
    /// Standard deviation of Gaussian noise, unit, >= 0, sampled at each reading before quantisation.
    pub noise_deviation: f64,
    /// Random seed of the noise.
    pub seed: u64,
    /// Time of a jump by `jump`, `s`; `inf`: never.
    pub jump_at_s: f64,
    /// Size of the jump, unit.
    pub jump: f64,
    /// Time from which it is stuck at its last value, `s`; `inf`: never.
    pub stuck_from_s: f64,
    /// Index position of an incremental encoder, unit: before the index, it shows the displacement since power-on.
    /// `None`: absolute encoder.
    pub index: Option<f64>,
}

impl Default for SensorParameters {
    /// An ideal sensor.
    fn default() -> Self {
        Self {
            gain: 1.0,
            offset: 0.0,
            counts_per_unit: 0.0,
            step: 0.0,
            noise_deviation: 0.0,
            seed: 1,
            jump_at_s: f64::INFINITY,
            jump: 0.0,
            stuck_from_s: f64::INFINITY,
            index: None,
        }
    }
}

impl SensorParameters {
    /// Checks whether the parameters are valid.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn check(&self) -> Result<(), ParameterError> {
        let time =
            |path, time_s: f64| require(path, time_s, !time_s.is_nan(), "a time in s, or inf for never");
        finite("gain", self.gain)?;
        finite("offset", self.offset)?;
        not_negative("counts_per_unit", self.counts_per_unit)?;
        not_negative("step", self.step)?;
        require("step", self.step, self.step * self.counts_per_unit <= 0.0, "0 with `counts_per_unit`")?;
        not_negative("noise_deviation", self.noise_deviation)?;
        time("jump_at_s", self.jump_at_s)?;
        finite("jump", self.jump)?;
        self.index.map_or(Ok(()), |index| finite("index", index))?;
        time("stuck_from_s", self.stuck_from_s)
    }

    /// Builds the sensor.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn build(&self) -> Result<Sensor, ParameterError> {
        self.check()?;
        let is_ideal = *self == Self { seed: self.seed, ..Self::default() };
        let parameters = self.clone();
        Ok(Sensor { parameters, is_ideal, noise: Random::new(self.seed), shown: None, switched_on: None })
    }
}

/// Simulation of a sensor.
#[derive(Debug, Clone)]
pub struct Sensor {
    parameters: SensorParameters,
    is_ideal: bool,
    noise: Random,
    /// Last reading.
    shown: Option<f64>,
    /// Power-on position, and whether the index has passed since.
    switched_on: Option<(f64, bool)>,
}

impl Sensor {
    /// Whether it is ideal.
    #[must_use]
    pub fn is_ideal(&self) -> bool {
        self.is_ideal
    }

    /// Reads the sensor at `truth` and `time_s`. A sensor that is stuck before its first reading keeps this reading.
    #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
    pub fn measure(&mut self, time_s: f64, truth: f64) -> f32 {
        let is_stuck = time_s >= self.parameters.stuck_from_s;
        let shown = match self.shown {
            Some(shown) if is_stuck => shown,
            _ => self.read(time_s, truth),
        };
        self.shown = Some(shown);
        shown as f32
    }

    fn read(&mut self, time_s: f64, truth: f64) -> f64 {
        let Self { parameters, noise, switched_on, .. } = self;
        let (start, has_passed) = switched_on.get_or_insert((truth, false));
        let way = parameters.index.map_or(0.0, |index| {
            *has_passed |= (*start - index) * (truth - index) <= 0.0;
            if *has_passed { 0.0 } else { *start }
        });
        let mut seen = parameters.gain * (truth - way) + parameters.offset;
        if parameters.noise_deviation > 0.0 {
            seen += parameters.noise_deviation * noise.normal();
        }
        if time_s >= parameters.jump_at_s {
            seen += parameters.jump;
        }
        if parameters.counts_per_unit > 0.0 {
            seen = (seen * parameters.counts_per_unit).floor() / parameters.counts_per_unit;
        }
        if parameters.step > 0.0 {
            seen = (seen / parameters.step).floor() * parameters.step;
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(parameters: SensorParameters) -> Sensor {
        parameters.build().unwrap()
    }

    #[test]
    fn an_ideal_sensor_shows_the_truth_and_another_its_gain_and_offset() {
        assert!((sensor(SensorParameters::default()).measure(0.0, 0.25) - 0.25).abs() <= 0.0);
        let scaled = SensorParameters { gain: 1.5, offset: -0.5, ..SensorParameters::default() };
        assert!((sensor(scaled).measure(0.0, 2.0) - 2.5).abs() <= 0.0);
    }

    /// Completed counts, less than one below the true value; the rest is `f32` rounding.
    #[test]
    fn an_encoder_shows_whole_counts_less_than_one_behind() {
        let counts = 4096.0 / core::f64::consts::TAU;
        let mut encoder = sensor(SensorParameters { counts_per_unit: counts, ..SensorParameters::default() });
        let mut worst = 0.0_f64;
        for k in -5000..5000_i32 {
            let truth = f64::from(k) * 1.237e-4;
            let shown = f64::from(encoder.measure(0.0, truth));
            assert!((shown * counts - (shown * counts).round()).abs() < 1e-4, "{shown} is no whole count");
            worst = worst.max(truth - shown);
            assert!((-1e-7..1.0 / counts + 1e-7).contains(&(truth - shown)), "{truth} shown as {shown}");
        }
        assert!(worst > 0.99 / counts, "{worst}");
    }

    /// Standard errors of `n` samples: `s/sqrt(n)` of the mean and `s/sqrt(2 n)` of the deviation.
    #[test]
    fn noise_has_its_deviation_and_no_mean_and_its_seed() {
        let draws = 100_000_u32;
        let parameters = SensorParameters { noise_deviation: 0.02, seed: 7, ..SensorParameters::default() };
        let run = |parameters: &SensorParameters| {
            let mut noisy = sensor(parameters.clone());
            (0..draws).map(|_| f64::from(noisy.measure(0.0, 0.0))).collect::<Vec<_>>()
        };
        let seen = run(&parameters);
        let count = f64::from(draws);
        let mean = seen.iter().sum::<f64>() / count;
        let deviation = (seen.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
        println!("noise: mean {mean:.1e}, deviation {deviation:.5} for 0.02");
        assert!(mean.abs() < 4.0 * 0.02 / count.sqrt(), "mean {mean}");
        assert!((deviation - 0.02).abs() < 4.0 * 0.02 / (2.0 * count).sqrt(), "deviation {deviation}");
        let within = seen.iter().filter(|value| value.abs() < 0.02).count();
        assert!(
            (67_600..68_900).contains(&within),
            "{within} of 100000 within one deviation, normal has 68269"
        );
        assert_eq!(seen, run(&parameters));
        assert_ne!(seen, run(&SensorParameters { seed: 8, ..parameters }));
    }

    #[test]
    fn an_incremental_encoder_knows_where_it_is_once_its_index_has_passed() {
        let mut encoder = sensor(SensorParameters { index: Some(0.5), ..SensorParameters::default() });
        for (truth, shown) in [(0.2, 0.0), (0.4, 0.2), (0.1, -0.1), (0.6, 0.6), (0.1, 0.1), (-3.0, -3.0)] {
            assert!((encoder.measure(0.0, truth) - shown).abs() < 1e-7, "{truth}");
        }
        let mut other = sensor(SensorParameters { index: Some(-0.5), ..SensorParameters::default() });
        assert!(
            [0.2, -0.4, -0.6]
                .map(|truth| other.measure(0.0, truth))
                .iter()
                .zip([0.0, -0.6, -0.6])
                .all(|(a, b)| (a - b).abs() < 1e-6)
        );
    }

    #[test]
    fn a_sensor_jumps_and_sticks_when_it_is_told() {
        let mut faulty = sensor(SensorParameters {
            jump_at_s: 0.1,
            jump: 0.5,
            stuck_from_s: 0.2,
            ..SensorParameters::default()
        });
        for tick in 0..300_u32 {
            let t = f64::from(tick) * 1e-3;
            let expected = match tick {
                0..100 => t,
                100..200 => t + 0.5,
                _ => 0.699,
            };
            let shown = f64::from(faulty.measure(t, t));
            assert!((shown - expected).abs() < 1e-7, "{shown} at {t} s instead of {expected}");
        }
    }

    #[test]
    fn impossible_sensors_are_refused() {
        for (file, path) in [
            ("gain = nan", "gain"),
            ("counts_per_unit = -1.0", "counts_per_unit"),
            ("noise_deviation = -1.0", "noise_deviation"),
            ("jump_at_s = nan", "jump_at_s"),
            ("jump = inf", "jump"),
            ("stuck_from_s = nan", "stuck_from_s"),
        ] {
            let parameters: SensorParameters = toml::from_str(file).unwrap();
            assert_eq!(parameters.check().unwrap_err().path, path);
        }
        assert!(toml::from_str::<SensorParameters>("counts = 3").is_err());
    }
}
