//! Filters and observers: initial values, refused parameters, and changes at run time.

use dimsart_core::{CommandError, ParameterError, types};

use crate::common::{Alone, H, assert_close};

fn filter(rows: &str) -> Alone {
    let (module, _) = rows.split_once(' ').unwrap_or_default();
    Alone::new(1, &[types::SIGNAL], "SIGNAL_OUT", &format!("{rows}\nMOD_ENG MOD_ON {module}"))
}

fn observer(rows: &str) -> Alone {
    let (module, _) = rows.split_once(' ').unwrap_or_default();
    Alone::new(1, &[types::POSITION], "VELOCITY", &format!("{rows}\nMOD_ENG MOD_ON {module}"))
}

const BUTTERWORTH: &str = "BIQUAD_MOD SOS[0][0] 0.0200833656\nBIQUAD_MOD SOS[0][1] 0.0401667311\n\
    BIQUAD_MOD SOS[0][2] 0.0200833656\nBIQUAD_MOD SOS[0][3] 1\nBIQUAD_MOD SOS[0][4] -1.56101808\n\
    BIQUAD_MOD SOS[0][5] 0.641351538";

/// A constant input gives a constant output, even if the filter changes.
#[test]
fn a_filter_begins_with_its_input_and_a_change_of_it_does_not_show_in_one_that_rests() {
    for (rows, change) in [
        ("LOWPASS_MOD FREQUENCY 3", "LOWPASS_MOD FREQUENCY 80"),
        ("LOWPASS_MOD ORDER SECOND", "LOWPASS_MOD DAMPING 0.1"),
        ("NOTCH_MOD FREQUENCY 60", "NOTCH_MOD FREQUENCY 7"),
        ("LEAD_LAG_MOD POLE 30", "LEAD_LAG_MOD ZERO 2"),
        ("MOVING_AVERAGE_MOD WINDOW 20", ""),
        (BUTTERWORTH, ""),
    ] {
        let mut filter = filter(rows);
        for tick in 0..200 {
            if tick == 100 {
                filter.bench.rows(change);
            }
            assert_close(filter.step(&[3.7]), 3.7, 2e-6);
        }
        assert!((filter.step(&[9.0]) - 3.7).abs() > 0.01, "{rows}");
    }
}

#[test]
fn a_low_pass_goes_on_from_what_another_one_gave_out_last() {
    for order in ["FIRST", "SECOND"] {
        let mut slow = filter(&format!("LOWPASS_MOD FREQUENCY 2\nLOWPASS_MOD.2 ORDER {order}"));
        slow.step(&[0.0]);
        let last = (0..20).map(|_| slow.step(&[1.0])).last().unwrap_or_default();
        slow.bench.rows("LOWPASS_MOD.2 FREQUENCY 5\nMOD_ENG BEGIN\nMOD_ENG MOD_OFF LOWPASS_MOD");
        slow.bench.rows("MOD_ENG MOD_ON LOWPASS_MOD.2\nMOD_ENG COMMIT");
        let next = slow.step(&[1.0]);
        assert!(last > 0.1 && (next - last).abs() < 0.05, "{order}: {last}, {next}");
    }
}

#[test]
fn a_frequency_that_the_ticks_do_not_have_does_no_harm() {
    for rows in [
        "LOWPASS_MOD ORDER SECOND\nLOWPASS_MOD FREQUENCY 1e5",
        "NOTCH_MOD FREQUENCY 1e5",
        "NOTCH_MOD QUALITY 1",
    ] {
        let mut filter = filter(rows);
        let found = (0..10_000_u16).map(|tick| filter.step(&[f32::from(tick % 2)]).abs());
        assert!(found.fold(0.0, f32::max) < 2.0, "{rows}");
    }
}

#[test]
fn a_section_has_an_a0_of_one_or_is_left_out() {
    let mut biquad = filter(BUTTERWORTH);
    let refused = CommandError::Parameter(ParameterError::OutOfRange);
    for value in ["2", "-1", "0.5"] {
        assert_eq!(biquad.bench.order(&format!("BIQUAD_MOD SOS[0][3] {value}")), Err(refused));
    }
    biquad.step(&[0.0]);
    assert!(biquad.step(&[1.0]) < 0.1);
    biquad.bench.rows("BIQUAD_MOD SOS[0][3] 0");
    assert_close(biquad.step(&[1.25]), 1.25, 0.0);
}

