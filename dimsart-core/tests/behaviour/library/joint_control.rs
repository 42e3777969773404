//! Joint controllers: limits, take-over, and closed loops with a mass.

use dimsart_core::types;

use crate::common::{Alone, Bench, H, Types, assert_close};

const MASS_KG: f32 = 0.5;
const SERVO: Types = &[types::POSITION, types::DES_POSITION];

/// A mass with a controller and a load.
struct Joint {
    bench: Bench,
    x_m: f32,
    v_m_s: f32,
    load_n: f32,
    force_n: f32,
    largest_step_n: f32,
}

impl Joint {
    fn new(rows: &str) -> Self {
        let measured = &[types::POSITION, types::VELOCITY, types::DES_POSITION, types::DES_VELOCITY];
        let mut bench = Bench::of(1, measured, &[types::DES_FORCE]);
        bench.run(rows);
        Self { bench, x_m: 0.0, v_m_s: 0.0, load_n: 0.0, force_n: 0.0, largest_step_n: 0.0 }
    }

    /// Runs a tick towards a position and a velocity.
    fn tick(&mut self, desired_m: f32, desired_m_s: f32) {
        let before = self.force_n;
        let commanded = self.bench.tick(&[self.x_m, self.v_m_s, desired_m, desired_m_s]);
        self.force_n = commanded.first().copied().unwrap_or(f32::NAN);
        self.largest_step_n = (self.force_n - before).abs().max(self.largest_step_n);
        self.v_m_s += H * (self.force_n + self.load_n) / MASS_KG;
        self.x_m += H * self.v_m_s;
    }

    fn run(&mut self, ticks: u32, desired_m: f32, desired_m_s: f32) {
        (0..ticks).for_each(|_| self.tick(desired_m, desired_m_s));
    }

    /// Follows a sine between two ticks; returns the maximum step of the force.
    fn swing(&mut self, from: u16, to: u16) -> f32 {
        self.largest_step_n = 0.0;
        for tick in from..to {
            let phase = 6.0 * H * f32::from(tick);
            self.tick(0.1 * phase.sin(), 0.6 * phase.cos());
        }
        self.largest_step_n
    }
}

#[test]
fn pi_holds_a_velocity_against_a_load() {
    let mut joint = Joint::new("PI_MOD K_PARAM 10\nPI_MOD I_PARAM 100\nMOD_ENG MOD_ON PI_MOD");
    joint.load_n = -7.0;
    joint.run(2000, 0.0, 0.5);
    assert_close(joint.v_m_s, 0.5, 1e-4);
    assert_close(joint.force_n, 7.0, 1e-3);
}

/// The integral settles at 10 N for an error of 1; for -1 it reaches zero after the tracking time times ln 2.
#[test]
fn pi_leaves_its_limit_within_the_tracking_time_however_long_it_was_there() {
    let rows = "PI_MOD I_PARAM 100\nPI_MOD LIMIT 10\nPI_MOD TRACKING_TIME 0.1\nMOD_ENG MOD_ON PI_MOD";
    for seconds in [2, 20] {
        let mut pi = Alone::new(1, &[types::VELOCITY, types::DES_VELOCITY], "DES_FORCE", rows);
        (0..seconds * 1000).for_each(|_| assert!(pi.step(&[0.0, 1.0]) <= 10.0));
        let ticks: f32 = (0..1000).take_while(|_| pi.step(&[0.0, -1.0]) >= 10.0).map(|_| 1.0).sum();
        assert_close(ticks * H, 0.1 * core::f32::consts::LN_2, 2.0 * f64::from(H));
    }
}

#[test]
fn pid2_that_is_clamped_leaves_its_limit_at_once_and_one_that_is_bled_after_a_while() {
    let recovery = |anti_windup: &str| {
        let rows = format!(
            "PID2_MOD I_PARAM 100\nPID2_MOD LIMIT 10\nPID2_MOD ANTI_WINDUP {anti_windup}\nMOD_ENG MOD_ON PID2_MOD"
        );
        let mut pid = Alone::new(1, SERVO, "DES_FORCE", &rows);
        (0..5000).for_each(|_| assert!(pid.step(&[0.0, 1.0]) <= 10.0));
        (0..1000).take_while(|_| pid.step(&[0.0, -1.0]) >= 10.0).count()
    };
    assert!(recovery("CLAMPING") <= 1);
    assert!((60..80).contains(&recovery("BACK_CALCULATION")));
}

#[test]
fn pid2_does_not_kick_when_the_reference_steps_and_does_when_the_joint_is_hit() {
    let rows =
        "PID2_MOD K_PARAM 100\nPID2_MOD D_PARAM 5\nPID2_MOD SETPOINT_WEIGHT 0\nMOD_ENG MOD_ON PID2_MOD";
    let mut pid = Alone::new(1, SERVO, "DES_FORCE", rows);
    pid.step(&[0.0, 0.0]);
    assert_close(pid.step(&[0.0, 1.0]), 0.0, 0.0);
    assert_close(pid.step(&[0.001, 1.0]), -0.1 - 5.0, 1e-4);
}

