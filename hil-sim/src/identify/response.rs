//! Frequency response of recorded data: Welch's averaged cross spectrum divided by the input spectrum.
//!
//! `H1(f) = S_uy(f) / S_uu(f)`, segments with a Hann window, 50 % overlap, mean removed (P. D. Welch, IEEE Trans.
//! Audio and Electroacoustics 15(2), 1967; J. S. Bendat, A. G. Piersol, *Random Data*). The coherence is the share of
//! the output explained by the input: the response is valid only where it is high.

use super::count;

/// Response at a frequency.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct FrequencyPoint {
    /// `Hz`.
    pub frequency_hz: f64,
    /// Gain, output/input.
    pub gain: f64,
    /// Phase lead of the output, `rad`, within ±π.
    pub phase_rad: f64,
    /// 0 to 1.
    pub coherence: f64,
}

/// Too few segments to average.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "recording of {ticks} ticks is too short: a response with segments of {segment} ticks requires {needed} ticks"
)]
pub struct ResponseTooShort {
    /// Available ticks.
    pub ticks: usize,
    /// Ticks of a segment.
    pub segment: usize,
    /// Required ticks.
    pub needed: usize,
}

/// Minimum number of segments.
const MIN_SEGMENTS: usize = 4;

/// Estimates the response from `input` to `output` at `points` frequencies, logarithmically spaced.
///
/// # Errors
/// [`ResponseTooShort`].
pub fn frequency_response(
    period_s: f64,
    input: &[f64],
    output: &[f64],
    segment: usize,
    points: usize,
) -> Result<Vec<FrequencyPoint>, ResponseTooShort> {
    let ticks = input.len().min(output.len());
    let needed = segment * (MIN_SEGMENTS + 1) / 2;
    if ticks < needed || segment < 4 {
        return Err(ResponseTooShort { ticks, segment, needed });
    }
    let bins = bins(segment / 2, points);
    Ok(bins.into_iter().map(|bin| point(period_s, input, output, segment, bin)).collect())
}

/// Distinct bins from 1.
fn bins(last: usize, points: usize) -> Vec<usize> {
    let exponent = |place: usize| count(place) / count(points.max(2) - 1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to the last bin")]
    let bin = |place: usize| libm::round(libm::pow(count(last), exponent(place))) as usize;
    let mut bins: Vec<usize> = (0..points).map(bin).collect();
    bins.dedup();
    bins
}

fn point(period_s: f64, input: &[f64], output: &[f64], segment: usize, bin: usize) -> FrequencyPoint {
    let (mut input_power, mut output_power, mut cross) = (0.0, 0.0, (0.0, 0.0));
    let segments = input.windows(segment).zip(output.windows(segment)).step_by(segment / 2);
    for (inputs, outputs) in segments {
        let (u, y) = (transformed(inputs, bin), transformed(outputs, bin));
        input_power += u.0 * u.0 + u.1 * u.1;
        output_power += y.0 * y.0 + y.1 * y.1;
        cross.0 += u.0 * y.0 + u.1 * y.1;
        cross.1 += u.0 * y.1 - u.1 * y.0;
    }
    let magnitude = libm::hypot(cross.0, cross.1);
    FrequencyPoint {
        frequency_hz: count(bin) / (count(segment) * period_s),
        gain: magnitude / input_power,
        phase_rad: libm::atan2(cross.1, cross.0),
        coherence: magnitude * magnitude / (input_power * output_power),
    }
}

/// Fourier bin of a windowed segment, real and imaginary part.
fn transformed(values: &[f64], bin: usize) -> (f64, f64) {
    let length = count(values.len());
    let mean = values.iter().sum::<f64>() / length;
    let turn = core::f64::consts::TAU / length;
    values.iter().enumerate().fold((0.0, 0.0), |(real, imaginary), (tick, value)| {
        let weight = 0.5 - 0.5 * libm::cos(turn * count(tick));
        // The product of the counts can be large: reduced to a fraction of a turn.
        let (sine, cosine) = libm::sincos(turn * count(tick * bin % values.len()));
        let value = weight * (value - mean);
        (real + value * cosine, imaginary - value * sine)
    })
}