/// `scipy.signal.butter(8, 1, fs=1000, output="sos")`, rounded to `f32`.
const LOW: [[f64; 6]; 4] = [
    [9.337_203_445e-21, 1.867_440_689e-20, 9.337_203_445e-21, 1.0, -1.987_711_429_596, 0.987_750_649_452],
    [1.0, 2.0, 1.0, 1.0, -1.989_566_564_56, 0.989_605_844_021],
    [1.0, 2.0, 1.0, 1.0, -1.993_003_487_587, 0.993_042_826_653],
    [1.0, 2.0, 1.0, 1.0, -1.997_511_982_918, 0.997_551_441_193],
];

fn sections(sos: &[[f64; 6]]) -> String {
    let rows = sos.iter().enumerate().flat_map(|(section, row)| {
        let entries = row.iter().enumerate();
        entries.map(move |(place, value)| format!("BIQUAD_MOD SOS[{section}][{place}] {value:e}"))
    });
    rows.collect::<Vec<_>>().join("\n")
}

/// Poles near 1: the step response of a 1 Hz filter equals the response of the same coefficients in double precision.
#[test]
fn a_filter_of_a_low_frequency_keeps_its_gain() {
    let mut filter = filter(&sections(&LOW));
    filter.step(&[0.0]);
    let mut memory = [[0.0_f64; 2]; 4];
    for tick in 0..8000 {
        let mut y = 1.0;
        for (row, [s1, s2]) in LOW.iter().zip(&mut memory) {
            #[expect(clippy::cast_possible_truncation, reason = "rounded as in the module")]
            let [b0, b1, b2, _, a1, a2] = row.map(|value| f64::from(value as f32));
            let x = y;
            y = b0 * x + *s1;
            (*s1, *s2) = (b1 * x - a1 * y + *s2, b2 * x - a2 * y);
        }
        let found = f64::from(filter.step(&[1.0]));
        assert!((found - y).abs() < 2e-4, "{tick}: {found} for {y}");
    }
    assert_close(filter.step(&[1.0]), 1.0, 1e-3);
}

/// `scipy.signal.butter(4, 0.1, fs=1000, output="sos")`: as `f32` its gain is 4 % off, and could be 46 % off.
#[test]
fn a_filter_whose_coefficients_have_too_few_digits_is_refused_with_the_error() {
    let [first, last] = [
        [9.732_916_985e-15, 1.946_583_397e-14, 9.732_916_985e-15, 1.0, -1.998_839_297_808, 0.998_839_692_363],
        [1.0, 2.0, 1.0, 1.0, -1.999_518_826_76, 0.999_519_221_45],
    ];
    let mut biquad = filter("BIQUAD_MOD SOS[0][0] 1");
    let refused = Err(CommandError::Parameter(ParameterError::Imprecise { percent: 22 }));
    let rows = sections(&[first]);
    let answers: Vec<_> = rows.lines().map(|row| biquad.bench.order(row)).collect();
    assert_eq!(answers.last(), Some(&refused), "{answers:?}");
    assert!(answers.iter().rev().skip(1).all(Result::is_ok), "{answers:?}");
    let both = sections(&[[0.0; 6], last]);
    let answers: Vec<_> = both.lines().map(|row| biquad.bench.order(row)).collect();
    let refused = Err(CommandError::Parameter(ParameterError::Imprecise { percent: 25 }));
    assert_eq!(answers.last(), Some(&refused), "{answers:?}");
}

/// A pole at 1 never settles: an integrator starts at zero.
#[test]
fn a_section_that_integrates_begins_with_no_memory() {
    let mut sum = filter("BIQUAD_MOD SOS[0][0] 1\nBIQUAD_MOD SOS[0][3] 1\nBIQUAD_MOD SOS[0][4] -1");
    for tick in 1..100_u8 {
        assert_close(sum.step(&[2.0]), 2.0 * f32::from(tick), 1e-6);
    }
}

/// A sample a million times larger has no effect once it has left the window, nor has the rounding that it
/// caused.
#[test]
fn a_moving_average_does_not_drift() {
    let mut average = filter("MOVING_AVERAGE_MOD WINDOW 50");
    for tick in 0..1_000_000_u32 {
        let jump = if tick % 1000 == 7 { 1e6 } else { 0.0 };
        #[expect(clippy::cast_precision_loss, reason = "small numbers")]
        let small = (tick % 13) as f32 * 0.1;
        average.step(&[small + jump]);
    }
    (0..100).for_each(|_| {
        average.step(&[0.3]);
    });
    assert_close(average.step(&[0.3]), 0.3_f32, 1e-7);
}

