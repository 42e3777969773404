//! What a controller sees of the truth: encoder, tachometer, current or torque sensor, and their faults.
//!
//! `shown = counted(gain · truth + offset + noise + jump)`, whole counts as an encoder counts them.

use super::parameter::{ParameterError, finite, not_negative, require};
use crate::bus::Random;
use serde::{Deserialize, Serialize};

/// One sensor. `unit` is that of what it measures: `rad`, `m/s`, `A`, `N m`...
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorParameters {
    /// Shown per true unit; 1 is ideal.
    pub gain: f64,
    /// Shown at a truth of 0, unit; for an encoder the offset of its index.
    pub offset: f64,
    /// Counts per unit, >= 0; 0 for a sensor that does not count. It shows whole counts passed, so up to one count
    /// less than there is.
    pub counts_per_unit: f64,
    /// Length of a count, unit, >= 0, in place of `counts_per_unit`; 0 for a sensor that does not count.
    pub step: f64,
    /// Standard deviation of normal noise, unit, >= 0, drawn anew each time it is read, ahead of the counting.
    pub noise_deviation: f64,
    /// The same seed gives the same noise.
    pub seed: u64,
    /// From this time on it is off by `jump`, `s`; `inf` for never.
    pub jump_at_s: f64,
    /// Unit.
    pub jump: f64,
    /// From this time on it shows what it showed before, `s`; `inf` for never.
    pub stuck_from_s: f64,
    /// Where an incremental encoder has its index, unit: until the truth has passed it, it shows the way from where it was
    /// switched on. None for an absolute one.
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
    /// Says whether a sensor like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self) -> Result<(), ParameterError> {
        let time = |path, time_s: f64| require(path, time_s, !time_s.is_nan(), "a time, or inf for never");
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

    /// The sensor these parameters describe.
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

/// One sensor as it is read.
#[derive(Debug, Clone)]
pub struct Sensor {
    parameters: SensorParameters,
    is_ideal: bool,
    noise: Random,
    /// What it showed last.
    shown: Option<f64>,
    /// The truth where it was switched on, and whether the index has passed since.
    switched_on: Option<(f64, bool)>,
}

impl Sensor {
    /// Whether it shows the truth.
    #[must_use]
    pub fn is_ideal(&self) -> bool {
        self.is_ideal
    }

    /// What it shows of `truth` at `time_s`, both in the sensor's unit. Stuck before its first reading, it shows that
    /// one for good.
    #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
    pub fn show(&mut self, time_s: f64, truth: f64) -> f32 {
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
        assert!((sensor(SensorParameters::default()).show(0.0, 0.25) - 0.25).abs() <= 0.0);
        let scaled = SensorParameters { gain: 1.5, offset: -0.5, ..SensorParameters::default() };
        assert!((sensor(scaled).show(0.0, 2.0) - 2.5).abs() <= 0.0);
    }

    /// Whole counts, behind the truth by less than one; what is left is `f32`.
    #[test]
    fn an_encoder_shows_whole_counts_less_than_one_behind() {
        let counts = 4096.0 / core::f64::consts::TAU;
        let mut encoder = sensor(SensorParameters { counts_per_unit: counts, ..SensorParameters::default() });
        let mut worst = 0.0_f64;
        for k in -5000..5000_i32 {
            let truth = f64::from(k) * 1.237e-4;
            let shown = f64::from(encoder.show(0.0, truth));
            assert!((shown * counts - (shown * counts).round()).abs() < 1e-4, "{shown} is no whole count");
            worst = worst.max(truth - shown);
            assert!((-1e-7..1.0 / counts + 1e-7).contains(&(truth - shown)), "{truth} shown as {shown}");
        }
        assert!(worst > 0.99 / counts, "{worst}");
    }

    /// Of `n` draws the mean is off by `s/sqrt(n)` and the deviation by `s/sqrt(2 n)`, each as a standard deviation.
    #[test]
    fn noise_has_its_deviation_and_no_mean_and_its_seed() {
        let draws = 100_000_u32;
        let parameters = SensorParameters { noise_deviation: 0.02, seed: 7, ..SensorParameters::default() };
        let run = |parameters: &SensorParameters| {
            let mut noisy = sensor(parameters.clone());
            (0..draws).map(|_| f64::from(noisy.show(0.0, 0.0))).collect::<Vec<_>>()
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
            assert!((encoder.show(0.0, truth) - shown).abs() < 1e-7, "{truth}");
        }
        let mut other = sensor(SensorParameters { index: Some(-0.5), ..SensorParameters::default() });
        assert!(
            [0.2, -0.4, -0.6]
                .map(|truth| other.show(0.0, truth))
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
            let shown = f64::from(faulty.show(t, t));
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
