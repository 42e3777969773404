//! What is said of a loop, beside its matrices: eigenvalues of the closed loop of plant and law, which the simulator never
//! makes.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::cast_possible_truncation, reason = "a few ticks")]

use std::f64::consts::PI;
use std::path::PathBuf;

use hil_sim::experiment;
use hil_sim::outcome::{LoopFigures, Outcome};
use hil_sim::rig_file::RigFile;
use nalgebra::{Complex, DMatrix, DVector, Schur};

const H: f64 = 1e-3;

/// A joint under PID, or with `is_velocity` under PI of its velocity.
#[derive(Debug, Clone, Copy)]
struct Loop {
    inertia: f64,
    damping: f64,
    /// Stiffness, damping and rotor inertia of a flexible joint.
    flexible: Option<[f64; 3]>,
    /// In whole and parts of ticks.
    delay: f64,
    gains: [f64; 3],
    filter_s: f64,
    is_velocity: bool,
    /// Ticks from one tick of the controller to the next.
    every: usize,
    /// Whether the module runs that rarely, in place of its controller.
    is_module_slow: bool,
}

const PID: Loop = Loop {
    inertia: 0.02,
    damping: 0.02,
    flexible: None,
    delay: 0.0,
    gains: [3000.0, 0.0, 100.0],
    filter_s: 0.0,
    is_velocity: false,
    every: 1,
    is_module_slow: false,
};