#[test]
fn a_moving_average_begins_anew_after_a_reset() {
    let mut average = filter("MOVING_AVERAGE_MOD WINDOW 8");
    (0..20).for_each(|_| {
        average.step(&[1e3]);
    });
    average.bench.rows("MOD_ENG MOD_RESET MOVING_AVERAGE_MOD");
    for _ in 0..20 {
        assert_close(average.step(&[1.0]), 1.0, 1e-6);
    }
}

/// At constant acceleration a tracking loop lags by two over its frequency, a filtered difference by one, and
/// a model with acceleration not at all.
#[test]
fn observers_lag_as_their_frequency_says() {
    const ACCELERATION: f32 = 4.0;
    let lag_s = |rows: &str| {
        let mut observer = observer(rows);
        let mut last = 0.0;
        for tick in 0..1000_u16 {
            let time = H * f32::from(tick);
            last = time - observer.step(&[0.5 * ACCELERATION * time * time]) / ACCELERATION;
        }
        last
    };
    let omega = 62.831_85;
    assert_close(lag_s("VELOCITY_OBSERVER_MOD FREQUENCY 10"), 2.0 / omega, 1.5e-3);
    assert_close(
        lag_s("VELOCITY_OBSERVER_MOD METHOD DIFFERENCE\nVELOCITY_OBSERVER_MOD FREQUENCY 10"),
        1.0 / omega,
        1.5e-3,
    );
    assert_close(lag_s("KALMAN_MOD MODEL CONSTANT_ACCELERATION"), 0.0, 1e-3);
}

/// It attenuates an encoder's quantisation more than a difference with the same frequency.
#[test]
fn a_tracking_loop_smooths_the_steps_of_an_encoder() {
    let ripple = |rows: &str| {
        let mut observer = observer(rows);
        let (mut least, mut most) = (f32::MAX, f32::MIN);
        for tick in 0..4000_u16 {
            let x = (0.37 * f32::from(tick) / 10.0).floor() * 1e-4;
            let found = observer.step(&[x]);
            if tick > 2000 {
                (least, most) = (found.min(least), found.max(most));
            }
        }
        most - least
    };
    let tracking = ripple("VELOCITY_OBSERVER_MOD FREQUENCY 20");
    let difference = ripple("VELOCITY_OBSERVER_MOD METHOD DIFFERENCE\nVELOCITY_OBSERVER_MOD FREQUENCY 20");
    assert!(tracking < 0.5 * difference, "{tracking} {difference}");
}

#[test]
fn an_observer_takes_over_with_the_velocity_of_the_one_before() {
    let rows = "VELOCITY_OBSERVER_MOD FREQUENCY 30\nMOD_ENG MOD_ON VELOCITY_OBSERVER_MOD";
    for other in ["VELOCITY_OBSERVER_MOD.2", "KALMAN_MOD"] {
        let mut observer = Alone::new(1, &[types::POSITION], "VELOCITY", rows);
        let mut tick = 0_u16;
        let mut step = |observer: &mut Alone| {
            tick += 1;
            observer.step(&[2.0 * H * f32::from(tick)])
        };
        (0..500).for_each(|_| {
            step(&mut observer);
        });
        observer.bench.rows(&format!(
            "{other} PORT_VELOCITY VELOCITY\nMOD_ENG BEGIN\nMOD_ENG MOD_OFF VELOCITY_OBSERVER_MOD"
        ));
        observer.bench.rows(&format!("MOD_ENG MOD_ON {other}\nMOD_ENG COMMIT"));
        for _ in 0..50 {
            assert_close(step(&mut observer), 2.0, 0.01);
        }
    }
}

/// With the other model the acceleration has no provider.
#[test]
fn a_kalman_filter_has_an_acceleration_where_its_model_has_one() {
    let provides = |model: &str| {
        let observer = observer(&format!("KALMAN_MOD MODEL {model}"));
        let engine = observer.bench.dimsart.engine();
        engine.device().signal("ACCELERATION").and_then(|signal| engine.data_base().slot(signal)).is_some()
    };
    assert!(provides("CONSTANT_ACCELERATION"));
    assert!(!provides("CONSTANT_VELOCITY"));
}

