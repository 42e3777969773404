//! Margins of a position loop from its measured closed-loop response.

use std::f64::consts::{PI, TAU};

use super::FrequencyPoint;

/// Minimum coherence of a used point.
const MIN_COHERENCE: f64 = 0.8;

/// Margins of a loop. `None` for a margin whose crossing is outside the measured frequencies.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct LoopMargins {
    /// Frequency at which the loop gain falls below 1, `Hz`, and phase margin, `rad`.
    pub crossover: Option<(f64, f64)>,
    /// Frequency at which the loop's phase passes -π, `Hz`, and gain margin (factor).
    pub phase_crossing: Option<(f64, f64)>,
    /// Bandwidth, `Hz`: the response from reference to position falls below -3 dB.
    pub bandwidth_hz: Option<f64>,
}

/// Computes the margins of a loop from its closed-loop response `T` from reference to position: `L = T / (1 - T)`. Uses points
/// with a coherence of at least 0.8, and interpolates the logarithm of the gain.
#[must_use]
pub fn loop_margins(closed_loop: &[FrequencyPoint]) -> LoopMargins {
    let used = closed_loop.iter().filter(|point| point.coherence >= MIN_COHERENCE);
    let (mut margins, mut last): (LoopMargins, Option<LoopPoint>) = (LoopMargins::default(), None);
    for point in used.map(LoopPoint::of) {
        if let Some(before) = last {
            let share = |level: f64, one: f64, next: f64| (level - one) / (next - one);
            let at =
                |share: f64| before.frequency_hz * (point.frequency_hz / before.frequency_hz).powf(share);
            let between = |one: f64, next: f64, share: f64| one + share * (next - one);
            // The phase continues from the point before.
            let phase = before.phase_rad + wrapped(point.phase_rad - before.phase_rad);
            if before.log_gain > 0.0 && point.log_gain <= 0.0 && margins.crossover.is_none() {
                let share = share(0.0, before.log_gain, point.log_gain);
                let margin = wrapped(between(before.phase_rad, phase, share) + PI);
                margins.crossover = Some((at(share), margin));
            }
            let turns = ((before.phase_rad - PI) / TAU).floor() * TAU + PI;
            // Only beyond the crossover: an integral also passes -π where the loop gain is high.
            let is_beyond = before.log_gain < 0.0 && margins.phase_crossing.is_none();
            if is_beyond && before.phase_rad > turns && phase <= turns {
                let share = share(turns, before.phase_rad, phase);
                let log_gain = between(before.log_gain, point.log_gain, share);
                margins.phase_crossing = Some((at(share), (-log_gain).exp()));
            }
            let half_power = -0.5 * std::f64::consts::LN_2;
            if before.log_closed > half_power
                && point.log_closed <= half_power
                && margins.bandwidth_hz.is_none()
            {
                margins.bandwidth_hz = Some(at(share(half_power, before.log_closed, point.log_closed)));
            }
            last = Some(LoopPoint { phase_rad: phase, ..point });
        } else {
            last = Some(point);
        }
    }
    margins
}

/// Loop gain at a frequency.
#[derive(Debug, Clone, Copy)]
struct LoopPoint {
    frequency_hz: f64,
    log_gain: f64,
    phase_rad: f64,
    /// Logarithm of the closed-loop gain.
    log_closed: f64,
}

impl LoopPoint {
    fn of(point: &FrequencyPoint) -> Self {
        let (sin, cos) = point.phase_rad.sin_cos();
        let (real, imaginary) = (point.gain * cos, point.gain * sin);
        let (rest, rest_phase_rad) = ((1.0 - real).hypot(imaginary), (-imaginary).atan2(1.0 - real));
        Self {
            frequency_hz: point.frequency_hz,
            log_gain: (point.gain / rest).ln(),
            phase_rad: wrapped(point.phase_rad - rest_phase_rad),
            log_closed: point.gain.ln(),
        }
    }
}

/// Returns an angle within ±π.
fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `L = ω² e^(-jωT) / (s (s + 2 ζ ω))` at logarithmically spaced frequencies.
    fn closed(natural: f64, damping: f64, delay_s: f64) -> Vec<FrequencyPoint> {
        let point = |step: i32| {
            let frequency_hz = 0.1 * 1.02_f64.powi(step);
            let w = TAU * frequency_hz;
            let gain = natural * natural / (w * w.hypot(2.0 * damping * natural));
            let phase = -PI / 2.0 - (w / (2.0 * damping * natural)).atan() - w * delay_s;
            let (re, im) = (gain * phase.cos(), gain * phase.sin());
            let (below, below_phase) = ((1.0 + re).hypot(im), im.atan2(1.0 + re));
            let phase_rad = wrapped(phase - below_phase);
            FrequencyPoint { frequency_hz, gain: gain / below, phase_rad, coherence: 1.0 }
        };
        (0..400).map(point).collect()
    }

    #[test]
    fn margins_of_a_second_order_loop_have_their_closed_forms() {
        let (natural, damping) = (20.0, 0.4_f64);
        let margins = loop_margins(&closed(natural, damping, 0.0));
        // K. Ogata, "Modern Control Engineering", chapter 7.
        let ratio = ((1.0 + 4.0 * damping.powi(4)).sqrt() - 2.0 * damping * damping).sqrt();
        let (crossover_hz, margin) = margins.crossover.unwrap();
        assert!((crossover_hz / (ratio * natural / TAU) - 1.0).abs() < 1e-3, "{crossover_hz}");
        assert!((margin - (2.0 * damping / ratio).atan()).abs() < 1e-3, "{margin}");
        let squared = 1.0 - 2.0 * damping * damping;
        let bandwidth_hz = natural / TAU * (squared + (squared * squared + 1.0).sqrt()).sqrt();
        assert!((margins.bandwidth_hz.unwrap() / bandwidth_hz - 1.0).abs() < 1e-3);
        // Its phase approaches -π without reaching it.
        assert_eq!(margins.phase_crossing, None);
    }

    #[test]
    fn a_delay_limits_the_gain_margin() {
        let margins = loop_margins(&closed(20.0, 0.4, 0.01));
        let (frequency_hz, factor) = margins.phase_crossing.unwrap();
        let w = TAU * frequency_hz;
        // At the crossing, the phase is -π and the margin is the inverse gain.
        assert!((PI / 2.0 + (w / 16.0).atan() + 0.01 * w - PI).abs() < 1e-3);
        assert!((factor / (w * w.hypot(16.0) / 400.0) - 1.0).abs() < 1e-3, "{factor}");
    }

    #[test]
    fn points_without_coherence_are_not_used() {
        let points: Vec<_> = closed(20.0, 0.4, 0.0)
            .into_iter()
            .map(|point| FrequencyPoint { coherence: 0.5, ..point })
            .collect();
        assert_eq!(loop_margins(&points), LoopMargins::default());
    }
}
