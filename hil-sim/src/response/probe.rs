//! Linear loops of a rig at its start: coupled axes and their figures.

use std::collections::{BTreeMap, BTreeSet};

use dimsart_core::types;

use super::build;
use super::closed_loop::{Block, Column, Loop, Reference};
use super::controller_model::{Answer, Controllers, Place};
use super::instrumented::sensed;
use super::machine::Machine;
use super::plant_model::PlantModel;
use crate::experiment::ExperimentError;
use crate::link::InProcessParameters;
use crate::loop_figures::{AxisLoop, LoopFigures};
use crate::observer::following::{FOLLOWS, followed};
use crate::rig_file::part::{ControllerAxes, linked_with};
use crate::rig_file::{DeviceSection, MoveSection, RigFile, Step};

/// A commanded axis.
struct Commanded {
    /// Controller, and index of the axis there.
    at: Place,
    device: usize,
    axis: usize,
}

/// Input of a controller from an axis.
struct Channel {
    at: Place,
    /// Index of the commanded axis.
    command: usize,
    name: &'static str,
    id: u16,
    /// Whether it is measured; otherwise it is a reference.
    is_sensed: bool,
    gain: f64,
    /// Answers by phase of a cycle and by command; `None` if nonlinear.
    answers: Vec<Option<Vec<Option<Answer>>>>,
}

/// Computes the loops of all axes, free and in contact with their walls.
///
/// # Errors
/// As the [experiment](super::Experiment::new)'s.
pub(super) fn loops(file: &RigFile) -> Result<Vec<AxisLoop>, ExperimentError> {
    let free = at_rest(file, false);
    let parts = ControllerAxes::all(&free);
    let mut commanded = Vec::new();
    for (station, part) in parts.iter().enumerate().filter(|(_, part)| part.device.has_actuators()) {
        let device = free.devices.iter().position(|device| device.name == part.device.name);
        for (place, axis) in part.axes.iter().enumerate() {
            let device = device.unwrap_or_default();
            commanded.push(Commanded { at: Place { station, place }, device, axis: *axis });
        }
    }
    let places = commanded.iter().map(|command| command.at).collect();
    let Some(mut controllers) = Controllers::new(&free, places)? else {
        return Ok(commanded
            .iter()
            .map(|command| AxisLoop::unknown(command.at.station, command.at.place))
            .collect());
    };
    let mut channels = channels(&free, &parts, &commanded);
    let free_models = models(&free, &channels, &commanded)?;
    // Excludes nonlinear controllers and devices, and all controllers linked to them.
    let mut not_linear = BTreeSet::new();
    let has_model = |command: &Commanded| matches!(free_models.get(command.device), Some(Some(_)));
    for command in commanded.iter().filter(|command| !has_model(command)) {
        not_linear.extend(linked_with(&free, name_of(&parts, command.at)));
    }
    for channel in &mut channels {
        let name = name_of(&parts, channel.at);
        for phase in 0..controllers.cycle_ticks {
            let answers = match not_linear.contains(name) {
                true => None,
                false => controllers.answers(channel.at, phase)?,
            };
            if answers.is_none() && channel.is_sensed {
                not_linear.extend(linked_with(&free, name));
            }
            channel.answers.push(answers);
        }
    }
    let not_linear = &not_linear;
    let axes = Axes { parts: &parts, commanded: &commanded, channels: &channels, not_linear };
    let (cycle_ticks, period_s) = (controllers.cycle_ticks, free.sample_period_s);
    let free_figures = axes.figures(&free_models, cycle_ticks, period_s);
    let meets = |section: &DeviceSection| section.axes.iter().any(|axis| axis.active_wall().is_some());
    let in_contact = file.devices.iter().any(meets).then(|| at_rest(file, true));
    let in_contact = in_contact.map(|file| models(&file, &channels, &commanded)).transpose()?;
    let in_contact = in_contact.map(|models| axes.figures(&models, cycle_ticks, period_s));
    let figures = |place: usize| AxisLoop {
        free: free_figures.get(place).copied().flatten(),
        in_contact: in_contact.as_ref().and_then(|all| *all.get(place)?),
        ..commanded
            .get(place)
            .map_or_else(AxisLoop::default, |command| AxisLoop::unknown(command.at.station, command.at.place))
    };
    Ok((0..commanded.len()).map(figures).collect())
}

fn name_of<'f>(parts: &[ControllerAxes<'f>], at: Place) -> &'f str {
    parts.get(at.station).map(ControllerAxes::name).unwrap_or_default()
}

