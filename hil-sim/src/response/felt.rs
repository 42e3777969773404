//! The hands of a rig file, and what each of them can feel: what the devices at the other end of its links meet.

use std::ops::Range;

use dimsart_core::types;

use super::moves::rests_s;
use crate::experiment::ExperimentError;
use crate::observer::perceived::{Feeling, MIN_DEPTH, Obstacle, Perceived};
use crate::rig::Probe;
use crate::rig_file::part::linked_with;
use crate::rig_file::{Part, RigFile};

/// Every axis of a rig that is held by a hand and whose links lead to something that can be felt. It is observed in the
/// second halves of the times in which nothing moves.
pub(super) fn feeling(file: &RigFile) -> Result<Feeling, ExperimentError> {
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
                let is_met = met.unit == section.unit;
                let obstacle =
                    Obstacle::new(other.name(), Some(station), axis, met.wall.clone(), met.spring.clone());
                obstacle.filter(|_| is_met)
            };
            let obstacles: Vec<Obstacle> = others.filter_map(meets).collect();
            if section.hand_stiffness() > 0.0 && !obstacles.is_empty() {
                let watched_s = rests_s(file, place)?.into_iter().map(half).collect();
                let is_at_tip = part.device.kind(section) != section.unit.kind();
                let command = if is_at_tip { types::DES_TIP_FORCE } else { types::DES_FORCE };
                let force = Probe::new(command.first());
                let (unit, min_depth) = (section.unit.stiffness(), MIN_DEPTH);
                all.push(Perceived {
                    station,
                    axis,
                    unit,
                    force,
                    watched_s,
                    obstacles,
                    min_depth,
                    last: None,
                });
            }
        }
    }
    Ok(Feeling(all))
}
