//! Sum of an answer at any point of the `z` plane: `Σ h[k] z^-k`.

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock};

use nalgebra::Complex;
use rustfft::{Fft, FftPlanner};

/// Number of angles of the transform, their spacing, and their rounding tolerance.
const GRID: usize = 8_192;
#[expect(clippy::cast_precision_loss, reason = "a power of two")]
pub(super) const GRID_RAD: f64 = TAU / GRID as f64;
const SAME_ANGLE: f64 = 4.0 * f64::EPSILON;
/// Length in ticks below which direct summation is faster than the transform.
const SHORT_TICKS: usize = 64;
/// The transform is planned once and used for many circles.
static TRANSFORM: LazyLock<Arc<dyn Fft<f64>>> = LazyLock::new(|| FftPlanner::new().plan_fft_forward(GRID));

/// One tick of every cycle of an answer: `h[q] = taps[q] + level + slope q`, a cycle earlier for negative offsets.
#[derive(Debug)]
pub(super) struct Series<'a> {
    pub(super) taps: Cow<'a, [f64]>,
    /// `None` if it contains only some taps.
    pub(super) moments: &'a [Moments],
    pub(super) level: f64,
    pub(super) slope: f64,
    pub(super) is_before: bool,
}

impl Series<'_> {
    /// `Σ h[q] back^q`.
    pub(super) fn at(&self, back: Complex<f64>) -> Complex<f64> {
        let sum = slow_polynomial(self.moments, back).unwrap_or_else(|| polynomial(&self.taps, back));
        self.with_rest(sum, back)
    }

    fn with_rest(&self, mut sum: Complex<f64>, back: Complex<f64>) -> Complex<f64> {
        let rest = (Complex::new(1.0, 0.0) - back).inv();
        sum += rest * self.level;
        sum += rest * rest * back * self.slope;
        if self.is_before { sum * back } else { sum }
    }
}

/// A series on a circle: by Fourier transform if it is long and the angle is on the grid.
#[derive(Debug)]
pub(super) struct Spectrum<'a> {
    series: Series<'a>,
    grid: Vec<Complex<f64>>,
}

impl<'a> Spectrum<'a> {
    /// Evaluates at a radius of `Z`.
    pub(super) fn new(series: Series<'a>, radius: f64) -> Self {
        if series.taps.len() <= SHORT_TICKS {
            return Self { series, grid: Vec::new() };
        }
        let mut grid = vec![Complex::default(); GRID];
        let mut share = 1.0;
        for (tap, at) in series.taps.iter().zip((0..GRID).cycle()) {
            if let Some(sum) = grid.get_mut(at) {
                *sum += share * tap;
            }
            share /= radius;
        }
        TRANSFORM.process(&mut grid);
        Self { series, grid }
    }

    /// Evaluates at an angle of `Z`; `back` is its inverse.
    pub(super) fn at(&self, angle: f64, back: Complex<f64>) -> Complex<f64> {
        match grid_place(angle).and_then(|place| self.grid.get(place)) {
            Some(sum) => self.series.with_rest(*sum, back),
            None => self.series.at(back),
        }
    }
}

/// Returns the nearest angle of the grid.
pub(super) fn grid_angle(angle: f64) -> f64 {
    libm::round(angle / GRID_RAD) * GRID_RAD
}