#[test]
fn a_cascade_goes_a_long_way_at_its_largest_velocity_and_arrives() {
    let mut joint = Joint::new(
        "CASCADE_MOD POSITION_GAIN 10\nCASCADE_MOD VELOCITY_LIMIT 0.8\nCASCADE_MOD K_PARAM 40\n\
         CASCADE_MOD I_PARAM 200\nCASCADE_MOD LIMIT 30\nMOD_ENG MOD_ON CASCADE_MOD",
    );
    joint.load_n = -5.0;
    let mut fastest = 0.0_f32;
    for tick in 0..4000 {
        joint.tick(2.0, 0.0);
        fastest = fastest.max(joint.v_m_s);
        assert!(joint.force_n.abs() <= 30.0);
        assert!(tick != 1000 || (joint.v_m_s - 0.8).abs() < 0.01, "{}", joint.v_m_s);
    }
    assert!(fastest < 0.88, "{fastest}");
    assert_close(joint.x_m, 2.0, 1e-3);
}

const PD: &str = "PDCTRL_MOD K_PARAM 1000\nPDCTRL_MOD D_PARAM 20\nMOD_ENG MOD_ON PDCTRL_MOD";

#[test]
fn what_integrates_takes_over_from_a_pd_without_a_step_of_the_force() {
    for rows in [
        "PID2_MOD K_PARAM 600\nPID2_MOD D_PARAM 30\nPID2_MOD I_PARAM 3000\nPID2_MOD DERIVATIVE_WEIGHT 1",
        "CASCADE_MOD POSITION_GAIN 30\nCASCADE_MOD K_PARAM 30\nCASCADE_MOD I_PARAM 200",
        "STATE_FEEDBACK_MOD K1_PARAM 800\nSTATE_FEEDBACK_MOD K2_PARAM 30\nSTATE_FEEDBACK_MOD I_PARAM 5000\nSTATE_FEEDBACK_MOD REFERENCE_GAIN 800",
        "PI_MOD K_PARAM 20\nPI_MOD I_PARAM 300",
    ] {
        let (module, _) = rows.split_once(' ').unwrap_or_default();
        for moment in [100, 333, 620] {
            let mut joint = Joint::new(PD);
            joint.load_n = 6.0;
            joint.bench.rows(rows);
            joint.swing(0, moment - 20);
            let usual = joint.swing(moment - 20, moment);
            joint.bench.rows(&format!(
                "MOD_ENG BEGIN\nMOD_ENG MOD_OFF PDCTRL_MOD\nMOD_ENG MOD_ON {module}\nMOD_ENG COMMIT"
            ));
            let step = joint.swing(moment, moment + 20);
            assert!(step < 2.0 * usual + 0.1, "{module} at {moment}: {step} N, usually {usual} N");
        }
    }
}

#[test]
fn a_state_feedback_begins_where_the_joint_stands() {
    let mut joint = Joint::new(
        "STATE_FEEDBACK_MOD K1_PARAM 100\nSTATE_FEEDBACK_MOD K2_PARAM 12\nSTATE_FEEDBACK_MOD I_PARAM 300\n\
         MOD_ENG MOD_ON STATE_FEEDBACK_MOD",
    );
    joint.x_m = 0.7;
    joint.tick(0.7, 0.0);
    assert_close(joint.force_n, 0.0, 1e-5);
    joint.load_n = 3.0;
    joint.run(5000, 0.5, 0.0);
    assert_close(joint.x_m, 0.5, 1e-4);
}

/// A hand perceives 2 kg instead of 0.5 kg.
#[test]
fn an_impedance_is_felt_with_the_inertia_that_is_asked_for() {
    let mut bench = Bench::of(
        1,
        &[types::POSITION, types::VELOCITY, types::DES_POSITION, types::EXTERNAL_FORCE],
        &[types::DES_FORCE],
    );
    bench.run(
        "IMPEDANCE_MOD SHAPES_INERTIA ON\nIMPEDANCE_MOD M_PARAM 2\nIMPEDANCE_MOD INERTIA 0.5\n\
         IMPEDANCE_MOD LIMIT 4\nMOD_ENG MOD_ON IMPEDANCE_MOD",
    );
    let mut accelerated = |hand_n: f32| {
        let commanded = bench.tick(&[0.0, 0.0, 0.0, hand_n]);
        commanded.iter().map(|force_n| (force_n + hand_n) / MASS_KG).sum::<f32>()
    };
    assert_close(accelerated(4.0), 2.0, 1e-6);
    // The motor can compensate 4 N of 100 N, and no more.
    assert_close(accelerated(100.0), 192.0, 1e-6);
}

const FORCED: Types = &[types::POSITION, types::EXTERNAL_FORCE];