impl Loop {
    fn outcome(&self) -> Outcome {
        let [k, i, d] = self.gains;
        let (module, follows) = match self.is_velocity {
            true => ("PI_MOD", "DES_VELOCITY"),
            false => ("PIDCTRL_MOD", "DES_POSITION"),
        };
        let mut rows = format!("all {module} K_PARAM {k}\nall {module} I_PARAM {i}\n");
        if !self.is_velocity {
            rows += &format!("all {module} D_PARAM {d}\nall {module} FILTER_TIME {}\n", self.filter_s);
        }
        if self.is_module_slow {
            rows += &format!("all {module} EVERY_TICKS {}\n", self.every);
        }
        rows += &format!("all MOD_ENG MOD_ON {module}\nall MOD_ENG MATCHING_CHECK\n");
        let flexible = self.flexible.map_or(String::new(), |[stiffness, damping, rotor]| {
            format!(
                "plant.flexible = {{ stiffness = {stiffness}, damping = {damping} }}\nplant.gear.inertia_kg_m2 = {rotor}"
            )
        });
        let every = if self.is_module_slow { 1 } else { self.every };
        let text = format!(
            r#"
            duration_s = 0.3
            [[device]]
            name = "drive"
            measures = ["POSITION", "VELOCITY", "{follows}"]
            delay_ticks = {}
            [[device.axis]]
            plant.load = {{ inertia = {}, damping = {} }}
            {flexible}
            [[controller]]
            device = "drive"
            scheme = "loop.scheme"
            every_ticks = {every}
            [[experiment.move]]
            device = "drive"
            on = "{follows}"
            step = {{ at_s = 0.1, amplitude = 0.001 }}
            "#,
            self.delay, self.inertia, self.damping
        );
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("loop.scheme"), rows).unwrap();
        let file = RigFile::read(&text, "test", folder.path().to_owned(), &[]).unwrap();
        experiment::run(&file).unwrap().outcome
    }

    fn figures(&self) -> LoopFigures {
        self.outcome().axes[0].loop_figures.unwrap()
    }

    /// Transition and held input over a part of a tick, by the matrix exponential.
    fn held(&self, time_s: f64) -> (DMatrix<f64>, DVector<f64>) {
        let Self { inertia, damping, flexible, .. } = *self;
        let states = if flexible.is_some() { 4 } else { 2 };
        let mut rates = DMatrix::zeros(states + 1, states + 1);
        rates[(0, 1)] = 1.0;
        rates[(1, 1)] = -damping / inertia;
        match flexible {
            None => rates[(1, 2)] = 1.0 / inertia,
            Some([k, d, rotor]) => {
                for (at, entry) in [-k, -d - damping, k, d].into_iter().enumerate() {
                    rates[(1, at)] = entry / inertia;
                }
                rates[(2, 3)] = 1.0;
                for (at, entry) in [k, d, -k, -d, 1.0].into_iter().enumerate() {
                    rates[(3, at)] = entry / rotor;
                }
            }
        }
        let whole = (rates * time_s).exp();
        (whole.view((0, 0), (states, states)).into_owned(), whole.column(states).rows(0, states).into_owned())
    }

    /// One cycle of the loop with its command times `gain`, and the reference held.
    fn cycle(&self, state: &DVector<f64>, gain: f64, reference: f64) -> DVector<f64> {
        let Self { gains: [k, i, d], filter_s, .. } = *self;
        let part = self.delay.fract();
        let ((late, late_in), (early, early_in)) = (self.held(part * H), self.held((1.0 - part) * H));
        let plant = late.nrows();
        let mut next = state.clone();
        let mut x = state.rows(0, plant).into_owned();
        let mut past: Vec<f64> = state.rows(plant, 5).iter().copied().collect();
        let [integral, before, change] = [state[plant + 5], state[plant + 6], state[plant + 7]];
        let period = H * self.every as f64;
        let error = reference - if self.is_velocity { x[1] } else { x[0] };
        let smoothed = change + period / (period + filter_s) * (error - before - change);
        let integral = integral + i * period * error;
        let slope = if self.is_velocity { 0.0 } else { d / period * smoothed };
        let command = gain * (k * error + integral + slope);
        for _ in 0..self.every {
            past.insert(0, command);
            let whole = self.delay.floor() as usize;
            x = &early * (&late * &x + &late_in * past[whole + 1]) + &early_in * past[whole];
        }
        next.rows_mut(0, plant).copy_from(&x);
        next.rows_mut(plant, 5).copy_from_slice(&past[..5]);
        next.rows_mut(plant + 5, 3).copy_from_slice(&[integral, error, smoothed]);
        next
    }

    /// Its matrix with the command times `gain`, without what only adds up.
    fn matrix(&self, gain: f64) -> DMatrix<f64> {
        let states = if self.flexible.is_some() { 12 } else { 10 };
        let columns: Vec<_> = (0..states)
            .map(|at| {
                let unit = DVector::from_fn(states, |row, _| f64::from(u8::from(row == at)));
                self.cycle(&unit, gain, 0.0)
            })
            .collect();
        let matrix = DMatrix::from_columns(&columns);
        let is_idle = |at: usize| {
            let is_integral = at == states - 3 && self.gains[1] == 0.0;
            is_integral || (self.is_velocity && self.flexible.is_none() && at == 0)
        };
        let kept: Vec<usize> = (0..states).filter(|at| !is_idle(*at)).collect();
        matrix.select_rows(&kept).select_columns(&kept)
    }

    fn growth(&self) -> f64 {
        let radius = radius(&self.matrix(1.0).map(Complex::from));
        radius.powf(1.0 / self.every as f64)
    }

    /// The smallest of so many factors or angles at which the loop becomes unstable.
    fn first_unstable(
        &self,
        values: impl Iterator<Item = f64>,
        factor: impl Fn(f64) -> Complex<f64>,
    ) -> Option<f64> {
        let (open, closed) = (self.matrix(0.0), self.matrix(1.0));
        let is_unstable = |value: f64| {
            let turned = open.map(Complex::from) + (&closed - &open).map(|entry| factor(value) * entry);
            radius(&turned) > 1.0 + 1e-12
        };
        let mut before = None;
        for value in values {
            if is_unstable(value) {
                let (mut from, mut to) = (before?, value);
                for _ in 0..40 {
                    let middle = 0.5 * (from + to);
                    if is_unstable(middle) { to = middle } else { from = middle }
                }
                return Some(from);
            }
            before = Some(value);
        }
        None
    }

    fn gain_margin(&self) -> Option<f64> {
        self.first_unstable((0..1200).map(|n| 1.01_f64.powi(n)), Complex::from)
    }

    fn phase_margin_deg(&self) -> Option<f64> {
        let turn = |degrees: f64| Complex::from_polar(1.0, -degrees.to_radians());
        self.first_unstable((0..360).map(|n| 0.5 * f64::from(n)), turn)
    }
}

fn radius(matrix: &DMatrix<Complex<f64>>) -> f64 {
    let eigenvalues = Schur::new(matrix.clone()).eigenvalues().unwrap();
    eigenvalues.iter().map(|eigenvalue| eigenvalue.norm()).fold(0.0, f64::max)
}

fn assert_close(found: Option<f64>, expected: f64, within: f64, what: &str) {
    let found = found.unwrap_or(f64::NAN);
    assert!((found / expected - 1.0).abs() < within, "{what}: {found} instead of {expected}");
}