/// Returns the grid index of an angle, within rounding.
fn grid_place(angle: f64) -> Option<usize> {
    let place = libm::round(angle / GRID_RAD);
    if (angle - place * GRID_RAD).abs() > SAME_ANGLE || place < 0.0 {
        return None;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an angle of half a turn")]
    Some(place as usize)
}

/// Number of parallel sums.
const LANES: usize = 8;

/// `Σ factors[k] x^k` by Horner's rule, interleaved into several independent polynomials for speed: an analysis
/// spends most of its time here.
fn polynomial(factors: &[f64], x: Complex<f64>) -> Complex<f64> {
    let Complex { re: turn_re, im: turn_im } = x.powu(u32::try_from(LANES).unwrap_or_default());
    let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
    let (whole, rest) = factors.as_chunks::<LANES>();
    let mut last = [0.0; LANES];
    last.iter_mut().zip(rest).for_each(|(last, rest)| *last = *rest);
    for row in std::iter::once(&last).chain(whole.iter().rev()) {
        for ((re, im), factor) in re.iter_mut().zip(&mut im).zip(row) {
            (*re, *im) = (*re * turn_re - *im * turn_im + factor, *re * turn_im + *im * turn_re);
        }
    }
    let lanes = re.into_iter().zip(im).rev();
    lanes.fold(Complex::new(0.0, 0.0), |sum, (re, im)| sum * x + Complex::new(re, im))
}

/// Length of a block in ticks, and its middle. A slow mode depends only on the block's moments: the Taylor remainder
/// `0.4^12/12!` is below rounding.
pub(super) const BLOCK_TICKS: usize = 64;
const MIDDLE_TICK: f64 = 31.5;
/// Fastest mode, `1/tick`.
const SLOW_PER_TICK: f64 = 0.0125;
const ORDERS: usize = 12;
/// `Σ factors[k] (k - middle)^n/n!` of a block.
pub(super) type Moments = [f64; ORDERS];

pub(super) fn moments(block: &[f64]) -> Moments {
    let mut moments = [0.0; ORDERS];
    for (tick, factor) in (0_u32..).zip(block) {
        let mut weighed = *factor;
        for (moment, order) in moments.iter_mut().zip(1_u32..) {
            *moment += weighed;
            weighed *= (f64::from(tick) - MIDDLE_TICK) / f64::from(order);
        }
    }
    moments
}

/// The [polynomial] of blocks near 1, by a Taylor series of the exponent of `x^k` in each block; `None` elsewhere, or
/// without blocks.
fn slow_polynomial(blocks: &[Moments], x: Complex<f64>) -> Option<Complex<f64>> {
    let per_tick = x.ln();
    if blocks.is_empty() || per_tick.norm() > SLOW_PER_TICK {
        return None;
    }
    let mut powers = [Complex::default(); ORDERS];
    let mut power = Complex::new(1.0, 0.0);
    for slot in &mut powers {
        *slot = power;
        power *= per_tick;
    }
    let of_block = |moments: &Moments| -> Complex<f64> {
        moments.iter().zip(&powers).map(|(moment, power)| power * moment).sum()
    };
    let turn = x.powu(u32::try_from(BLOCK_TICKS).unwrap_or_default());
    let sum = blocks.iter().rev().fold(Complex::new(0.0, 0.0), |sum, block| sum * turn + of_block(block));
    Some(sum * (per_tick * MIDDLE_TICK).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_polynomial_is_the_sum_of_its_powers() {
        let factors: Vec<f64> = (0..5000).map(|k| f64::from(k % 7) - 2.5).collect();
        let blocks: Vec<Moments> = factors.chunks(BLOCK_TICKS).map(moments).collect();
        for (size, angle) in [(1.0, 0.0), (1.0, 0.012), (0.9995, 0.005), (1.0003, -0.001)] {
            let x = Complex::from_polar(size, angle);
            let (slow, sum) = (slow_polynomial(&blocks, x).unwrap(), polynomial(&factors, x));
            assert!((slow - sum).norm() < 1e-10 * (1.0 + sum.norm()), "{size} {angle}: {slow} {sum}");
        }
        assert_eq!(slow_polynomial(&blocks, Complex::from_polar(1.0, 0.02)), None);
    }

    #[test]
    fn a_polynomial_is_the_sum_of_its_powers_whatever_its_length() {
        let x = Complex::from_polar(0.99, 0.3);
        for length in [0, 1, 7, 8, 9, 64, 65, 200] {
            let factors: Vec<f64> = (0..length).map(|k| f64::from(k % 7) - 2.5).collect();
            let powers = (0..).map(|k| x.powi(k));
            let sum: Complex<f64> = factors.iter().zip(powers).map(|(factor, power)| power * factor).sum();
            assert!((polynomial(&factors, x) - sum).norm() < 1e-12 * (1.0 + sum.norm()), "{length}");
        }
    }
}
