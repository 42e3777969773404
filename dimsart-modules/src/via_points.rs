//! Via points: a cubic spline from the initial position through up to eight points, with a set time for each.
//!
//! Position, velocity and acceleration are continuous; the spline starts and ends at rest (clamped spline; de Boor, *A
//! Practical Guide to Splines*, chapter IV). With the slopes `m` at the points, `δ_i` the mean slope and `h_i` the time
//! from point `i` to the next, the slopes solve
//!
//! `h_i m_{i-1} + 2 (h_{i-1} + h_i) m_i + h_{i-1} m_{i+1} = 3 (h_i δ_{i-1} + h_{i-1} δ_i)`, `m_0 = m_n = 0`,
//!
//! and between points, `τ` after the earlier one, `x = x_i + τ (m_i + τ (c + τ d))`,
//! `c = (3 δ - 2 m_i - m_{i+1}) / h_i`, `d = (m_i + m_{i+1} - 2 δ) / h_i²`.
//!
//! The spline starts at the measured position; on takeover, at the last commanded one. Points and times are read at the
//! start; a change takes effect at the next reset. After the last point, the position is held.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all VIA_MOD POINTS 2\nall VIA_MOD POINTS[0][0] 1\nall VIA_MOD COUNT 2\nall VIA_MOD TIMES 0.1
//!             all MOD_ENG MOD_ON VIA_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION], rows)?;
//! let path: Vec<_> = (0..202).filter_map(|_| bench.tick(&[0.0], "DES_POSITION")).collect();
//! assert_eq!((path.first(), path.last()), (Some(&0.0), Some(&2.0)));
//! assert!(path.get(100).is_some_and(|x| (x - 1.0).abs() < 1e-5));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::take_over::first;
use dimsart_core::{Context, DeviceDescriptor, Input, Module, Output, Unit, Words as _, types, words};

/// Maximum number of points.
const POINTS: usize = 8;

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Travel time to each point from the previous point.
        times_s: [[f32; POINTS]; 1] = matrix("TIMES", Unit::Second, 1e-2..=1e4, 1.0),
        /// Number of points used.
        count: u32 = count("COUNT", Unit::One, 1..=8, 1),
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains {
        /// Positions of the points.
        points: [f32; POINTS] = per_axis_row("POINTS", Unit::Position, -1e6..=1e6, 0.0),
    }
    /// State common to all axes: present piece and time in it.
    pub struct State { piece: u32, time_s: f32, lost_s: f32 }
    /// State of one axis; `end` follows all pieces in memory.
    pub struct AxisState { pieces: [SplineSegment; POINTS], end: f32 }
    /// Spline piece from a point to the next.
    pub struct SplineSegment { time_s: f32, point: f32, slope: f32, bend: f32, twist: f32 }
    /// Ports.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        desired_position: Output = output("DES_POSITION", types::DES_POSITION),
        desired_velocity: Output = output("DES_VELOCITY", types::DES_VELOCITY),
        desired_acceleration: Output = output("DES_ACCELERATION", types::DES_ACCELERATION),
    }
}

const END: usize = POINTS * SplineSegment::COUNT;

/// See the [module docs](self).
#[derive(Debug)]
pub struct ViaPoints;

impl Module for ViaPoints {
    const NAME: &'static str = "VIA_MOD";
    const SUMMARY: &'static str = "Cubic spline trajectory through up to eight timed points.";
    type Settings = Settings;
    type Gains = Gains;
    type State = State;
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, desired_position, .. } = context.ports();
        let Settings { count, times_s: [times_s], .. } = context.settings();
        let takes_over = context.takes_over();
        context.set_state(State { piece: 0, time_s: 0.0, lost_s: 0.0 });
        context.begin_axes([position, desired_position.last()], |gains, [x, last]| {
            let pieces = usize::try_from(count).unwrap_or(POINTS);
            spline(first(takes_over, last, x), gains.points, times_s, pieces)
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { desired_position, desired_velocity, desired_acceleration, .. } = context.ports();
        let Settings { period_s, .. } = context.settings();
        let State { piece, time_s, lost_s } = context.state();
        let place = usize::try_from(piece).unwrap_or(POINTS);
        let mut piece_s = 0.0;
        let outputs = [desired_position, desired_velocity, desired_acceleration];
        context.map_axis_contexts([], outputs, |_, lane, []| {
            let piece =
                Some(place).filter(|place| *place < POINTS).and_then(|place| lane.state_element(place));
            let Some(piece) = piece.filter(|piece: &SplineSegment| piece.time_s > 0.0) else {
                return [lane.state_element(END).unwrap_or(0.0), 0.0, 0.0];
            };
            piece_s = piece.time_s;
            let SplineSegment { point, slope, bend, twist, .. } = piece;
            [
                point + time_s * (slope + time_s * (bend + time_s * twist)),
                slope + time_s * (2.0 * bend + time_s * 3.0 * twist),
                2.0 * bend + time_s * 6.0 * twist,
            ]
        });
        // Kahan summation, as in `CompensatedSum`.
        let step_s = period_s - lost_s;
        let next_s = time_s + step_s;
        let lost_s = (next_s - time_s) - step_s;
        let is_done = next_s >= piece_s && piece_s > 0.0;
        context.set_state(State {
            piece: piece + u32::from(is_done),
            time_s: if is_done { next_s - piece_s } else { next_s },
            lost_s,
        });
    }
}

/// Computes the spline by forward elimination and back substitution; unused pieces have time 0.
fn spline(start: f32, points: [f32; POINTS], times_s: [f32; POINTS], count: usize) -> AxisState {
    let mut axis = AxisState { end: start, ..AxisState::default() };
    // Slope at a point = `constant - factor × slope at the next point`; 0 at the start.
    let mut eliminated = [(0.0_f32, 0.0_f32); POINTS];
    let (mut before_s, mut mean_before) = (0.0, 0.0);
    let (mut constant, mut factor) = (0.0, 0.0);
    let inputs = points.into_iter().zip(times_s).take(count);
    for ((place, piece), (terms, (point, time_s))) in
        axis.pieces.iter_mut().enumerate().zip(eliminated.iter_mut().zip(inputs))
    {
        let mean = (point - axis.end) / time_s;
        if place > 0 {
            let pivot = 1.0 / (2.0 * (before_s + time_s) - time_s * factor);
            constant = (3.0 * (time_s * mean_before + before_s * mean) - time_s * constant) * pivot;
            factor = before_s * pivot;
        }
        *terms = (constant, factor);
        *piece = SplineSegment { time_s, point: axis.end, slope: mean, ..SplineSegment::default() };
        (axis.end, before_s, mean_before) = (point, time_s, mean);
    }
    let mut next = 0.0;
    for (piece, (constant, factor)) in axis.pieces.iter_mut().zip(eliminated).take(count).rev() {
        let (mean, slope) = (piece.slope, constant - factor * next);
        let rate_hz = 1.0 / piece.time_s;
        piece.slope = slope;
        piece.bend = (3.0 * mean - 2.0 * slope - next) * rate_hz;
        piece.twist = (slope + next - 2.0 * mean) * rate_hz * rate_hz;
        next = slope;
    }
    axis
}