/// Measurements and followed references.
fn channels(file: &RigFile, parts: &[ControllerAxes<'_>], commanded: &[Commanded]) -> Vec<Channel> {
    let mut channels = Vec::new();
    for (station, part) in parts.iter().enumerate().filter(|(_, part)| part.device.has_actuators()) {
        for (row, name) in part.device.measures.iter().enumerate() {
            let Some(data_type) = file.data_type(name) else { continue };
            if !RigFile::is_sensed(data_type) && followed(data_type).is_none() {
                continue;
            }
            for (place, section) in part.sections().map(|(_, section)| section).enumerate() {
                let gain = section.sensor.get(name).map_or(1.0, |sensor| sensor.gain);
                let at = Place { station, place };
                let command = commanded.iter().position(|command| command.at == at).unwrap_or_default();
                let at = Place { station, place: row * part.axes.len() + place };
                let (name, id, is_sensed) = (data_type.name, data_type.id, RigFile::is_sensed(data_type));
                channels.push(Channel { at, command, name, id, is_sensed, gain, answers: Vec::new() });
            }
        }
    }
    channels
}

/// Measurements of a device.
fn sensed_of<'a>(
    channels: &'a [Channel],
    commanded: &'a [Commanded],
    device: usize,
) -> impl Iterator<Item = &'a Channel> {
    let is_of = move |channel: &&Channel| {
        commanded.get(channel.command).is_some_and(|command| command.device == device)
    };
    channels.iter().filter(|channel| channel.is_sensed).filter(is_of)
}

/// Models of all devices, from commands to measurements, position and velocity of each axis; `None` if nonlinear.
fn models(
    file: &RigFile,
    channels: &[Channel],
    commanded: &[Commanded],
) -> Result<Vec<Option<PlantModel>>, ExperimentError> {
    let model = |(device, section): (usize, &DeviceSection)| {
        if !section.has_actuators() {
            return Ok(None);
        }
        let mut machine = build::machine(file, section, 1, &[])?;
        let read = |machine: &Machine| {
            let shown = sensed_of(channels, commanded, device).filter_map(|channel| {
                let axis = commanded.get(channel.command)?.axis;
                Some(channel.gain * sensed(file.data_type(channel.name)?, &machine.state(axis)))
            });
            let followed = (0..section.axes.len()).flat_map(|axis| {
                let state = machine.state(axis);
                [state.position, state.velocity]
            });
            shown.chain(followed).collect()
        };
        Ok(PlantModel::new(&mut machine, file.sample_period_s, section.axes.len(), read))
    };
    file.devices.iter().enumerate().map(model).collect()
}

/// All axes, with the answers of their controllers.
struct Axes<'a> {
    parts: &'a [ControllerAxes<'a>],
    commanded: &'a [Commanded],
    channels: &'a [Channel],
    not_linear: &'a BTreeSet<&'a str>,
}

