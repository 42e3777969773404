//! Filters and observers: what they begin with, what they refuse, and what a change does on the way.

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

/// What has been the same for ever stays so, also when the filter changes.
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

/// A pole at 1 never comes to rest: an integrator begins with nothing.
#[test]
fn a_section_that_integrates_begins_with_no_memory() {
    let mut sum = filter("BIQUAD_MOD SOS[0][0] 1\nBIQUAD_MOD SOS[0][3] 1\nBIQUAD_MOD SOS[0][4] -1");
    for tick in 1..100_u8 {
        assert_close(sum.step(&[2.0]), 2.0 * f32::from(tick), 1e-6);
    }
}

/// A sample that was a million times larger is forgotten when it has left the window, and so is what rounding took of the
/// others meanwhile.
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

/// At a constant acceleration a tracking loop lags by two over its frequency, a filtered difference by one, and what knows
/// of accelerations not at all.
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

/// Of an encoder's steps it lets less through than a difference of the same frequency.
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

/// With the other model nobody provides an acceleration.
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