/// A ramp far from zero, quantised by `f32`: every observer and method finds its mean velocity within 0.1 %,
/// at any distance.
#[test]
fn a_velocity_is_observed_far_from_zero() {
    for rows in [
        "VELOCITY_OBSERVER_MOD FREQUENCY 20",
        "VELOCITY_OBSERVER_MOD FREQUENCY 1",
        "VELOCITY_OBSERVER_MOD METHOD DIFFERENCE\nVELOCITY_OBSERVER_MOD FREQUENCY 5",
        "VELOCITY_OBSERVER_MOD METHOD ALPHA_BETA\nVELOCITY_OBSERVER_MOD ALPHA 0.05\nVELOCITY_OBSERVER_MOD BETA 0.002",
        "KALMAN_MOD POSITION_NOISE 1e-3",
        "KALMAN_MOD MODEL CONSTANT_ACCELERATION\nKALMAN_MOD POSITION_NOISE 1e-2",
        "DIFFERENTIATOR_MOD FILTER_TIME 0.03\nDIFFERENTIATOR_MOD PORT_SIGNAL_IN POSITION\nDIFFERENTIATOR_MOD PORT_SIGNAL_OUT VELOCITY",
    ] {
        for start in [0.0, 1e4, 3e4, 1e5, -1e5, 1e6] {
            let mut observer = observer(rows);
            let position = |tick: u32| start + 0.5 * f64::from(H) * f64::from(tick);
            #[expect(clippy::cast_possible_truncation, reason = "as it is measured")]
            let velocities: Vec<_> =
                (0..60_000).map(|tick| observer.step(&[position(tick) as f32])).collect();
            let (count, sum) = velocities[20_000..]
                .iter()
                .fold((0.0, 0.0), |(count, sum), v| (count + 1.0, sum + f64::from(*v)));
            let mean = sum / count;
            assert!((mean - 0.5).abs() < 5e-4, "{rows} at {start}: {mean}");
        }
    }
}

/// A lead of ten, with a reference far away: the output follows small steps of the input, whatever its
/// magnitude.
#[test]
fn a_lead_and_a_state_feedback_lose_nothing_far_from_zero() {
    for start in [0.0_f32, 1e4, 1e5] {
        let mut lead = filter("LEAD_LAG_MOD ZERO 0.01\nLEAD_LAG_MOD POLE 0.1");
        lead.step(&[start]);
        // A step of 1/64, which is representable at 1e5: at once ten times as much minus half a tick, then
        // with 1.6 s.
        let step = 0.015_625;
        let share = core::f64::consts::PI * 0.1 * f64::from(H);
        let (share, mut lacking) = (share / (1.0 + share), f64::from(step));
        for tick in 0..5000 {
            let found = f64::from(lead.step(&[start + step])) - f64::from(start);
            let change = share * lacking;
            let expected = f64::from(step) + 9.0 * (lacking - change);
            lacking -= 2.0 * change;
            // Half of the output's last digit.
            assert!((found - expected).abs() < 0.004 + 1e-4, "{start} {tick}: {found} for {expected}");
        }
        let mut feedback = Alone::new(
            1,
            &[types::POSITION, types::VELOCITY, types::DES_POSITION],
            "DES_FORCE",
            "STATE_FEEDBACK_MOD K1_PARAM 997\nSTATE_FEEDBACK_MOD REFERENCE_GAIN 997\nMOD_ENG MOD_ON STATE_FEEDBACK_MOD",
        );
        let force = feedback.step(&[start, 0.0, start + step]);
        assert_close(force, 997.0 * 0.015_625, 1e-6);
    }
}

/// A constant error whose contribution is less than the last digit of a large integral is not lost.
#[test]
fn an_integral_goes_on_growing_by_small_steps() {
    for (module, gain) in [("PIDCTRL_MOD", 2.0), ("PID2_MOD", 2.0), ("STATE_FEEDBACK_MOD", 2.0)] {
        let rows = format!("{module} I_PARAM {gain}\nMOD_ENG MOD_ON {module}");
        let measured = &[types::POSITION, types::VELOCITY, types::DES_POSITION];
        let mut module = Alone::new(1, measured, "DES_FORCE", &rows);
        (0..1000).for_each(|_| _ = module.step(&[0.0, 0.0, 100.0]));
        let before = module.step(&[0.0, 0.0, 1e-3]);
        let after = (0..100_000).map(|_| module.step(&[0.0, 0.0, 1e-3])).last().unwrap_or_default();
        // 2 N/(m s) of 1 mm over 100 s; the integral is 200 N, whose last digit is 15 micronewtons.
        assert!((after - before - 0.2).abs() < 1e-3, "{rows}: {before} to {after}");
    }
}
