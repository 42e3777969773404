//! What the hand feels of what the slave meets, measured in the settled contact.
//!
//! What it should be: [`Chain::stiffness_n_per_m`](crate::bilateral::chain::Chain::stiffness_n_per_m).

use std::ops::Range;

use dimsart_core::types;

use crate::plant::Obstacle;
use crate::rig::{Probe, Rig};

/// Share of the stiffness that it may still be away from where it goes.
const SETTLED: f64 = 1e-3;
/// Share below which a change from third to third is rounding.
const ROUNDING: f64 = 1e-6;

/// Averages force and depth of the master while the contact is settled.
#[derive(Debug)]
pub struct PerceivedStiffness {
    force: Probe,
    /// When it is looked at, `s`.
    watched_s: Range<f64>,
    axes: Vec<Sums>,
}

#[derive(Debug, Clone, Default)]
struct Sums {
    /// Where depth begins, `m`; none where nothing stops the slave.
    surface_m: Option<f64>,
    ticks: u32,
    ticks_in_contact: u32,
    /// Force (`N`) and depth (`m`) of each third of the time.
    thirds: [(f64, f64); 3],
}

impl Sums {
    fn stiffness_n_per_m(&self) -> f64 {
        let sum = |of: fn(&(f64, f64)) -> f64| self.thirds.iter().map(of).sum::<f64>();
        sum(|third| third.0) / sum(|third| third.1)
    }

    /// How far the stiffness still has to go, `N/m`, when its change from third to third falls as it did: what is left of
    /// a geometric series. 0 where it goes to and fro, as lost packets have it.
    fn left_n_per_m(&self) -> f64 {
        let [first, middle, last] = self.thirds.map(|(force_n, depth_m)| force_n / depth_m);
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

impl PerceivedStiffness {
    /// For a rig whose first station is the master and whose last one meets these obstacles, by axis.
    #[must_use]
    pub fn new(obstacles: &[Option<Obstacle>], watched_s: Range<f64>) -> Self {
        let surface_m = |obstacle: &Option<Obstacle>| obstacle.map(|obstacle| obstacle.surface_m);
        let sums = |obstacle| Sums { surface_m: surface_m(obstacle), ..Sums::default() };
        let axes = obstacles.iter().map(sums).collect();
        Self { force: Probe::new(types::DES_FORCE.first()), watched_s, axes }
    }

    /// Adds the present tick. `touches` says for an axis whether the slave is pressed against its obstacle.
    pub fn add(&mut self, rig: &Rig, touches: impl Fn(usize) -> bool) {
        let Some(master) = rig.stations().first() else { return };
        let share = (rig.time_s() - self.watched_s.start) / (self.watched_s.end - self.watched_s.start);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0, 1 or 2")]
        let third = (3.0 * share).clamp(0.0, 2.0) as usize;
        let mut forces = self.force.values(master);
        for (axis, sums) in self.axes.iter_mut().enumerate() {
            let Some(force_n) = forces.next() else { return };
            let Some(surface_m) = sums.surface_m else { continue };
            sums.ticks += 1;
            sums.ticks_in_contact += u32::from(touches(axis));
            // The force on the device pushes back against the hand.
            if let Some((force, depth_m)) = sums.thirds.get_mut(third) {
                *force -= force_n;
                *depth_m += master.plant.position(axis) - surface_m;
            }
        }
    }

    /// Perceived stiffness per axis, `N/m`; none for an axis that was not in contact all the time, or that
    /// nothing stops.
    #[must_use]
    pub fn per_axis(&self) -> Vec<Option<f64>> {
        let is_in_contact = |sums: &Sums| sums.ticks > 0 && sums.ticks_in_contact == sums.ticks;
        self.axes.iter().map(|sums| is_in_contact(sums).then(|| sums.stiffness_n_per_m())).collect()
    }

    /// Axes whose perceived stiffness was still on its way by more than a thousandth of it, in words.
    pub(super) fn unsettled(&self) -> impl Iterator<Item = String> {
        let per_axis = self.per_axis();
        self.axes.iter().enumerate().filter_map(move |(axis, sums)| {
            let stiffness_n_per_m = per_axis.get(axis).copied().flatten()?;
            let left = sums.left_n_per_m() / stiffness_n_per_m;
            (left.abs() > SETTLED).then(|| {
                let left = if left.is_finite() { format!("about {:.1} %", 100.0 * left) } else { "an unknown part".to_owned() };
                format!(
                    "the perceived stiffness of axis {axis} has not settled: it still has {left} to go; a longer run \
                     (duration_s) or more damping lets it"
                )
            })
        })
    }
}
