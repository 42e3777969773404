//! Limits: they hold, and a joint never passes them.

use dimsart_core::types;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::{Alone, H};

/// A mass with friction, pushed at random: at full force in one direction for a while.
#[test]
fn a_joint_never_goes_beyond_its_limits_and_reaches_them() {
    let rows = "JLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nJLIMIT_MOD POSITION_LOW -0.5\nJLIMIT_MOD POSITION_HIGH 0.7
        JLIMIT_MOD VELOCITY_LIMIT 2\nJLIMIT_MOD FORCE_LIMIT 30\nJLIMIT_MOD DECELERATION 20\nJLIMIT_MOD INERTIA 1
        MOD_ENG MOD_ON JLIMIT_MOD";
    let measured = &[types::POSITION, types::VELOCITY, types::FEED_FORCE];
    for friction in [0.0, 3.0] {
        let mut module = Alone::new(1, measured, "DES_FORCE", rows);
        let mut random = Pcg32::seed_from_u64(3);
        let (mut x, mut v, mut push) = (0.0_f64, 0.0_f64, 0.0_f32);
        let (mut lowest, mut highest, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..60_000 {
            if random.next_u32() % 400 == 0 {
                push = [-1000.0, -5.0, 0.0, 5.0, 1000.0][(random.next_u32() % 5) as usize];
            }
            #[expect(clippy::cast_possible_truncation, reason = "as it is measured")]
            let force = module.step(&[x as f32, v as f32, push]);
            assert!(force.abs() <= 30.0);
            // The force is constant during the tick.
            let a = f64::from(force) - friction * v;
            let h = f64::from(H);
            x += h * (v + 0.5 * h * a);
            v += h * a;
            (lowest, highest, fastest) = (lowest.min(x), highest.max(x), fastest.max(v.abs()));
        }
        assert!(lowest > -0.5 - 1e-6 && highest < 0.7 + 1e-6, "{friction}: {lowest}, {highest}");
        assert!(lowest < -0.499 && highest > 0.699, "{friction}: {lowest}, {highest}");
        assert!(fastest < 2.000_01 && fastest > 1.4, "{friction}: {fastest}");
    }
}

#[test]
fn beyond_a_limit_a_joint_is_braked_and_may_go_back() {
    let rows = "JLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nJLIMIT_MOD FORCE_LIMIT 30\nMOD_ENG MOD_ON JLIMIT_MOD";
    let measured = &[types::POSITION, types::VELOCITY, types::FEED_FORCE];
    let mut module = Alone::new(1, measured, "DES_FORCE", rows);
    assert_eq!(module.step(&[1.5, 1.0, 10.0]).to_bits(), (-30.0_f32).to_bits());
    assert_eq!(module.step(&[1.5, -0.5, -4.0]).to_bits(), (-4.0_f32).to_bits());
}

/// Loads of 0.5 to 40 times `DECELERATION`, on a joint up to 30 % lighter or heavier than declared: each is
/// held at the limit for a minute, from rest and after an impact at maximum velocity; without the load the
/// joint returns.
#[test]
fn whatever_pushes_outwards_is_held_at_the_limit() {
    let rows = "JLIMIT_MOD PORT_FORCE_IN FEED_FORCE\nJLIMIT_MOD POSITION_HIGH 1\nJLIMIT_MOD POSITION_LOW -1
        JLIMIT_MOD VELOCITY_LIMIT 0.5\nJLIMIT_MOD FORCE_LIMIT 500\nJLIMIT_MOD DECELERATION 7\nJLIMIT_MOD INERTIA 0.5
        MOD_ENG MOD_ON JLIMIT_MOD";
    let measured = &[types::POSITION, types::VELOCITY, types::FEED_FORCE];
    let h = f64::from(H);
    for (load, side) in
        [1.75, 8.0, 10.0, 18.0, 20.0, 40.0, 140.0].into_iter().zip([1.0, -1.0].into_iter().cycle())
    {
        for inertia in [0.5, 0.385, 0.65] {
            let mut module = Alone::new(1, measured, "DES_FORCE", rows);
            let (mut x, mut v) = (0.999, 0.0);
            let mut tick = |x: &mut f64, v: &mut f64, load: f64| {
                #[expect(clippy::cast_possible_truncation, reason = "as it is measured")]
                let force = module.step(&[(side * *x) as f32, (side * *v) as f32, 0.0]);
                let a = (side * f64::from(force) + load) / inertia;
                *x += h * (*v + 0.5 * h * a);
                *v += h * a;
            };
            let mut furthest = 0.0_f64;
            for _ in 0..60_000 {
                tick(&mut x, &mut v, load);
                furthest = furthest.max(x);
            }
            // Until the load is known, it pushes the joint some ticks further.
            assert!(
                furthest < 1.0 + 30.0 * load / inertia * h * h + 25.0 * 7.0 * h * h,
                "{load}: {furthest}"
            );
            assert!(
                (x - 1.0 - 25.0 * 7.0 * h * h).abs() < 2e-4 && v.abs() < 1e-5,
                "{load} {inertia}: {x}, {v}"
            );
            let mut fastest = 0.0_f64;
            (0..1000).for_each(|_| {
                tick(&mut x, &mut v, 0.0);
                fastest = fastest.max(-v);
            });
            assert!(x < 1.0 + 1e-5 && fastest < 5.0 * load / inertia * h + 0.04, "{load}: {x}, {fastest}");
        }
    }
}

#[test]
fn homing_finds_a_stop_by_its_force_and_says_when_there_is_none() {
    let rows = "HOMING_MOD HOMING_VELOCITY 0.1\nHOMING_MOD BACK_OFF 0.005\nHOMING_MOD SEARCH_DISTANCE 0.1
        HOMING_MOD STALL_FORCE 2\nHOMING_MOD HOME_POSITION 1\nMOD_ENG MOD_ON HOMING_MOD";
    for (stop, state, homed) in [(0.05, 2.0, 0.995), (9.0, 3.0, 0.1)] {
        let mut module = Alone::new(1, &[types::POSITION, types::MEASURED_TORQUE], "DES_POSITION", rows);
        let (mut x, mut force, mut states) = (0.0_f32, 0.0_f32, Vec::new());
        for _ in 0..3000 {
            // A joint that follows within its stop and pushes with 300 N/m.
            let desired = module.step(&[x, force]);
            x = desired.min(stop);
            force = 300.0 * (desired - x);
            states.extend(module.bench.signal("STATE"));
        }
        states.dedup();
        assert_eq!(states.last(), Some(&state), "{states:?}");
        assert!(states.is_sorted() && states.len() == if state < 3.0 { 3 } else { 2 }, "{states:?}");
        let found = module.bench.signal("POSITION.2");
        assert!(found.iter().all(|x| (x - homed).abs() < 1e-4), "{found:?}");
    }
}

/// Each step of the last 10 rad is a sixtieth of an ulp of the position.
#[test]
fn homing_ends_its_search_at_the_end_of_a_long_way() {
    let rows = "HOMING_MOD HOMING_VELOCITY 1000\nHOMING_MOD SEARCH_DISTANCE 1e6\nMOD_ENG MOD_ON HOMING_MOD";
    let mut module = Alone::new(1, &[types::POSITION, types::MEASURED_TORQUE], "DES_POSITION", rows);
    (0..999_990).for_each(|_| _ = module.step(&[0.0, 0.0]));
    module.bench.rows("HOMING_MOD HOMING_VELOCITY 1");
    (0..9_000).for_each(|_| _ = module.step(&[0.0, 0.0]));
    assert_eq!(module.bench.signal("STATE"), [0.0]);
    (0..2_000).for_each(|_| _ = module.step(&[0.0, 0.0]));
    assert_eq!(module.bench.signal("STATE"), [3.0]);
}

#[test]
fn a_fixture_without_a_direction_does_nothing() {
    for form in ["PLANE", "HALF_SPACE"] {
        let rows = format!(
            "FIXTURE_MOD PORT_FORCE_IN FEED_FORCE\nFIXTURE_MOD K_PARAM 100\nFIXTURE_MOD FORM {form}\nMOD_ENG MOD_ON FIXTURE_MOD"
        );
        let mut module = Alone::new(2, &[types::POSITION, types::FEED_FORCE], "DES_FORCE", &rows);
        assert_eq!(module.axes(&[3.0, -2.0, 5.0, 7.0]), [5.0, 7.0]);
    }
}

/// A thirtieth of half an ulp per tick.
#[test]
fn a_limit_whose_step_is_lost_in_rounding_keeps_its_rate() {
    let rows = "LIMIT_MOD RATE 0.001\nMOD_ENG MOD_ON LIMIT_MOD";
    let mut module = Alone::new(1, &[types::SIGNAL], "SIGNAL_OUT", rows);
    module.step(&[1000.0]);
    for (wanted, end) in [(2000.0, 1000.1_f32), (0.0, 1000.0)] {
        (0..100_000).for_each(|_| _ = module.step(&[wanted]));
        assert!((module.step(&[wanted]) - end).abs() < 2e-4, "{end}");
    }
}

#[test]
fn a_limit_that_takes_over_makes_a_ramp_of_the_step() {
    let rows = "SIGGEN_MOD AMPLITUDE 3\nMOD_ENG MOD_ON SIGGEN_MOD";
    let mut module = Alone::new(1, &[types::SIGNAL], "SIGNAL_OUT", rows);
    module.step(&[-1.0]);
    module.bench.rows("LIMIT_MOD RATE 1000\nMOD_ENG BEGIN\nMOD_ENG MOD_OFF SIGGEN_MOD\nMOD_ENG MOD_ON LIMIT_MOD\nMOD_ENG COMMIT");
    let outputs = [-1.0; 5].map(|x| module.step(&[x]));
    assert!(
        outputs
            .iter()
            .zip([2.0, 1.0, 0.0, -1.0, -1.0])
            .all(|(x, wanted): (_, f32)| (x - wanted).abs() < 1e-6)
    );
}
