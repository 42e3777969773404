//! Loops of a rig as a linear system, at any point of the `z` plane.
//!
//! Devices are linear between events, given by matrices ([`PlantModel`]); controllers with their links and buses are
//! given by their answers to one disturbed measurement ([`Answer`]). With `P` and `K` of these the loop is `1 - P K`.
//!
//! Controllers with different rates repeat after `N` ticks. All signals of such a cycle form one vector ("lifting",
//! Khargonekar, Poolla and Tannenbaum, IEEE Transactions on Automatic Control 30, 1985), and `Z = z^N`.
#![expect(clippy::indexing_slicing, reason = "matrices, whose sizes follow from one another")]

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix};

use super::controller_model::Answer;
use super::plant_model::PlantModel;
use super::series::{GRID_RAD, Spectrum, grid_angle};

/// Initial frequencies: logarithmic over this number of decades, and linear: powers of two, which are on the grid of
/// the transforms. For short answers fewer: two per tick.
const LOGARITHMIC: u32 = 120;
const DECADES: f64 = 6.0;
const MIN_EVEN_OF_SHORT: usize = 64;
const MIN_EVEN: usize = 256;
const MAX_EVEN: usize = 1_024;
/// Distance in grid steps above which an angle is moved to the grid.
const COARSE: f64 = 16.0;
/// Ticks of the longest answer per linear frequency.
const EVEN_TICKS: usize = 8;

/// Measurement of a controller, in one tick of a cycle.
#[derive(Debug)]
pub(super) struct Column {
    /// Index among the outputs of the plants.
    pub(super) output: usize,
    pub(super) phase: usize,
    /// Answers by command of the loop.
    pub(super) answers: Vec<Option<Answer>>,
}

/// A reference of one axis, and the quantity that follows it.
#[derive(Debug)]
pub(super) struct Reference {
    /// Index among the following outputs of the plants.
    pub(super) output: usize,
    /// Answers by phase and by command of the loop.
    pub(super) answers: Vec<Vec<Option<Answer>>>,
}

/// A device, or its relevant part.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) model: PlantModel,
    /// Its commands and outputs, as indices of the loop.
    pub(super) commands: Vec<usize>,
    pub(super) outputs: Vec<usize>,
}

/// Group of axes that are coupled by their plants or controllers.
#[derive(Debug)]
pub(super) struct Loop {
    pub(super) period_s: f64,
    pub(super) cycle_ticks: usize,
    /// Model with the fed back outputs.
    pub(super) plants: Vec<Block>,
    /// Model that also has the outputs that follow references.
    pub(super) followers: Vec<Block>,
    pub(super) commands: usize,
    pub(super) columns: Vec<Column>,
    /// By command.
    pub(super) references: Vec<Option<Reference>>,
}

pub(super) type Point = Complex<f64>;
pub(super) const ONE: Point = Complex { re: 1.0, im: 0.0 };

/// Effect of blocks on the commands of a cycle, at one `z`.
pub(super) struct Lifted {
    pub(super) determinant: Point,
    /// From commands to outputs, by the delay of an output in ticks, from `1 - N` on.
    pub(super) phases: Vec<DMatrix<Point>>,
}

/// Loop at one `z`.
pub(super) struct At {
    /// Determinant of the plants' poles.
    pub(super) determinant: Point,
    /// From the commands of a cycle to columns.
    pub(super) plant: DMatrix<Point>,
    /// From columns to the commands of a cycle.
    pub(super) controller: DMatrix<Point>,
}

impl Loop {
    #[expect(clippy::cast_precision_loss, reason = "a few hundred ticks")]
    pub(super) fn cycle(&self) -> f64 {
        self.cycle_ticks as f64
    }

    /// Returns `z` at an angle of `Z`.
    pub(super) fn on_circle(&self, radius: f64, angle: f64) -> Point {
        Point::from_polar(radius, angle / self.cycle())
    }

    /// Angles of interest: dense in a plant near its poles, in a controller depending on the length of its answer.
    pub(super) fn angles(&self) -> Vec<f64> {
        let answers = self.columns.iter().flat_map(|column| column.answers.iter().flatten());
        let ticks = answers.map(Answer::ticks).max().unwrap_or_default();
        let min_even = (2 * ticks).clamp(MIN_EVEN_OF_SHORT, MIN_EVEN);
        let even = (ticks / EVEN_TICKS).clamp(min_even, MAX_EVEN).next_power_of_two();
        #[expect(clippy::cast_precision_loss, reason = "a few thousand")]
        let even = (0..=even).map(|n| PI * n as f64 / even as f64);
        let share = |n: u32| DECADES * (f64::from(n) / f64::from(LOGARITHMIC) - 1.0);
        let logarithmic = (0..LOGARITHMIC).map(|n| PI * libm::exp10(share(n)));
        let logarithmic =
            logarithmic.map(|angle| if angle < COARSE * GRID_RAD { angle } else { grid_angle(angle) });
        let around = |(angle, away): (f64, f64)| {
            [-3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0].map(|widths| {
                // Above half the rate of a cycle it is aliased.
                let folded = self.cycle() * (angle + widths * away);
                libm::fabs((folded + PI).rem_euclid(TAU) - PI)
            })
        };
        let poles = self.plants.iter().flat_map(|block| block.model.poles()).flat_map(around);
        let mut angles: Vec<f64> = even.chain(logarithmic).chain(poles).collect();
        angles.sort_by(f64::total_cmp);
        angles.dedup_by(|a, b| (*a - *b).abs() <= f64::EPSILON);
        angles
    }

