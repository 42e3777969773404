//! Moves of an experiment by signal, and the tracking observers.

use std::ops::Range;

use dimsart_core::DataType;

use crate::experiment::ExperimentError;
use crate::motion::Motion;
use crate::observer::following::{FOLLOWS, Follow, followed};
use crate::rig_file::part::{ControllerAxes, linked_with};
use crate::rig_file::{ControllerSection, MoveSection, RigFile};

/// Returns all moves of a signal of an axis.
pub(super) fn motions(
    file: &RigFile,
    device: &str,
    axis: usize,
    on: &str,
) -> Result<Vec<Motion>, ExperimentError> {
    made(file, |moved| moved.moves(device, on) && moved.axis == axis)
}

/// Returns all moves of an axis.
fn all_motions(file: &RigFile, device: &str, axis: usize) -> Result<Vec<Motion>, ExperimentError> {
    made(file, |moved| moved.device == device && moved.axis == axis)
}

fn made(file: &RigFile, is_it: impl Fn(&MoveSection) -> bool) -> Result<Vec<Motion>, ExperimentError> {
    let on_it = file.experiment.moves.iter().filter(|moved| is_it(moved));
    let made: Result<Vec<_>, _> = on_it.map(|section| Motion::new(section, &file.folder)).collect();
    Ok(made?.into_iter().flatten().collect())
}

/// Returns the followed references of every axis of a station; empty without moves.
pub(super) fn follows(
    file: &RigFile,
    part: &ControllerAxes<'_>,
    station: usize,
) -> Result<Vec<Follow>, ExperimentError> {
    let (device, mut follows) = (part.device, Vec::new());
    if !device.has_actuators() {
        return Ok(follows);
    }
    let measured: Vec<&DataType> = device.measures.iter().filter_map(|name| file.data_type(name)).collect();
    for (place, (axis, section)) in part.sections().enumerate() {
        let starts_s: Vec<f64> = all_motions(file, &device.name, axis)?.iter().map(Motion::start_s).collect();
        let (kind, place) = (section.unit.kind(), (station, place));
        for reference in measured.iter().copied() {
            let motions = motions(file, &device.name, axis, reference.name)?;
            if let Some((reference, quantity)) = followed(reference).filter(|_| !motions.is_empty()) {
                let unit = reference.unit.symbol(kind);
                follows.push(Follow::new(place, reference, unit, quantity, motions, &starts_s));
            }
        }
        // References can also come from a link or a module.
        for (reference, quantity) in FOLLOWS.iter().filter(|(known, _)| !measured.contains(known)) {
            let unit = reference.unit.symbol(kind);
            follows.push(Follow::new(place, reference, unit, *quantity, Vec::new(), &starts_s));
        }
    }
    Ok(follows)
}

/// Returns the rest phases of all devices, `s`, in order; coupled axes move each other.
pub(super) fn rests_s(file: &RigFile, axis: usize) -> Result<Vec<Range<f64>>, ExperimentError> {
    let is_coupled = |moved: &MoveSection| {
        file.devices.iter().any(|device| device.name == moved.device && device.coupled_axes().is_some())
    };
    rests_between_s(file, |moved| moved.axis == axis || is_coupled(moved))
}

/// Returns the rest phases of a controller's device and linked devices, `s`: the last one and those of at least its
/// length. Empty if they move until the end.
pub(super) fn long_rests_s(
    file: &RigFile,
    part: &ControllerAxes<'_>,
) -> Result<Vec<Range<f64>>, ExperimentError> {
    let linked = linked_with(file, part.name());
    let of_linked = |controller: &&ControllerSection| linked.contains(controller.name());
    let devices: Vec<&str> =
        file.controllers.iter().filter(of_linked).map(|controller| controller.device.as_str()).collect();
    let mut rests_s = rests_between_s(file, |moved| devices.contains(&moved.device.as_str()))?;
    let last_s = rests_s.last().filter(|rest_s| rest_s.end >= file.duration_s);
    let min_s = last_s.map_or(f64::INFINITY, |rest_s| rest_s.end - rest_s.start);
    rests_s.retain(|rest_s| rest_s.end - rest_s.start >= min_s);
    Ok(rests_s)
}

fn rests_between_s(
    file: &RigFile,
    is_of_interest: impl Fn(&MoveSection) -> bool,
) -> Result<Vec<Range<f64>>, ExperimentError> {
    let motions = made(file, |moved| !moved.is_constant() && is_of_interest(moved))?;
    let mut moving_s: Vec<Range<f64>> =
        motions.iter().map(|motion| motion.start_s()..motion.end_s()).collect();
    moving_s.sort_by(|a, b| a.start.total_cmp(&b.start));
    let (mut rests_s, mut rests_from_s) = (Vec::new(), 0.0_f64);
    for Range { start, end } in moving_s {
        rests_s.push(rests_from_s..start.min(file.duration_s));
        rests_from_s = rests_from_s.max(end);
    }
    rests_s.push(rests_from_s..file.duration_s);
    rests_s.retain(|rest_s| rest_s.end > rest_s.start);
    Ok(rests_s)
}
