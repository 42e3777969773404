//! Stiffness of a held contact, from force and depth, and its settling.

/// Maximum remaining relative change of a settled stiffness.
const SETTLED: f64 = 1e-3;
/// Relative change between thirds that is rounding: `f32` positions at 0.05 m have a resolution of 4e-9 m.
const ROUNDING: f64 = 5e-6;

/// Force and depth of one axis over the observed time.
#[derive(Debug, Clone, Default)]
pub(crate) struct SettledContact {
    ticks: u32,
    ticks_in_contact: u32,
    /// Sums of force and depth of each third of the time.
    thirds: [(f64, f64); 3],
}

impl SettledContact {
    /// Adds a tick; `share` is the elapsed share of the time, 0 to 1.
    pub(crate) fn add(&mut self, share: f64, is_in_contact: bool, force: f64, depth: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0, 1 or 2")]
        let third = (3.0 * share).clamp(0.0, 2.0) as usize;
        self.ticks += 1;
        self.ticks_in_contact += u32::from(is_in_contact);
        if let Some((force_sum, depth_sum)) = self.thirds.get_mut(third) {
            *force_sum += force;
            *depth_sum += depth;
        }
    }

    /// Returns force divided by depth; `None` without continuous contact.
    pub(crate) fn stiffness(&self) -> Option<f64> {
        let sum = |of: fn(&(f64, f64)) -> f64| self.thirds.iter().map(of).sum::<f64>();
        let is_held = self.ticks > 0 && self.ticks_in_contact == self.ticks;
        is_held.then(|| sum(|third| third.0) / sum(|third| third.1))
    }

    /// Describes the remaining change of the stiffness if above 0.1 %.
    pub(crate) fn unsettled(&self) -> Option<String> {
        let left = self.left() / self.stiffness()?;
        let left = match left {
            settled if settled.abs() <= SETTLED => return None,
            left if left.is_finite() => format!("about {:.1} %", 100.0 * left),
            _ => "an unknown amount".to_owned(),
        };
        Some(format!("{left} of the final value is still missing"))
    }

    /// Remaining change of the stiffness, extrapolated as a geometric series from the changes between thirds; 0 for
    /// alternating changes, as caused by lost packets.
    fn left(&self) -> f64 {
        let [first, middle, last] = self.thirds.map(|(force, depth)| force / depth);
        let (before, after) = (middle - first, last - middle);
        let falls = after / before;
        match falls {
            _ if after.abs() <= ROUNDING * last.abs() => 0.0,
            falls if falls >= 1.0 => f64::INFINITY,
            falls if falls > 0.0 => after * falls / (1.0 - falls),
            _ => 0.0,
        }
    }
}