    pub(super) fn lifted(&self, blocks: &[Block], z: Point) -> Lifted {
        let outputs = blocks.iter().flat_map(|block| &block.outputs).max().map_or(0, |last| last + 1);
        let ticks = self.cycle_ticks;
        let none = DMatrix::from_element(outputs, self.commands, Point::default());
        let mut determinant = ONE;
        let mut phases = if ticks > 1 { vec![none.clone(); 2 * ticks - 1] } else { Vec::new() };
        for turn in 0..ticks {
            #[expect(clippy::cast_precision_loss, reason = "a few hundred ticks")]
            let z = z * Point::from_polar(1.0, TAU * turn as f64 / self.cycle());
            let mut gain = none.clone();
            for block in blocks {
                let point = block.model.at(z);
                determinant *= point.determinant;
                for (row, output) in block.outputs.iter().enumerate() {
                    for (column, command) in block.commands.iter().enumerate() {
                        gain[(*output, *command)] = point.gain[(row, column)];
                    }
                }
            }
            if ticks == 1 {
                return Lifted { determinant, phases: vec![gain] };
            }
            let mut share = z.powi(1 - i32::try_from(ticks).unwrap_or(1)) / self.cycle();
            for phase in &mut phases {
                phase.zip_apply(&gain, |sum, gain| *sum += share * gain);
                share *= z;
            }
        }
        Lifted { determinant, phases }
    }

    /// Perturbs each answer by rounding.
    pub(super) fn at_rounded(&self, z: Point, rounding: f64) -> At {
        let back = self.cycle_later(z).inv();
        self.with_answers(z, |place, command, phase| {
            let column = self.columns.get(place)?;
            let answer = column.answers.get(command)?.as_ref()?;
            let sign = if (place + command).is_multiple_of(2) { 1.0 } else { -1.0 };
            let series = answer.series(self.cycle_ticks, offset(phase, column.phase));
            Some(series.at(back) * (1.0 + sign * rounding))
        })
    }

    /// `Z`.
    pub(super) fn cycle_later(&self, z: Point) -> Point {
        z.powu(u32::try_from(self.cycle_ticks).unwrap_or(1))
    }

    /// With answers by column, command and phase.
    fn with_answers(&self, z: Point, answer: impl Fn(usize, usize, usize) -> Option<Point>) -> At {
        let Lifted { determinant, phases } = self.lifted(&self.plants, z);
        let (ticks, columns) = (self.cycle_ticks, self.columns.len());
        let mut plant = DMatrix::from_element(columns, self.commands * ticks, Point::default());
        let mut controller = DMatrix::from_element(self.commands * ticks, columns, Point::default());
        for (place, column) in self.columns.iter().enumerate() {
            for command in 0..self.commands {
                for phase in 0..ticks {
                    let at = command * ticks + phase;
                    let later = column.phase + ticks - 1 - phase;
                    let gain = phases.get(later).map(|phase| phase[(column.output, command)]);
                    plant[(place, at)] = gain.unwrap_or_default();
                    controller[(at, place)] = answer(place, command, phase).unwrap_or_default();
                }
            }
        }
        At { determinant, plant, controller }
    }

    /// The loop for `Z` on a circle around 0, with fast evaluation at grid angles.
    pub(super) fn circle(&self, radius: f64) -> Circle<'_> {
        let mut circle = Circle { whole: self, radius, answers: Vec::new() };
        circle.answers =
            self.columns.iter().map(|column| circle.spectra(&column.answers, column.phase)).collect();
        circle
    }
}

/// Ticks from one phase of a cycle back to another.
fn offset(phase: usize, begun: usize) -> isize {
    phase.cast_signed() - begun.cast_signed()
}

/// See [`Loop::circle`].
pub(super) struct Circle<'a> {
    pub(super) whole: &'a Loop,
    /// Radius of `z`.
    radius: f64,
    /// By column.
    answers: Vec<Spectra<'a>>,
}

/// Answers to one measurement or reference, by command, by phase of a cycle.
pub(super) type Spectra<'a> = Vec<Vec<Option<Spectrum<'a>>>>;

impl<'a> Circle<'a> {
    /// Sum of the answers to inputs in a phase of a cycle.
    pub(super) fn spectra(&self, answers: &'a [Option<Answer>], begun: usize) -> Spectra<'a> {
        let ticks = self.whole.cycle_ticks;
        let of_cycle = self.radius.powi(i32::try_from(ticks).unwrap_or(1));
        let spectrum = |answer: &'a Option<Answer>, phase: usize| {
            let series = answer.as_ref()?.series(ticks, offset(phase, begun));
            Some(Spectrum::new(series, of_cycle))
        };
        answers.iter().map(|answer| (0..ticks).map(|phase| spectrum(answer, phase)).collect()).collect()
    }

    /// Returns `z` at an angle of `Z`, and `1/Z`.
    pub(super) fn point(&self, angle: f64) -> (Point, Point) {
        let z = self.whole.on_circle(self.radius, angle);
        (z, self.whole.cycle_later(z).inv())
    }

    /// Returns the loop at an angle of `Z`.
    pub(super) fn at(&self, angle: f64) -> At {
        let (z, back) = self.point(angle);
        self.whole.with_answers(z, |place, command, phase| {
            let spectrum = self.answers.get(place)?.get(command)?.get(phase)?.as_ref()?;
            Some(spectrum.at(angle, back))
        })
    }
}
