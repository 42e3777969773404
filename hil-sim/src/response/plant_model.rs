//! Linear model of a device around its start: from the commands of a tick to the measurements of the next one.
//!
//! ```text
//!   x[k+1] = A x[k] + Σ B_l u[k-l]        y[k+1] = C x[k] + Σ D_l u[k-l]
//! ```
//! Columns are central differences of the device's simulation over one tick. Each sub-step of a linear device is
//! linear, so they are exact up to rounding; the lags `l` are those of its delay.
#![expect(clippy::indexing_slicing, reason = "matrices, whose sizes follow from one another")]

use nalgebra::{Complex, DMatrix, DVector};

use super::body::Body;
use super::machine::{MAX_WAITING, Machine};

/// Step of the differences, in the unit of each state; larger for drives, which compute in `f32`.
const STEP: f64 = 1e-4;
const STEP_OF_DRIVES: f64 = 1.0 / 64.0;
/// Ticks for the decay of commands and the setup of drives.
const IDLE_TICKS: usize = MAX_WAITING + 1;
const IDLE_TICKS_OF_DRIVES: usize = 300;
/// Maximum relative asymmetry of a difference.
const LINEAR: f64 = 0.01;
/// Entries below this are rounding.
const ROUNDING: f64 = 1e-11;
/// Rounding of drives: 0.001 of their torque, or an encoder count.
const ROUNDING_OF_DRIVES: f64 = 1e-7;

/// See the [module docs](self).
#[derive(Debug, Clone)]
pub(super) struct PlantModel {
    state: DMatrix<f64>,
    /// Matrices by lag.
    input: Vec<DMatrix<f64>>,
    output: DMatrix<f64>,
    /// Matrices by lag.
    feedthrough: Vec<DMatrix<f64>>,
}

/// Model at one point of the `z` plane.
#[derive(Debug)]
pub(super) struct PlantPoint {
    /// `det(1 - A/z)`.
    pub(super) determinant: Complex<f64>,
    /// From commands to measurements.
    pub(super) gain: DMatrix<Complex<f64>>,
}

impl PlantModel {
    /// Creates the model of a machine at its start, with the outputs of `read`; `None` if nonlinear.
    pub(super) fn new(
        machine: &mut Machine,
        period_s: f64,
        axes: usize,
        read: impl Fn(&Machine) -> Vec<f64>,
    ) -> Option<Self> {
        let is_bus = matches!(machine.body(), Body::Drives(_));
        let (step, idle_ticks, rounding) = match is_bus {
            true => (STEP_OF_DRIVES, IDLE_TICKS_OF_DRIVES, ROUNDING_OF_DRIVES),
            false => (STEP, IDLE_TICKS, ROUNDING),
        };
        machine.set_enabled(&(0..axes).collect::<Vec<_>>(), true);
        let (start, none) = (machine.body().values(), vec![0.0; axes]);
        let mut tick = |state: &[f64], commands: &[f64]| {
            machine.body_mut().set_values(state);
            machine.take(0.0, period_s, commands.iter().copied().enumerate());
            let after = machine.body().values();
            [after, read(machine)].concat()
        };
        let mut rest = tick(&start, &none);
        (0..idle_ticks).for_each(|_| rest = tick(&start, &none));
        let moved = |values: &[f64], at: usize, by: f64| -> Vec<f64> {
            let moves = |(place, value): (usize, &f64)| value + if place == at { by } else { 0.0 };
            values.iter().enumerate().map(moves).collect()
        };
        let (states, outputs) = (start.len(), rest.len() - start.len());
        let mut whole = DMatrix::zeros(states + outputs, states);
        for at in 0..states {
            let [plus, minus] = [step, -step].map(|by| {
                let after = tick(&moved(&start, at, by), &none);
                // A bus can delay a part of it.
                (0..IDLE_TICKS).for_each(|_| drop(tick(&start, &none)));
                after
            });
            fill(&mut whole, at, [&plus, &rest, &minus], step, rounding)?;
        }
        let mut lags = vec![DMatrix::zeros(states + outputs, axes); MAX_WAITING];
        for axis in 0..axes {
            let mut answers = |by: f64| -> Vec<Vec<f64>> {
                let first = tick(&start, &moved(&none, axis, by));
                let later = (1..MAX_WAITING).map(|_| tick(&start, &none));
                std::iter::once(first).chain(later).collect()
            };
            let [plus, minus] = [answers(step), answers(-step)];
            for ((lag, plus), minus) in lags.iter_mut().zip(&plus).zip(&minus) {
                fill(lag, axis, [plus, &rest, minus], step, rounding)?;
            }
        }
        while lags.last().is_some_and(|lag| !lag.iter().copied().any(is_there)) {
            lags.pop();
        }
        let above = |matrix: &DMatrix<f64>| matrix.rows(0, states).into_owned();
        let below = |matrix: &DMatrix<f64>| matrix.rows(states, outputs).into_owned();
        Some(Self {
            state: above(&whole),
            input: lags.iter().map(above).collect(),
            output: below(&whole),
            feedthrough: lags.iter().map(below).collect(),
        })
    }