impl Axes<'_> {
    /// Figures by axis; `None` if nonlinear.
    fn figures(
        &self,
        models: &[Option<PlantModel>],
        cycle_ticks: usize,
        period_s: f64,
    ) -> Vec<Option<LoopFigures>> {
        let mut figures = vec![None; self.commanded.len()];
        for (group, is_linear) in self.groups(models) {
            if !is_linear {
                continue;
            }
            let found = self.closed(&group, models, cycle_ticks, period_s).figures();
            for (command, found) in group.iter().zip(found) {
                if let Some(figures) = figures.get_mut(*command) {
                    *figures = found;
                }
            }
        }
        figures
    }

    fn sensed_of(&self, device: usize) -> impl Iterator<Item = &Channel> {
        sensed_of(self.channels, self.commanded, device)
    }

    /// Groups of coupled commands, and whether they are linear.
    fn groups(&self, models: &[Option<PlantModel>]) -> Vec<(Vec<usize>, bool)> {
        let mut group_of: Vec<usize> = (0..self.commanded.len()).collect();
        let is_linear = |command: &Commanded| {
            let has_model = models.get(command.device).is_some_and(Option::is_some);
            has_model && !self.not_linear.contains(name_of(self.parts, command.at))
        };
        let mut join = |one: usize, other: usize| {
            let [from, to] = [one, other].map(|place| group_of.get(place).copied().unwrap_or_default());
            group_of.iter_mut().filter(|group| **group == from).for_each(|group| *group = to);
        };
        for (device, model) in models.iter().enumerate() {
            let of_device = |(_, command): &(usize, &Commanded)| command.device == device;
            let here: Vec<_> = self.commanded.iter().enumerate().filter(of_device).collect();
            let Some(model) = model else { continue };
            for (output, channel) in self.sensed_of(device).enumerate() {
                here.iter()
                    .filter(|(_, command)| model.joins(command.axis, output))
                    .for_each(|(place, _)| join(*place, channel.command));
            }
        }
        for channel in self.channels.iter().filter(|channel| channel.is_sensed) {
            for answers in channel.answers.iter().flatten() {
                let answering = (0..).zip(answers).filter(|(_, answer)| answer.is_some());
                answering.for_each(|(command, _)| join(channel.command, command));
            }
        }
        let mut groups: BTreeMap<usize, (Vec<usize>, bool)> = BTreeMap::new();
        for ((place, group), command) in group_of.into_iter().enumerate().zip(self.commanded) {
            let group = groups.entry(group).or_insert((Vec::new(), true));
            group.0.push(place);
            group.1 &= is_linear(command);
        }
        groups.into_values().collect()
    }

    /// Creates the loop of a group.
    fn closed(
        &self,
        group: &[usize],
        models: &[Option<PlantModel>],
        cycle_ticks: usize,
        period_s: f64,
    ) -> Loop {
        let (mut plants, mut followers) = (Vec::new(), Vec::new());
        let (mut columns, mut outputs) = (Vec::new(), 0);
        let mut references: Vec<Option<Reference>> = group.iter().map(|_| None).collect();
        let of_group = |answers: &Vec<Option<Answer>>| -> Vec<Option<Answer>> {
            group.iter().map(|command| answers.get(*command).cloned().flatten()).collect()
        };
        let mut outputs_of_followers = 0;
        for (device, model) in models.iter().enumerate() {
            let Some(model) = model else { continue };
            let here: Vec<(usize, &Commanded)> = group
                .iter()
                .enumerate()
                .filter_map(|(place, command)| Some((place, self.commanded.get(*command)?)))
                .filter(|(_, command)| command.device == device)
                .collect();
            if here.is_empty() {
                continue;
            }
            let (commands, axes): (Vec<usize>, Vec<usize>) =
                here.iter().map(|(place, command)| (*place, command.axis)).unzip();
            let mut used = Vec::new();
            for (output, channel) in self.sensed_of(device).enumerate() {
                let is_here = group.contains(&channel.command);
                let answered: Vec<(usize, Vec<Option<Answer>>)> = channel
                    .answers
                    .iter()
                    .enumerate()
                    .filter_map(|(phase, answers)| Some((phase, of_group(answers.as_ref()?))))
                    .filter(|(_, answers)| is_here && answers.iter().any(Option::is_some))
                    .collect();
                if answered.is_empty() {
                    continue;
                }
                for (phase, answers) in answered {
                    columns.push(Column { output: outputs + used.len(), phase, answers });
                }
                used.push(output);
            }
            let fed = outputs..outputs + used.len();
            outputs = fed.end;
            let model_of = |outputs: &[usize]| model.reduced(&axes, outputs);
            plants.push(Block { model: model_of(&used), commands: commands.clone(), outputs: fed.collect() });
            let sensed = self.sensed_of(device).count();
            let truths: Vec<usize> =
                axes.iter().flat_map(|axis| [0, 1].map(|of| sensed + 2 * axis + of)).collect();
            for (at, (place, command)) in here.iter().enumerate() {
                let reference = |(known, quantity): (&dimsart_core::DataType, usize)| {
                    let is_it = |channel: &&Channel| {
                        let own = self.commanded.get(channel.command);
                        channel.id == known.id && own.is_some_and(|own| own.at == command.at)
                    };
                    let channel = self.channels.iter().find(is_it)?;
                    let answers: Option<Vec<_>> =
                        channel.answers.iter().map(|answers| Some(of_group(answers.as_ref()?))).collect();
                    let answers = answers.filter(|all| all.iter().flatten().any(Option::is_some))?;
                    Some(Reference { output: outputs_of_followers + 2 * at + quantity, answers })
                };
                if let Some(found) = references.get_mut(*place) {
                    *found = FOLLOWS.into_iter().find_map(reference);
                }
            }
            let behind = outputs_of_followers..outputs_of_followers + truths.len();
            outputs_of_followers = behind.end;
            followers.push(Block { model: model_of(&truths), commands, outputs: behind.collect() });
        }
        Loop { period_s, cycle_ticks, plants, followers, commands: group.len(), columns, references }
    }
}

/// Returns the rig at rest with references at the joints' positions, without nonlinearities (Coulomb friction, gear
/// losses, backlash, stops, sensor resolution and noise) and without random effects on the links.
fn at_rest(file: &RigFile, in_contact: bool) -> RigFile {
    let mut at_rest = file.clone();
    for device in &mut at_rest.devices {
        *device = device.linear(in_contact);
    }
    for link in &mut at_rest.links {
        link.carrier =
            InProcessParameters { delay_ticks: link.carrier.delay_ticks, ..InProcessParameters::default() };
    }
    let moves = file.devices.iter().flat_map(|device| {
        (0..device.axes.len()).map(|axis| MoveSection {
            axis,
            step: Some(Step { at_s: -1.0, amplitude: device.start_position(axis) }),
            ..MoveSection::nothing(&device.name, types::DES_POSITION.name)
        })
    });
    at_rest.experiment.moves = moves.collect();
    at_rest
}
