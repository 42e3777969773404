//! The confidence intervals of `identify` by how often the truth is in them: recordings of known joints with other noise each.
#![expect(
    clippy::panic,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "in helpers of tests as in tests"
)]

use hil_sim::identify::{Experiment, ForceTiming, Quantity, identify};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::f64::consts::TAU;
use test_requirements::length;

/// A joint and how it is recorded.
struct Kind {
    name: &'static str,
    period_s: f64,
    /// Inertia, viscous and Coulomb friction, weight with sine and cosine, constant force.
    truth: [f64; 6],
    turns: bool,
    delay_s: f64,
    force_noise: f64,
    position_noise: f64,
    /// Resolution of the encoder; 0 for none.
    step: f64,
}

const PLAIN: Kind = Kind {
    name: "a force sensor with noise",
    period_s: 1e-3,
    truth: [0.2, 3.1, 2.44, 0.0, 0.0, 0.0],
    turns: true,
    delay_s: 0.0,
    force_noise: 0.1,
    position_noise: 0.0,
    step: 0.0,
};

const KINDS: [Kind; 8] = [
    PLAIN,
    Kind { name: "a force that comes 12 ms later", delay_s: 0.012, ..PLAIN },
    Kind { name: "a force that comes 30 ms later", delay_s: 0.030, ..PLAIN },
    Kind { name: "rows of 100 Hz, a force that comes 0.1 s later", period_s: 0.01, delay_s: 0.1, ..PLAIN },
    Kind { name: "an encoder of 14 bits", step: TAU / 16_384.0, ..PLAIN },
    Kind { name: "noise in the position", position_noise: 1e-4, ..PLAIN },
    Kind { name: "a pendulum", truth: [0.08, 0.3, 0.4, 2.0, 0.7, 0.2], ..PLAIN },
    Kind { name: "a slide", truth: [2.0, 30.0, 5.0, 0.0, 0.0, 1.0], turns: false, ..PLAIN },
];

fn normal(random: &mut Pcg32) -> f64 {
    let mut uniform = || f64::from(random.next_u32() | 1) / f64::from(u32::MAX);
    (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos()
}

impl Kind {
    /// Recording of a sweep from 0.05 to 3 Hz in 40 s.
    fn record(&self, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut random = Pcg32::seed_from_u64(seed);
        let offset = f64::from(random.next_u32()) / f64::from(u32::MAX);
        let moved = |t: f64| {
            let rate = TAU * (0.05 + 2.95 / 40.0 * t);
            let phase = TAU * (offset + 0.05 * t + 0.5 * 2.95 / 40.0 * t * t);
            let (sine, cosine) = phase.sin_cos();
            let turn = TAU * 2.95 / 40.0;
            [0.8 * sine, 0.8 * rate * cosine, 0.8 * (turn * cosine - rate * rate * sine)]
        };
        let [inertia, viscous, coulomb, by_sine, by_cosine, constant] = self.truth;
        let ticks = (40.0 / self.period_s) as u32;
        let rows = (0..ticks).map(|tick| {
            let time_s = f64::from(tick) * self.period_s;
            let [mut position, ..] = moved(time_s);
            position += self.position_noise * normal(&mut random);
            if self.step > 0.0 {
                position = (position / self.step).round() * self.step;
            }
            let [q, v, a] = moved(time_s - self.delay_s);
            let force =
                inertia * a + viscous * v + coulomb * v.signum() + by_sine * q.sin() + by_cosine * q.cos();
            (position, force + constant + self.force_noise * normal(&mut random))
        });
        rows.unzip()
    }
}

const QUANTITIES: [Quantity; 7] = [
    Quantity::Inertia,
    Quantity::Viscous,
    Quantity::Coulomb,
    Quantity::WeightSine,
    Quantity::WeightCosine,
    Quantity::Constant,
    Quantity::Lateness,
];

/// How many intervals have the truth in them, and how many there are.
fn coverage(kind: &Kind, seeds: u64) -> [u32; 2] {
    let mut counts = [0; 2];
    for seed in 0..seeds {
        let (position, force) = kind.record(seed);
        let found = identify(&Experiment {
            period_s: kind.period_s,
            position: &position,
            force: &force,
            force_timing: ForceTiming::Measured,
            turns: kind.turns,
            others: &[],
        });
        let found = found.unwrap_or_else(|error| panic!("{}: {error}", kind.name));
        for (quantity, truth) in QUANTITIES.into_iter().zip(kind.truth.into_iter().chain([kind.delay_s])) {
            let Some((value, half_width)) = found.of(quantity) else { continue };
            counts[0] += u32::from((value - truth).abs() <= half_width);
            counts[1] += 1;
        }
    }
    counts
}

#[test]
fn the_truth_is_in_the_intervals_as_often_as_they_say() {
    let seeds = length(5, 40);
    let counts = KINDS.map(|kind| (coverage(&kind, seeds), kind.name));
    for ([inside, all], name) in &counts {
        println!("{name}: the truth is in {inside} of {all} intervals");
        // At least five quantities of each recording have one.
        assert!(u64::from(*all) >= 5 * seeds, "{name}");
        assert!(f64::from(*inside) >= 0.85 * f64::from(*all), "{name}: {inside} of {all}");
    }
    let [inside, all] = counts.iter().fold([0, 0], |[a, b], ([inside, all], _)| [a + inside, b + all]);
    let share = f64::from(inside) / f64::from(all);
    assert!((0.90..=0.99).contains(&share), "{inside} of {all}");
}
