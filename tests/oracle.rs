//! The simulator against an outside implementation: the same loops in python-control.
//!
//! `cargo xtask test` makes the reference runs (`tests/oracle`) and says in `DIMSART_ORACLE` where they are. The
//! simulator runs the same masses, dampers, springs, delays and hand forces with the shipped scheme, and each signal
//! has to stay within 1e-4 of its peak on every tick; both waves of a line are measured against the larger peak.
//!
//! What remains is the controllers' `f32`. Measured and desired position are rounded by up to half an `ulp` each, so
//! the force of a controller of stiffness `K` by up to `K ulp(x)`: 1.9e-5 N at 38 mm and 5000 `N/m`, or 1e-5 of the
//! forces here. Waves carry it to the other side. Free devices wander farthest and differ most, by up to 3.4e-5;
//! those at a wall by 2e-6.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

#[path = "common/loops.rs"]
mod loops;

use std::io::Write;
use std::path::{Path, PathBuf};

use dimsart_core::{DataType, types};
use hil_sim::bilateral::linear_loop::{Held, linear_loops};
use hil_sim::plant::{Environment, SpringParameters};
use serde::Deserialize;

use loops::{MASTER, SLAVE, TICK_S, axis, delays, push, rig, scenario, signal};

/// Share of a signal's peak that it may be off by.
const TOLERANCE: f64 = 1e-4;
/// The printed order multiplies what is at half the sample rate by 2.255 in each round trip of 22 ticks: rounding has
/// more of that than the hand's push. Its first five round trips are compared.
const COMPARED_TICKS_PRINTED: usize = 110;

/// The reference runs, as `cases.json` lists them.
#[derive(Deserialize)]
struct Reference {
    tick_s: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    file: String,
    ticks: usize,
    order: String,
    forward_delay_ticks: u32,
    backward_delay_ticks: u32,
    master: Side,
    slave: Side,
    wall_stiffness_n_per_m: f64,
    impedance_ns_per_m: f64,
}

#[derive(Deserialize)]
struct Side {
    mass_kg: f64,
    device_damping_ns_per_m: f64,
    stiffness_n_per_m: f64,
    pd_damping_ns_per_m: f64,
}

/// A column of the reference, where the simulator has it, and the columns whose peak it is measured against.
type Compared = (&'static str, usize, &'static DataType, &'static [&'static str]);

/// A wave that is small everywhere would be measured against its own rounding.
const LINE_WAVES: &[&str] = &["master_wave_out_sqrt_w", "slave_wave_out_sqrt_w"];
const COMPARED: [Compared; 10] = [
    ("master_position_m", MASTER, types::POSITION, &["master_position_m"]),
    ("slave_position_m", SLAVE, types::POSITION, &["slave_position_m"]),
    ("master_desired_position_m", MASTER, types::DES_POSITION, &["master_desired_position_m"]),
    ("slave_desired_position_m", SLAVE, types::DES_POSITION, &["slave_desired_position_m"]),
    ("master_force_n", MASTER, types::DES_FORCE, &["master_force_n"]),
    ("slave_force_n", SLAVE, types::DES_FORCE, &["slave_force_n"]),
    ("master_wave_out_sqrt_w", MASTER, types::CH1_WAVES, LINE_WAVES),
    ("master_wave_in_sqrt_w", MASTER, types::CH2_WAVES, LINE_WAVES),
    ("slave_wave_out_sqrt_w", SLAVE, types::CH1_WAVES, LINE_WAVES),
    ("slave_wave_in_sqrt_w", SLAVE, types::CH2_WAVES, LINE_WAVES),
];

/// A reference run, column by column.
struct Table {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    fn read(path: &Path) -> Self {
        let mut reader =
            csv::Reader::from_path(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let names = reader.headers().unwrap().iter().map(str::to_owned).collect();
        Self { names, rows: reader.deserialize().map(Result::unwrap).collect() }
    }

    fn column(&self, name: &str) -> impl Iterator<Item = f64> + '_ {
        let index = self.names.iter().position(|known| known == name);
        let index = index.unwrap_or_else(|| panic!("the reference has no column {name}"));
        self.rows.iter().map(move |row| row[index])
    }

    fn peak(&self, names: &[&str], ticks: usize) -> f64 {
        names
            .iter()
            .flat_map(|name| self.column(name).take(ticks))
            .fold(0.0, |peak, value| peak.max(value.abs()))
    }
}

