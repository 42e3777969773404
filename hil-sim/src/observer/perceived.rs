//! What a hand feels of what the devices at the other end of its links meet.

use core::ops::{ControlFlow, Range};

use serde::Serialize;

use super::Observer;
use super::settled_contact::SettledContact;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};
use crate::rig_file::{AxisSpring, AxisWall};

/// The usual share of its farthest way that a hand is to be beyond a surface: nearer, it feels friction and rounding.
pub(crate) const MIN_DEPTH: f64 = 0.01;

/// What a hand felt the last time it held something against an obstacle while nothing moved: force of the device on it over
/// how far it was beyond the obstacle's surface, or its spring's rest. Of several that were met, from the first one on;
/// positions are taken to be the same at both ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PerceivedStiffness {
    /// The device with the hand.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// The device that met the obstacle.
    pub met_by: String,
    /// `N/m` or `N m/rad`.
    pub unit: &'static str,
    /// How stiff it feels.
    pub stiffness: f64,
    /// Why the figure is not to be believed, in words: it was still on its way. None when it had settled.
    pub unsettled: Option<String>,
}

/// An axis that is held by a hand, and all that can be felt on it.
#[derive(Debug)]
pub(crate) struct Perceived {
    pub(crate) station: usize,
    pub(crate) axis: usize,
    pub(crate) unit: &'static str,
    /// What its controller commands.
    pub(crate) force: Probe,
    /// When it is observed, `s`.
    pub(crate) watched_s: Vec<Range<f64>>,
    pub(crate) obstacles: Vec<Obstacle>,
    /// Share of its farthest way that the hand is to be beyond a surface.
    pub(crate) min_depth: f64,
    /// Of the last time in which something was touched all along: which, and how.
    pub(crate) last: Option<(usize, SettledContact)>,
}

/// A wall or a spring that another device meets on the same axis.
#[derive(Debug)]
pub(crate) struct Obstacle {
    /// The device; one that is not in this rig is taken to touch it.
    name: String,
    station: Option<usize>,
    axis: usize,
    wall: Option<AxisWall>,
    spring: Option<AxisSpring>,
    /// In the time that is looked at now.
    contact: SettledContact,
    /// Of the hand's axis beyond where the force begins; and the farthest it ever was.
    depth: f64,
    farthest: f64,
}

impl Obstacle {
    /// Of the axis of a device, by its name, and its station if it is in the rig; none where it meets nothing.
    pub(crate) fn new(
        name: &str,
        station: Option<usize>,
        axis: usize,
        wall: Option<AxisWall>,
        spring: Option<AxisSpring>,
    ) -> Option<Self> {
        let (name, contact) = (name.to_owned(), SettledContact::default());
        let is_there = wall.is_some() || spring.is_some();
        is_there.then_some(Self { name, station, axis, wall, spring, contact, depth: 0.0, farthest: 0.0 })
    }

    /// Where its force begins.
    fn surface(&self) -> f64 {
        let spring = self.spring.as_ref().map(|spring| spring.rest_position);
        spring.or(self.wall.as_ref().map(|wall| wall.position)).unwrap_or_default()
    }

    fn is_touched(&self, station: &Station) -> bool {
        let position = station.plant.position(self.axis);
        self.spring.is_some() || self.wall.as_ref().is_some_and(|wall| wall.depth(position) > 0.0)
    }
}

/// All axes whose hands can feel something.
#[derive(Debug)]
pub(crate) struct Feeling(pub(crate) Vec<Perceived>);

impl Observer for Feeling {
    fn observe(&mut self, rig: &Rig) -> ControlFlow<()> {
        self.0.iter_mut().for_each(|axis| axis.add(rig));
        ControlFlow::Continue(())
    }

    fn report(&mut self, rig: &Rig, outcome: &mut Outcome) {
        outcome.perceived = self.0.iter_mut().filter_map(|axis| axis.outcome(rig)).collect();
    }
}

impl Perceived {
    /// Looks at the present tick.
    fn add(&mut self, rig: &Rig) {
        let Some(hand) = rig.stations().get(self.station) else { return };
        let time_s = rig.time_s();
        let is_watched = self.watched_s.first().is_some_and(|watched_s| time_s >= watched_s.start);
        if !is_watched && self.min_depth <= 0.0 {
            return;
        }
        let position = hand.plant.position(self.axis);
        for obstacle in &mut self.obstacles {
            obstacle.depth = position - obstacle.surface();
            obstacle.farthest = obstacle.farthest.max(obstacle.depth.abs());
        }
        let Some(watched_s) = self.watched_s.first().filter(|watched_s| time_s >= watched_s.start) else {
            return;
        };
        if time_s >= watched_s.end {
            self.watched_s.remove(0);
            self.last = self.held().or(self.last.take());
            return;
        }
        let share = (time_s - watched_s.start) / (watched_s.end - watched_s.start);
        let Some(force) = self.force.values(hand).nth(self.axis) else { return };
        for obstacle in &mut self.obstacles {
            let station = obstacle.station.and_then(|station| rig.stations().get(station));
            let is_touched = station.is_none_or(|met| obstacle.is_touched(met));
            // The force on the device pushes back against the hand.
            obstacle.contact.add(share, is_touched, -force, obstacle.depth);
        }
    }

    /// Of all that was touched all along, what the hand met first: it has gone farthest beyond it.
    fn held(&mut self) -> Option<(usize, SettledContact)> {
        let contacts = self.obstacles.iter_mut().enumerate().map(|(place, obstacle)| {
            let is_pressed = obstacle.depth.abs() > self.min_depth * obstacle.farthest;
            (obstacle.depth.abs(), place, core::mem::take(&mut obstacle.contact), is_pressed)
        });
        let held = contacts.filter(|(.., contact, is_pressed)| *is_pressed && contact.stiffness().is_some());
        held.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place, contact, _)| (place, contact))
    }

    /// What came of it; none when nothing was touched while everything stood still. To be asked once.
    fn outcome(&mut self, rig: &Rig) -> Option<PerceivedStiffness> {
        let is_over = |watched_s: &Range<f64>| rig.time_s() >= watched_s.end - 0.5 * rig.period_s();
        let last = if self.watched_s.first().is_some_and(is_over) { self.held() } else { None };
        let (place, contact) = last.or(self.last.take())?;
        let obstacle = self.obstacles.get(place)?;
        Some(PerceivedStiffness {
            device: rig.stations().get(self.station)?.name.clone(),
            axis: self.axis,
            met_by: obstacle.name.clone(),
            unit: self.unit,
            stiffness: contact.stiffness()?,
            unsettled: contact.unsettled(),
        })
    }
}
