//! What a hand feels of what the devices at the other end of its links meet.

use std::ops::Range;

use dimsart_core::types;

use super::ResponseError;
use super::moves::rests_s;
use super::outcome::PerceivedStiffness;
use super::part::{Part, linked_with};
use crate::rig::{Probe, Rig, Station};
use crate::rig_file::{AxisSection, RigFile};
use crate::settled_contact::SettledContact;

/// Share of its farthest way that a hand is to be beyond a surface: nearer, friction and rounding are what it feels.
const LEAST_DEPTH: f64 = 0.01;

/// An axis that is held by a hand, and all that can be felt on it.
#[derive(Debug)]
pub(super) struct Perceived {
    station: usize,
    axis: usize,
    unit: &'static str,
    force: Probe,
    /// The second halves of the times in which nothing moves, `s`.
    watched_s: Vec<Range<f64>>,
    obstacles: Vec<Obstacle>,
    /// Of the last time in which something was touched all along: which, and how.
    last: Option<(usize, SettledContact)>,
}

/// A wall or a spring that another device meets on the same axis.
#[derive(Debug)]
struct Obstacle {
    station: usize,
    axis: usize,
    section: AxisSection,
    /// In the time that is looked at now.
    contact: SettledContact,
    /// Of the hand's axis beyond where the force begins; and the farthest it ever was.
    depth: f64,
    farthest: f64,
}

impl Obstacle {
    /// Where its force begins.
    fn surface(&self) -> f64 {
        let spring = self.section.spring.as_ref().map(|spring| spring.rest_position);
        spring.or(self.section.wall.as_ref().map(|wall| wall.position)).unwrap_or_default()
    }

    fn is_touched(&self, station: &Station) -> bool {
        let position = station.plant.position(self.axis);
        self.section.spring.is_some()
            || self.section.wall.as_ref().is_some_and(|wall| wall.depth(position) > 0.0)
    }
}

impl Perceived {
    /// Every axis of a rig that is held by a hand and whose links lead to something that can be felt.
    pub(super) fn of_all(file: &RigFile) -> Result<Vec<Self>, ResponseError> {
        let (parts, mut all) = (Part::of_all(file), Vec::new());
        let half = |rest: Range<f64>| 0.5 * (rest.start + rest.end)..rest.end;
        for (station, part) in parts.iter().enumerate() {
            let linked = linked_with(file, part.name());
            for (axis, (place, section)) in part.sections().enumerate() {
                let others = parts
                    .iter()
                    .enumerate()
                    .filter(|(other, part)| *other != station && linked.contains(part.name()));
                let meets = |(station, other): (usize, &Part<'_>)| {
                    let mut sections = other.sections().enumerate();
                    let (axis, (_, met)) = sections.find(|(_, (other_place, _))| *other_place == place)?;
                    let is_met = met.unit == section.unit && (met.wall.is_some() || met.spring.is_some());
                    let (section, contact) = (met.clone(), SettledContact::default());
                    is_met.then_some(Obstacle { station, axis, section, contact, depth: 0.0, farthest: 0.0 })
                };
                let obstacles: Vec<Obstacle> = others.filter_map(meets).collect();
                if section.hand_stiffness() > 0.0 && !obstacles.is_empty() {
                    let watched_s = rests_s(file, place)?.into_iter().map(half).collect();
                    let is_at_tip = part.device.kind(section) != section.unit.kind();
                    let command = if is_at_tip { types::DES_TIP_FORCE } else { types::DES_FORCE };
                    let force = Probe::new(command.first());
                    let unit = section.unit.stiffness();
                    all.push(Self { station, axis, unit, force, watched_s, obstacles, last: None });
                }
            }
        }
        Ok(all)
    }

    /// Looks at the present tick.
    pub(super) fn add(&mut self, rig: &Rig) {
        let Some(hand) = rig.stations().get(self.station) else { return };
        let position = hand.plant.position(self.axis);
        for obstacle in &mut self.obstacles {
            obstacle.depth = position - obstacle.surface();
            obstacle.farthest = obstacle.farthest.max(obstacle.depth.abs());
        }
        let time_s = rig.time_s();
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
            let is_touched = rig.stations().get(obstacle.station).is_some_and(|met| obstacle.is_touched(met));
            // The force on the device pushes back against the hand.
            obstacle.contact.add(share, is_touched, -force, obstacle.depth);
        }
    }

    /// Of all that was touched all along, what the hand met first: it has gone farthest beyond it.
    fn held(&mut self) -> Option<(usize, SettledContact)> {
        let contacts = self.obstacles.iter_mut().enumerate().map(|(place, obstacle)| {
            let is_pressed = obstacle.depth.abs() > LEAST_DEPTH * obstacle.farthest;
            (obstacle.depth.abs(), place, core::mem::take(&mut obstacle.contact), is_pressed)
        });
        let held = contacts.filter(|(.., contact, is_pressed)| *is_pressed && contact.stiffness().is_some());
        held.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place, contact, _)| (place, contact))
    }

    /// What came of it; none when nothing was touched while everything stood still. To be asked once.
    pub(super) fn outcome(&mut self, rig: &Rig) -> Option<PerceivedStiffness> {
        let is_over = |watched_s: &Range<f64>| rig.time_s() >= watched_s.end - 0.5 * rig.period_s();
        let last = if self.watched_s.first().is_some_and(is_over) { self.held() } else { None };
        let (place, contact) = last.or(self.last.take())?;
        let name =
            |station: usize| rig.stations().get(station).map_or_else(String::new, |of| of.name.clone());
        let obstacle = self.obstacles.get(place)?;
        Some(PerceivedStiffness {
            device: name(self.station),
            axis: self.axis,
            met_by: name(obstacle.station),
            unit: self.unit,
            stiffness: contact.stiffness()?,
            unsettled: contact.unsettled(),
        })
    }
}