/// Every figure was worked out apart, by eigenvalues and by frequency responses of the loops' matrices with scipy.
#[test]
fn an_unstable_loop_is_never_stable_and_has_no_margin() {
    let velocity = |k: f64| Loop { is_velocity: true, damping: 0.0, gains: [k, 0.0, 0.0], ..PID };
    // (1 - K h/J) of a velocity loop.
    let cases = [(PID, 1.6043), (velocity(45.0), 1.25), (velocity(100.0), 4.0), (velocity(500.0), 24.0)];
    for (one, growth) in cases {
        let outcome = one.outcome();
        let figures = outcome.axes[0].loop_figures.unwrap();
        assert!(!outcome.stable && outcome.faults[0].contains("is unstable"), "{one:?}: {outcome:?}");
        assert_close(figures.growth_per_tick, growth, 1e-4, "growth");
        assert_eq!(
            figures,
            LoopFigures { growth_per_tick: figures.growth_per_tick, ..LoopFigures::default() }
        );
    }
}

#[test]
fn a_phase_that_crosses_at_half_the_sample_rate_gives_the_gain_margin() {
    for k in [10.0, 35.0, 39.0] {
        let one = Loop { is_velocity: true, damping: 0.0, gains: [k, 0.0, 0.0], ..PID };
        // K h/J = 2 is the end.
        assert_close(one.figures().gain_margin, 40.0 / k, 1e-5, "gain margin");
    }
}

#[test]
fn a_resonance_between_two_frequencies_is_found() {
    let one = Loop {
        inertia: 0.2968,
        damping: 0.1329,
        flexible: Some([41_280.0, 1.682, 0.083_99]),
        delay: 0.08,
        gains: [139.2, 266.0, 10.19],
        ..PID
    };
    let figures = one.figures();
    assert_close(figures.gain_margin, 1.4352, 2e-4, "gain margin");
    assert_close(figures.phase_margin_deg, 63.112, 2e-4, "phase margin");
}

#[test]
fn a_loop_that_is_stepped_rarely_has_the_margins_of_its_slow_period() {
    for (every, is_module_slow) in [(2, false), (2, true), (4, true), (5, false), (10, true)] {
        let gains = [40.0, 0.0, 1.5];
        let one = Loop { damping: 0.05, gains, every, is_module_slow, delay: 0.5, ..PID };
        let figures = one.figures();
        assert_close(figures.gain_margin, one.gain_margin().unwrap(), 1e-3, "gain margin");
        assert_close(figures.phase_margin_deg, one.phase_margin_deg().unwrap(), 1e-3, "phase margin");
    }
}

/// Random loops, flexible ones, with delays and slow controllers among them.
#[test]
fn random_loops_have_the_figures_of_their_eigenvalues() {
    let mut state = 7_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let (mut unstable, mut checked) = (0, 0);
    for _ in 0..60 {
        let mut between = |from: f64, to: f64| from * (to / from).powf(uniform());
        let inertia = between(0.005, 1.0);
        let is_velocity = between(1.0, 10.0) > 7.0;
        let natural = between(5.0, 1000.0);
        let stiffness =
            if is_velocity { inertia * between(50.0, 3000.0) } else { inertia * natural * natural };
        let damping = if is_velocity { 0.0 } else { 2.0 * between(0.2, 1.5) * inertia * natural };
        let integral = if between(1.0, 10.0) > 5.0 { 0.0 } else { stiffness * between(0.3, 10.0) };
        let stiff = inertia * between(100.0, 1500.0).powi(2);
        let flexible = [stiff, between(0.001, 0.1) * stiff.sqrt(), inertia * between(0.2, 1.0)];
        let every = [1, 1, 1, 2, 5][between(1.0, 5.999) as usize - 1];
        let one = Loop {
            inertia,
            damping: inertia * between(0.01, 3.0),
            flexible: (between(1.0, 10.0) > 5.0 && !is_velocity).then_some(flexible),
            delay: if between(1.0, 10.0) > 4.0 { between(0.05, 2.9) } else { 0.0 },
            gains: [stiffness, integral, damping],
            filter_s: if between(1.0, 10.0) > 4.0 { between(1e-4, 5e-3) } else { 0.0 },
            is_velocity,
            every,
            is_module_slow: between(1.0, 10.0) > 3.0,
        };
        let growth = one.growth();
        if (growth - 1.0).abs() < 1e-4 || one.gains[0] > 1e6 || one.gains[2] > 1e4 {
            continue;
        }
        let outcome = one.outcome();
        let figures = outcome.axes[0].loop_figures.unwrap_or_else(|| panic!("{one:?}: {outcome:?}"));
        checked += 1;
        if growth > 1.0 {
            unstable += 1;
            assert!(!outcome.stable, "{one:?}: {growth} {outcome:?}");
            assert_close(figures.growth_per_tick, growth, 1e-4, &format!("growth of {one:?}"));
            assert!(figures.gain_margin.is_none() && figures.phase_margin_deg.is_none(), "{one:?}");
            continue;
        }
        match figures.growth_per_tick {
            Some(found) => assert_close(Some(found), growth, 1e-4, &format!("growth of {one:?}")),
            None => assert!(growth < 0.998, "{one:?}: {growth}"),
        }
        let what = |figure: &str| format!("{figure} of {one:?}");
        match one.gain_margin().filter(|margin| *margin < 1e3) {
            Some(margin) => assert_close(figures.gain_margin, margin, 2e-3, &what("gain margin")),
            None => assert!(figures.gain_margin.is_none_or(|margin| margin > 900.0), "{figures:?} {one:?}"),
        }
        match one.phase_margin_deg() {
            Some(margin) => {
                let found = figures.phase_margin_deg.unwrap_or_else(|| panic!("{}", what("no phase margin")));
                assert!((found - margin).abs() < 0.05, "{}: {found} {margin}", what("phase margin"));
            }
            None => assert_eq!(figures.phase_margin_deg, None, "{one:?}"),
        }
    }
    assert!(checked > 50 && unstable > 7 && checked - unstable > 30, "{unstable} of {checked}");
}