#[test]
fn an_admittance_stops_at_its_limit_and_comes_back_at_once() {
    let rows = "ADMITTANCE_MOD LIMIT 0.25\nADMITTANCE_MOD D_PARAM 1\nMOD_ENG MOD_ON ADMITTANCE_MOD";
    let mut admittance = Alone::new(1, FORCED, "DES_POSITION", rows);
    for _ in 0..3000 {
        assert!(admittance.step(&[1.0, 5.0]) <= 1.25);
    }
    assert_close(admittance.step(&[1.0, -5.0]), 1.25, 1e-5);
    assert!((0..100).map(|_| admittance.step(&[1.0, -5.0])).last() < Some(1.24));
}

#[test]
fn an_admittance_goes_on_where_it_is_when_its_law_changes_or_another_one_takes_over() {
    let rows = "ADMITTANCE_MOD M_PARAM 2\nADMITTANCE_MOD D_PARAM 1\nMOD_ENG MOD_ON ADMITTANCE_MOD\n\
                ADMITTANCE_MOD.2 K_PARAM 400\nADMITTANCE_MOD.2 D_PARAM 40";
    let mut admittance = Alone::new(1, FORCED, "DES_POSITION", rows);
    let mut moved = (0..500).map(|_| admittance.step(&[0.5, 4.0]));
    let (before, last) = (moved.nth(498), moved.next());
    let step = |admittance: &mut Alone, last: f32| (admittance.step(&[0.5, 4.0]) - last).abs();
    let usual = last.zip(before).map_or(0.0, |(last, before)| (last - before).abs());
    let last = last.unwrap_or_default();
    admittance.bench.rows("ADMITTANCE_MOD K_PARAM 50");
    assert!(step(&mut admittance, last) < 1.1 * usual);
    let last = admittance.step(&[0.5, 4.0]);
    admittance.bench.rows(
        "MOD_ENG BEGIN\nMOD_ENG MOD_OFF ADMITTANCE_MOD\nMOD_ENG MOD_ON ADMITTANCE_MOD.2\nMOD_ENG COMMIT",
    );
    assert!(step(&mut admittance, last) < 1.1 * usual);
}

/// A spring yields under a load; with the observer's compensation it does not.
#[test]
fn a_disturbance_observer_takes_a_load_off_a_controller() {
    let scheme = |share: &str| {
        format!(
            "DISTURBANCE_OBSERVER_MOD INERTIA 0.5\nDISTURBANCE_OBSERVER_MOD COMPENSATION {share}\n\
             MOD_ENG MOD_ON DISTURBANCE_OBSERVER_MOD\n\
             PDCTRL_MOD K_PARAM 100\nPDCTRL_MOD D_PARAM 10\nPDCTRL_MOD PORT_DES_FORCE DES_FORCE.2\n\
             MOD_ENG MOD_ON PDCTRL_MOD\n\
             SUM_MOD PORT_A DES_FORCE.2\nSUM_MOD PORT_B FEED_FORCE\nSUM_MOD PORT_SIGNAL_OUT DES_FORCE\n\
             MOD_ENG MOD_ON SUM_MOD"
        )
    };
    for (share, expected_m) in [("0", -0.05), ("1", 0.0)] {
        let mut joint = Joint::new(&scheme(share));
        joint.load_n = -5.0;
        joint.run(3000, 0.0, 0.0);
        assert_close(joint.x_m, expected_m, 1e-4);
        assert_close(joint.bench.signal("EXTERNAL_FORCE").iter().sum::<f32>(), -5.0, 1e-3);
    }
}

#[test]
fn friction_is_nothing_at_rest_and_the_same_both_ways() {
    let rows = "FRICTION_MOD COULOMB 2\nFRICTION_MOD BREAKAWAY 3\nFRICTION_MOD VISCOUS 1\nMOD_ENG MOD_ON FRICTION_MOD";
    let mut friction = Alone::new(1, &[types::DES_VELOCITY], "FEED_FORCE", rows);
    assert_close(friction.step(&[0.0]), 0.0, 0.0);
    for velocity in [1e-4, 0.01, 0.05, 0.3, 1e3] {
        let forward = friction.step(&[velocity]);
        assert!(forward > 0.0);
        assert_close(friction.step(&[-velocity]), -forward, 0.0);
    }
    // Where Stribeck's curve has ended.
    assert_close(friction.step(&[1.0]), 3.0, 1e-6);
}

#[test]
fn cogging_is_the_same_in_every_turn_on_both_sides_of_zero() {
    let entries =
        (0..16).map(|place| format!("COGGING_MOD TABLE[0][{place}] {}\n", place % 7)).collect::<String>();
    let rows = format!("{entries}COGGING_MOD PERIOD 0.5\nMOD_ENG MOD_ON COGGING_MOD");
    let mut cogging = Alone::new(1, &[types::POSITION], "FEED_FORCE", &rows);
    for place in 0..64_u8 {
        let x = f32::from(place) / 128.0;
        let force = cogging.step(&[x]);
        for turns in [-3.0, -1.0, 2.0] {
            assert_close(cogging.step(&[x + 0.5 * turns]), force, 1e-6);
        }
        let (entry, part) = (place / 4, f32::from(place % 4) / 4.0);
        let (here, next) = (f32::from(entry % 7), f32::from((entry + 1) % 16 % 7));
        assert_close(force, here + part * (next - here), 1e-6);
    }
}
