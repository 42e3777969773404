//! Hands of a rig file, and the environments they can perceive through links.

use std::ops::Range;

use dimsart_core::types;

use super::moves::rests_s;
use super::press::Planned;
use crate::experiment::ExperimentError;
use crate::observer::perceived::{Feeling, MIN_DEPTH, Obstacle, Perceived};
use crate::rig::Probe;
use crate::rig_file::part::linked_with;
use crate::rig_file::{ControllerAxes, RigFile};

/// Returns every axis with a hand and a linked environment. It is observed in the second half of each phase at rest;
/// in a press, in the settled contact of the pressed axes.
pub(super) fn feeling(
    file: &RigFile,
    press: Option<&Planned>,
    alone: Option<&str>,
) -> Result<Feeling, ExperimentError> {
    let (parts, mut all) = (ControllerAxes::all(file), Vec::new());
    let presses = file.press_pair().map(|[hand, _]| hand.name());
    let half = |rest: Range<f64>| 0.5 * (rest.start + rest.end)..rest.end;
    for (station, part) in parts.iter().enumerate() {
        let linked = linked_with(file, part.name());
        for (axis, (place, section)) in part.sections().enumerate() {
            let others = parts
                .iter()
                .enumerate()
                .filter(|(other, part)| *other != station && linked.contains(part.name()));
            let meets = |(station, other): (usize, &ControllerAxes<'_>)| {
                let mut sections = other.sections().enumerate();
                let (axis, (_, met)) = sections.find(|(_, (other_place, _))| *other_place == place)?;
                let is_met = met.unit == section.unit;
                let station = Some(station).filter(|_| alone.is_none());
                let spring = met.active_spring().filter(|spring| spring.stiffness > 0.0).cloned();
                let obstacle = Obstacle::new(other.name(), station, axis, met.active_wall().cloned(), spring);
                obstacle.filter(|_| is_met)
            };
            let obstacles: Vec<Obstacle> = others.filter_map(meets).collect();
            let is_pressed = press.as_ref().map(|press| {
                let force_n = press.forces_n.get(place).copied().unwrap_or(0.0);
                presses == Some(part.name()) && force_n.abs() > 0.0
            });
            let station = match alone {
                Some(name) if name != part.name() => continue,
                Some(_) => 0,
                None => station,
            };
            if is_pressed.unwrap_or(section.hand_stiffness() > 0.0) && !obstacles.is_empty() {
                let watched_s = match press {
                    Some(press) => vec![press.phases.settled_s..press.phases.release_s.min(file.duration_s)],
                    None => rests_s(file, place)?.into_iter().map(half).collect(),
                };
                let is_at_tip = part.device.kind(section) != section.unit.kind();
                let command = if is_at_tip { types::DES_TIP_FORCE } else { types::DES_FORCE };
                let force = Probe::new(command.first());
                let (unit, min_depth) =
                    (section.unit.stiffness(), if press.is_some() { 0.0 } else { MIN_DEPTH });
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