/// `K / (J s² + D s + K)` with the damping on the measured velocity, or on that of the error: of the first -3 dB where both
/// poles are real, of the second far higher.
#[test]
fn bandwidth_is_that_from_reference_to_position() {
    let scheme = |module: &str| {
        let folder = tempfile::tempdir().unwrap();
        let rows = format!(
            "all {module} K_PARAM 150\nall {module} D_PARAM 6\nall MOD_ENG MOD_ON {module}\nall MOD_ENG MATCHING_CHECK"
        );
        std::fs::write(folder.path().join("law.scheme"), rows).unwrap();
        let text = r#"
            duration_s = 0.01
            [[device]]
            name = "drive"
            measures = ["POSITION", "VELOCITY", "DES_POSITION"]
            [[device.axis]]
            plant.load.inertia = 0.05
            [[controller]]
            device = "drive"
            scheme = "law.scheme"
            [[experiment.move]]
            device = "drive"
            on = "DES_POSITION"
            step = { at_s = 0.0, amplitude = 0.001 }
        "#;
        let file = RigFile::read(text, "test", folder.path().to_owned(), &[]).unwrap();
        experiment::run(&file).unwrap().outcome.axes[0].loop_figures.unwrap().bandwidth_hz
    };
    assert_close(scheme("IMPEDANCE_MOD"), 4.96, 2e-3, "impedance");
    // The continuous loop's: w² = (-(D² - 2JK) + sqrt((D² - 2JK)² + 4 J² K²)) / 2J², a little more with half a tick of hold.
    let (j, d, k) = (0.05, 6.0, 150.0_f64);
    let rest = d * d - 2.0 * j * k;
    let corner = (((rest * rest + 4.0 * j * j * k * k).sqrt() - rest) / (2.0 * j * j)).sqrt() / (2.0 * PI);
    assert_close(scheme("IMPEDANCE_MOD"), corner, 0.01, "impedance");
    assert_close(scheme("PID2_MOD"), corner, 0.02, "PID2 with default weights");
}

/// A torque that alternates between its limits is told by the run itself.
#[test]
fn saturation_that_alternates_in_sign_is_not_stable_without_margins() {
    let text = r#"
        duration_s = 1.0
        [[device]]
        name = "drive"
        measures = ["POSITION", "DES_POSITION"]
        [[device.axis]]
        plant.load = { inertia = 0.02, damping = 0.02 }
        [[controller]]
        device = "drive"
        scheme = "loop.scheme"
        [experiment]
        margins = false
        [[experiment.move]]
        device = "drive"
        on = "DES_POSITION"
        step = { at_s = 0.1, amplitude = 0.001 }
    "#;
    let folder = tempfile::tempdir().unwrap();
    let rows = "all PIDCTRL_MOD K_PARAM 3000\nall PIDCTRL_MOD D_PARAM 100\nall MOD_ENG MOD_ON PIDCTRL_MOD\nall MOD_ENG MATCHING_CHECK";
    std::fs::write(folder.path().join("loop.scheme"), rows).unwrap();
    let file = RigFile::read(text, "test", PathBuf::from(folder.path()), &[]).unwrap();
    let outcome = experiment::run(&file).unwrap().outcome;
    let is_told = outcome.faults.iter().any(|fault| fault.contains("alternates between its limits"));
    assert!(!outcome.stable && is_told, "{outcome:?}");
}