/// Runs the case and gives for each of [`COMPARED`] the largest difference and the peak.
fn run(case: &Case, reference: &Table) -> Vec<(f64, f64)> {
    let settings = format!(
        "{} wave.form={} wave.impedance_ns_per_m={} master.stiffness_n_per_m={} slave.stiffness_n_per_m={} \
         master.damping_ns_per_m={} slave.damping_ns_per_m={}",
        delays(case.forward_delay_ticks, case.backward_delay_ticks),
        case.order,
        case.impedance_ns_per_m,
        case.master.stiffness_n_per_m,
        case.slave.stiffness_n_per_m,
        case.master.pd_damping_ns_per_m,
        case.slave.pd_damping_ns_per_m,
    );
    let forces_n: Vec<f64> = reference.column("hand_force_n").collect();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number of a tick")]
    let hand = push(move |t| forces_n[(t / TICK_S).round() as usize]);
    let stiffness_n_per_m = case.wall_stiffness_n_per_m;
    let wall = SpringParameters { stiffness_n_per_m, ..SpringParameters::default() }.build().unwrap();
    let device = |side: &Side, environment: Box<dyn Environment>| {
        axis(side.mass_kg, side.device_damping_ns_per_m, vec![environment])
    };
    let mut rig = rig(&settings, device(&case.master, hand), device(&case.slave, Box::new(wall)));
    let ticks = if case.order == "printed" { COMPARED_TICKS_PRINTED } else { case.ticks };
    let mut references: Vec<_> = COMPARED.iter().map(|(name, ..)| reference.column(name)).collect();
    let mut differences = vec![0.0_f64; COMPARED.len()];
    for _ in 0..ticks {
        rig.tick();
        for (((_, side, data_type, _), expected), difference) in
            COMPARED.iter().zip(&mut references).zip(&mut differences)
        {
            *difference = difference.max((signal(&rig, *side, data_type) - expected.next().unwrap()).abs());
        }
        rig.advance();
    }
    let peaks = COMPARED.iter().map(|(.., against)| reference.peak(against, ticks));
    differences.into_iter().zip(peaks).collect()
}

/// The folder of the reference runs, if there is one.
#[expect(
    clippy::explicit_write,
    reason = "past the capture of a passing test's output: that nothing was compared is to be seen"
)]
fn oracle() -> Option<PathBuf> {
    let folder = std::env::var_os("DIMSART_ORACLE");
    if folder.is_none() {
        let line = "not compared with python-control: DIMSART_ORACLE is not set; run `cargo xtask test`";
        writeln!(std::io::stderr(), "{line}").unwrap();
    }
    folder.map(PathBuf::from)
}

fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> T {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| {
        panic!("{}: {error}; make the reference runs with `cargo xtask test`", path.display())
    });
    serde_json::from_str(&text).unwrap()
}

#[derive(Deserialize)]
struct Predictions {
    weakly_damped: Vec<WeaklyDamped>,
}

#[derive(Deserialize)]
struct WeaklyDamped {
    order: String,
    forward_delay_ticks: u32,
    backward_delay_ticks: u32,
    hand_damping_ns_per_m: f64,
    slave: Side,
    wall_stiffness_n_per_m: f64,
    free_growth_per_tick: f64,
    contact_growth_per_tick: f64,
}

/// What is heard of a loop that is struck is its largest eigenvalue: within 2e-5 of one that grows, and within a third of
/// how far the others are from 1, where modes that die out together are not told apart.
#[test]
fn loops_grow_by_the_largest_eigenvalue_of_python_control() {
    let Some(folder) = oracle() else { return };
    let predictions: Predictions = read(&folder.join("predictions.json"));
    let mut growing = 0;
    for row in &predictions.weakly_damped {
        let scenario = scenario(&format!(
            "{} dof=1 wave.form={} hand.damping_ns_per_m={} hand.stiffness_n_per_m=0 slave.device.mass_kg={} \
             slave.device.damping_ns_per_m={} wall.stiffness_n_per_m={} wall.damping_ns_per_m=0",
            delays(row.forward_delay_ticks, row.backward_delay_ticks),
            row.order,
            row.hand_damping_ns_per_m,
            row.slave.mass_kg,
            row.slave.device_damping_ns_per_m,
            row.wall_stiffness_n_per_m,
        ));
        let loops = linear_loops(&scenario).unwrap();
        for (held, expected) in
            [(Held::Free, row.free_growth_per_tick), (Held::Contact, row.contact_growth_per_tick)]
        {
            let found = loops.iter().find(|one| one.held == held).unwrap();
            let growth = found.growth_per_tick.unwrap();
            let within = 2e-5 + 0.3 * (1.0 - expected).max(0.0);
            let ticks = [row.forward_delay_ticks, row.backward_delay_ticks];
            println!("{} {ticks:?} {held:?}: {growth:.6} for {expected:.6}", row.order);
            assert!((growth - expected).abs() < within, "{growth} for {expected}");
            assert_eq!(found.grows(), expected > 1.0);
            growing += u32::from(found.grows());
        }
    }
    assert!(growing >= 10, "{growing} of the loops grow");
}

#[test]
fn the_simulator_agrees_with_python_control() {
    let Some(folder) = oracle() else { return };
    let reference: Reference = read(&folder.join("cases.json"));
    assert_eq!(reference.tick_s.to_bits(), TICK_S.to_bits());
    assert!(!reference.cases.is_empty());
    let mut disagreements = Vec::new();
    for case in &reference.cases {
        println!("{} (largest difference, as a share of the peak)", case.name);
        let results = run(case, &Table::read(&folder.join(&case.file)));
        for ((name, ..), (difference, peak)) in COMPARED.iter().zip(results) {
            let share = difference / peak;
            println!("  {name:27} {difference:.1e} of {peak:.1e}: {share:.1e}");
            if share.is_nan() || share > TOLERANCE {
                disagreements.push(format!("{} {name}: {share:.1e} of the peak", case.name));
            }
        }
    }
    assert!(disagreements.is_empty(), "{disagreements:#?}");
}