    /// Whether a command reaches an output.
    pub(super) fn joins(&self, command: usize, output: usize) -> bool {
        let reached = spread(self.pushed_by(&[command]), &self.state);
        let is_passed = self.feedthrough.iter().any(|lag| is_there(lag[(output, command)]));
        is_passed || (0..reached.len()).any(|state| reached[state] && is_there(self.output[(output, state)]))
    }

    /// Reduces the model to these commands and outputs, with their states.
    pub(super) fn reduced(&self, commands: &[usize], outputs: &[usize]) -> Self {
        let reached = spread(self.pushed_by(commands), &self.state);
        let is_seen = |state: usize, _| outputs.iter().any(|output| is_there(self.output[(*output, state)]));
        let seen = spread(DVector::from_fn(reached.len(), is_seen), &self.state.transpose());
        let states: Vec<usize> = (0..reached.len()).filter(|state| reached[*state] && seen[*state]).collect();
        let select = |matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]| {
            matrix.select_rows(rows).select_columns(columns)
        };
        Self {
            state: select(&self.state, &states, &states),
            input: self.input.iter().map(|lag| select(lag, &states, commands)).collect(),
            output: select(&self.output, outputs, &states),
            feedthrough: self.feedthrough.iter().map(|lag| select(lag, outputs, commands)).collect(),
        }
    }

    fn pushed_by(&self, commands: &[usize]) -> DVector<bool> {
        let is_pushed = |state: usize, _| {
            self.input.iter().any(|lag| commands.iter().any(|command| is_there(lag[(state, *command)])))
        };
        DVector::from_fn(self.state.nrows(), is_pushed)
    }

    /// Angles of its poles, and their distances from the unit circle.
    pub(super) fn poles(&self) -> Vec<(f64, f64)> {
        if self.state.is_empty() {
            return Vec::new();
        }
        let poles = self.state.complex_eigenvalues();
        poles.iter().map(|pole| (pole.arg().abs(), (1.0 - pole.norm()).abs())).collect()
    }

    /// Returns the model at `z`.
    pub(super) fn at(&self, z: Complex<f64>) -> PlantPoint {
        let back = z.inv();
        let states = self.state.nrows();
        let lagged = |lags: &[DMatrix<f64>], rows: usize| {
            let mut sum = DMatrix::from_element(rows, lags.first().map_or(0, DMatrix::ncols), ZERO);
            let mut turn = back;
            for lag in lags {
                sum.zip_apply(lag, |sum, entry| *sum += turn * entry);
                turn *= back;
            }
            sum
        };
        let mut gain = lagged(&self.feedthrough, self.output.nrows());
        if states == 0 {
            return PlantPoint { determinant: ONE, gain };
        }
        let at = |row: usize, column: usize| {
            Complex::from(f64::from(u8::from(row == column))) - back * self.state[(row, column)]
        };
        let factors = DMatrix::from_fn(states, states, at).lu();
        let determinant = factors.determinant();
        // One tick earlier each: state and measurement.
        let mut moved = lagged(&self.input, states);
        if !factors.solve_mut(&mut moved) {
            moved.fill(NOT_A_NUMBER);
        }
        for (command, moved) in moved.column_iter().enumerate() {
            for (output, seen) in self.output.row_iter().enumerate() {
                let sum: Complex<f64> = seen.iter().zip(&moved).map(|(share, moved)| moved * share).sum();
                gain[(output, command)] += sum * back;
            }
        }
        PlantPoint { determinant, gain }
    }
}

fn is_there(entry: f64) -> bool {
    entry.abs() > 0.0
}

/// All states reachable from these.
fn spread(mut from: DVector<bool>, step: &DMatrix<f64>) -> DVector<bool> {
    for _ in 0..from.len() {
        let leads =
            |state: usize, _| (0..from.len()).any(|other| from[other] && is_there(step[(state, other)]));
        let led = DVector::from_fn(from.len(), leads);
        from.zip_apply(&led, |known, led| *known |= led);
    }
    from
}

const ZERO: Complex<f64> = Complex { re: 0.0, im: 0.0 };
const ONE: Complex<f64> = Complex { re: 1.0, im: 0.0 };
const NOT_A_NUMBER: Complex<f64> = Complex { re: f64::NAN, im: f64::NAN };

/// Computes a column from steps up, zero and down; `None` if they are not collinear.
fn fill(
    matrix: &mut DMatrix<f64>,
    column: usize,
    [plus, rest, minus]: [&[f64]; 3],
    step: f64,
    rounding: f64,
) -> Option<()> {
    let (mut most, mut bend) = (0.0_f64, 0.0_f64);
    for (entry, ((plus, rest), minus)) in
        matrix.column_mut(column).iter_mut().zip(plus.iter().zip(rest).zip(minus))
    {
        let difference = (plus - minus) / (2.0 * step);
        *entry = if difference.abs() > rounding { difference } else { 0.0 };
        most = most.max(difference.abs());
        bend = bend.max((plus + minus - 2.0 * rest).abs() / (2.0 * step));
    }
    (bend <= LINEAR * most.max(rounding)).then_some(())
}
