//! Independent model of the readings that a side's sensors can show.

use crate::faulty_pair::SENSOR_LIMITS;
use dimsart_core::{Scalar as _, Word};

/// In a tick of a millisecond, m.
const STEP_M: f32 = SENSOR_LIMITS.rate_per_s * 1e-3;

/// What each axis showed last that it can; nothing before it has shown anything.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sensors(Vec<Option<f32>>);

impl Sensors {
    /// Whether this is no measurement of a device of so many axes.
    pub(crate) fn refuse(&mut self, measured: &[Word], axes: usize) -> bool {
        let shown_m: Vec<f32> = measured.iter().map(|word| f32::from_word(*word)).collect();
        if shown_m.len() != axes || !shown_m.iter().all(|shown_m| shown_m.is_finite()) {
            return true;
        }
        self.0.resize(axes, None);
        let mut is_refused = false;
        for (last_m, now_m) in self.0.iter_mut().zip(shown_m) {
            let is_in_range = (SENSOR_LIMITS.min..=SENSOR_LIMITS.max).contains(&now_m);
            if is_in_range && last_m.is_none_or(|last_m| (now_m - last_m).abs() <= STEP_M) {
                *last_m = Some(now_m);
            } else {
                is_refused = true;
            }
        }
        is_refused
    }

    /// The device may be anywhere.
    pub(crate) fn begin_anew(&mut self) {
        self.0.clear();
    }
}
