//! Joints against closed forms and conservation laws.

use super::*;

mod basics;
mod energy;
mod exact;
mod flexible;
mod friction;
mod gear;
mod motor;
mod parameters;
mod stops;
mod three_phase;

const PERIOD_S: f64 = 1e-3;

/// Holds `command` for `ticks` under no outside force, calling `each` with the time after every one of them.
fn hold(joint: &mut Joint, ticks: u32, command: f64, mut each: impl FnMut(f64, JointState)) {
    for tick in 0..ticks {
        joint.advance(f64::from(tick) * PERIOD_S, PERIOD_S, command, &|_| 0.0);
        each(f64::from(tick + 1) * PERIOD_S, joint.state());
    }
}

#[track_caller]
fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual:e} instead of {expected:e}");
}

/// The largest difference that `see` was shown.
#[derive(Default)]
struct Worst(f64);

impl Worst {
    fn see(&mut self, actual: f64, expected: f64) {
        let difference = (actual - expected).abs();
        // NaN is the worst of all.
        if difference.is_nan() || difference > self.0 {
            self.0 = difference;
        }
    }

    #[track_caller]
    fn below(&self, what: &str, tolerance: f64) {
        println!("{what}: off by {:.1e}, allowed {tolerance:.0e}", self.0);
        assert!(self.0 <= tolerance, "{what}: off by {:e}, allowed {tolerance:e}", self.0);
    }
}
