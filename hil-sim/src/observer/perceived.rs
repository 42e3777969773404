//! Perceived stiffness of the environments of linked devices.

use core::ops::{ControlFlow, Range};

use serde::Serialize;

use super::Observer;
use super::settled_contact::SettledContact;
use crate::outcome::Outcome;
use crate::rig::{Probe, Rig, Station};
use crate::rig_file::{AxisSpring, AxisWall};

/// Default minimum share of the hand's maximum penetration; below, friction and rounding dominate.
pub(crate) const MIN_DEPTH: f64 = 0.01;

/// Stiffness perceived by a hand in its last static contact: force on the hand divided by its distance beyond the
/// surface of the obstacle, or beyond the spring's rest position; of several obstacles, the first one touched.
/// Positions of both ends are assumed equal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PerceivedStiffness {
    /// The device with the hand.
    pub device: String,
    /// The axis, from 0.
    pub axis: usize,
    /// Device at the obstacle.
    pub met_by: String,
    /// `N/m` or `N m/rad`.
    pub unit: &'static str,
    /// Perceived stiffness.
    pub stiffness: f64,
    /// Reason if the stiffness has not settled; `None` if settled.
    pub unsettled: Option<String>,
}

/// An axis with a hand, and its possible obstacles.
#[derive(Debug)]
pub(crate) struct Perceived {
    pub(crate) station: usize,
    pub(crate) axis: usize,
    pub(crate) unit: &'static str,
    /// Command of its controller.
    pub(crate) force: Probe,
    /// Observed times, `s`.
    pub(crate) watched_s: Vec<Range<f64>>,
    pub(crate) obstacles: Vec<Obstacle>,
    /// Minimum share of the hand's maximum penetration.
    pub(crate) min_depth: f64,
    /// Obstacle and contact of the last phase with continuous contact.
    pub(crate) last: Option<(usize, SettledContact)>,
}

/// Wall or spring of another device on the same axis.
#[derive(Debug)]
pub(crate) struct Obstacle {
    /// Device; a device outside this rig is assumed to be in contact.
    name: String,
    station: Option<usize>,
    axis: usize,
    wall: Option<AxisWall>,
    spring: Option<AxisSpring>,
    /// In the present phase.
    contact: SettledContact,
    /// Penetration of the hand's axis, and its maximum.
    depth: f64,
    farthest: f64,
}

impl Obstacle {
    /// Creates the obstacle of a device's axis, by name, and station if it is in the rig; `None` without wall and
    /// spring.
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

    /// Position at which its force starts.
    fn surface(&self) -> f64 {
        let spring = self.spring.as_ref().map(|spring| spring.rest_position);
        spring.or(self.wall.as_ref().map(|wall| wall.position)).unwrap_or_default()
    }

    fn is_touched(&self, station: &Station) -> bool {
        let position = station.plant.position(self.axis);
        self.spring.is_some() || self.wall.as_ref().is_some_and(|wall| wall.penetration_depth(position) > 0.0)
    }
}

/// All axes with a hand and an obstacle.
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
    /// Observes the present tick.
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
            // The force on the device opposes the hand.
            obstacle.contact.add(share, is_touched, -force, obstacle.depth);
        }
    }

    /// Obstacle in continuous contact with the largest penetration, which was touched first.
    fn held(&mut self) -> Option<(usize, SettledContact)> {
        let contacts = self.obstacles.iter_mut().enumerate().map(|(place, obstacle)| {
            let is_pressed = obstacle.depth.abs() > self.min_depth * obstacle.farthest;
            (obstacle.depth.abs(), place, core::mem::take(&mut obstacle.contact), is_pressed)
        });
        let held = contacts.filter(|(.., contact, is_pressed)| *is_pressed && contact.stiffness().is_some());
        held.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place, contact, _)| (place, contact))
    }

    /// Returns the perceived stiffness; `None` without a static contact. Call once.
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
