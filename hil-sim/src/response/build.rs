//! Builds the rig of a file: a station per controller, and their links.

use std::sync::{Arc, Mutex};

use dimsart_core::{AxisKind, CommandError, DataType, DeviceDescriptor, Explanation, InputLimits, types};

use super::axis::Axis;
use super::body::Body;
use super::guards::guard_all;
use super::instrumented::{Instrumented, Output};
use super::machine::Machine;
use super::moves::motions;
use crate::experiment::ExperimentError;
use crate::law::Law;
use crate::link::{Buses, InProcess, Link, Route};
use crate::rig::{Rig, SimulatedDimsart, Station, StationLink};
use crate::rig_file::part::ControllerAxes;
use crate::rig_file::{AxisSection, ControllerSection, DeviceSection, HAND, LOAD, LinkSection, RigFile};
use crate::schemes::{self, LoadReport, SIDES, SchemeText};

/// Odd number with mixed bits, to decorrelate consecutive seeds.
const SPREAD: u64 = 0x9E37_79B9_7F4A_7C15;

/// Builds all devices, controllers and links. `let_go_s`: release times of the pressing hand by axis; empty without a press.
pub(super) fn rig(file: &RigFile, let_go_s: &[f64]) -> Result<Rig, ExperimentError> {
    let mut rig = Rig::new(file.sample_period_s);
    let parts = ControllerAxes::all(file);
    for device in &file.devices {
        let mut of_device = parts.iter().filter(|part| part.device.name == device.name);
        let machine = Arc::new(Mutex::new(machine(file, device, of_device.clone().count(), let_go_s)?));
        of_device.try_for_each(|part| {
            rig.add(station(file, part, Arc::clone(&machine), controller(file, part)?)?);
            Ok::<_, ExperimentError>(())
        })?;
    }
    connect(file, &parts, &mut rig)?;
    guard_all(file, &parts, &mut rig)?;
    Ok(rig)
}

/// Creates the machine of a device with its number of controllers.
pub(super) fn machine(
    file: &RigFile,
    device: &DeviceSection,
    controllers: usize,
    let_go_s: &[f64],
) -> Result<Machine, ExperimentError> {
    let body = Body::new(device, file.sample_period_s, file.seed)?;
    let presses = file.experiment.press.as_ref().is_some_and(|press| press.device == device.name);
    let let_go_s = if presses { let_go_s } else { &[] };
    Ok(Machine::new(body, axes_of(file, device, let_go_s)?, device.delay_ticks, controllers))
}

/// Maximum links over a CAN bus without channels: two controllers with one link in each direction.
const LINKS_WITHOUT_CHANNELS: usize = 2;

fn connect(file: &RigFile, parts: &[ControllerAxes<'_>], rig: &mut Rig) -> Result<(), ExperimentError> {
    let mut buses = Buses::new(&file.buses, file.sample_period_s, file.seed, &file.folder)?;
    let mut taken: Vec<(&str, u16, &str)> = Vec::new();
    for (number, link) in (0..).zip(&file.links) {
        let LinkSection { from, to, from_link, to_link, bus, carrier, .. } = link;
        let end = |name: &str, link: u8| {
            let station = parts.iter().position(|part| part.name() == name).unwrap_or_default();
            StationLink { station, link: link.into() }
        };
        let (start, end) = (end(from, *from_link), end(to, *to_link));
        let behind = InProcess::new(*carrier, file.seed.wrapping_mul(2).wrapping_add(number));
        let connected: Box<dyn Link> = match bus {
            None => Box::new(behind),
            Some(bus) => {
                let receiver = rig.stations().get(end.station);
                let channel = receiver.map_or(0, |station| station.dimsart.receive_channel(end.link));
                if buses.needs_channels(bus) {
                    let over_it = file.links.iter().filter(|link| link.bus.as_ref() == Some(bus)).count();
                    if channel == 0 && over_it != LINKS_WITHOUT_CHANNELS {
                        return Err(ExperimentError::NoChannel { from: from.clone(), to: to.clone() });
                    }
                    if let Some((.., first)) =
                        taken.iter().find(|(known, used, _)| channel > 0 && (*known, *used) == (bus, channel))
                    {
                        let [first, second] = [*first, to].map(ToOwned::to_owned);
                        return Err(ExperimentError::SameChannel { channel, first, second });
                    }
                    taken.push((bus, channel, to));
                }
                let is_forward = start.station < end.station;
                let is_authenticated = link.key_file.is_some();
                let route = Route { bus, from, to, is_forward, channel, number, is_authenticated };
                let over = buses.link(route, behind);
                // Unknown buses were rejected with the file.
                over.unwrap_or_else(|| Box::new(InProcess::new(*carrier, file.seed)))
            }
        };
        rig.connect(start, end, connected);
    }
    Ok(())
}

/// A controller of a rig with the result of loading its scheme.
#[derive(Debug)]
pub struct LoadedController {
    /// Name of the controller.
    pub name: String,
    /// Name of the scheme.
    pub scheme: String,
    /// Controller with the valid rows of its scheme.
    pub dimsart: Box<SimulatedDimsart>,
    /// Errors of the scheme.
    pub loaded: LoadReport,
}

/// Loads the schemes of all controllers of a rig, valid or not.
///
/// # Errors
/// [`ExperimentError`] for an invalid device or an unreadable scheme.
pub fn loaded_controllers(file: &RigFile) -> Result<Vec<LoadedController>, ExperimentError> {
    let of_part = |part: &ControllerAxes<'_>| match loaded_controller(file, part) {
        // Reports the errors of all controllers.
        Err(ExperimentError::SchemeFile(error)) => Ok(LoadedController {
            name: part.name().to_owned(),
            scheme: part.controller.scheme.clone(),
            dimsart: empty_controller(file, part)?,
            loaded: LoadReport { errors: vec![error.to_string()], ..LoadReport::default() },
        }),
        loaded => loaded,
    };
    ControllerAxes::all(file).iter().map(of_part).collect()
}

fn empty_controller(
    file: &RigFile,
    part: &ControllerAxes<'_>,
) -> Result<Box<SimulatedDimsart>, ExperimentError> {
    let mut dimsart = Box::new(SimulatedDimsart::without_device());
    dimsart.connect(descriptor(file, part)?, file.kinds).map_err(ExperimentError::Storage)?;
    Ok(dimsart)
}

fn loaded_controller(file: &RigFile, part: &ControllerAxes<'_>) -> Result<LoadedController, ExperimentError> {
    let mut dimsart = empty_controller(file, part)?;
    let sides: Vec<&str> =
        file.controllers.iter().map(ControllerSection::side).chain(SIDES.iter().copied()).collect();
    for (number, law) in (1..=u8::MAX).zip(&part.controller.laws) {
        let refused = |what| ExperimentError::Law { controller: part.name().to_owned(), what };
        let path = file.folder.join(law);
        for command in Law::read(&path).map_err(refused)?.commands(number) {
            dimsart.command(command).map_err(|error| refused(format!("{law}: {}", told(&dimsart, error))))?;
        }
    }
    let scheme = SchemeText::read_from(&part.controller.scheme, &file.folder)?;
    let mut settings = part.controller.settings();
    for setting in &mut settings {
        let short = file.parameters.iter().find(|parameter| parameter.sets(&setting.key));
        short.into_iter().for_each(|short| short.name.clone_into(&mut setting.key));
    }
    let loaded = schemes::load_for(&scheme, part.controller.side(), &sides, &settings, &mut dimsart);
    Ok(LoadedController { name: part.name().to_owned(), scheme: scheme.name, dimsart, loaded })
}

/// Message of a refusal.
fn told(dimsart: &SimulatedDimsart, error: CommandError) -> String {
    Explanation::for_refusal(dimsart.engine(), error).to_string()
}

/// Creates a controller with a running scheme.
pub(super) fn controller(
    file: &RigFile,
    part: &ControllerAxes<'_>,
) -> Result<Box<SimulatedDimsart>, ExperimentError> {
    let LoadedController { name, scheme, dimsart, loaded } = loaded_controller(file, part)?;
    if !loaded.is_valid() {
        let controller = format!("the {name}");
        return Err(ExperimentError::Scheme { name: scheme, controller, loaded });
    }
    Ok(dimsart)
}

/// Connects a controller to its axes of a machine.
pub(super) fn station(
    file: &RigFile,
    part: &ControllerAxes<'_>,
    machine: Arc<Mutex<Machine>>,
    dimsart: Box<SimulatedDimsart>,
) -> Result<Station, ExperimentError> {
    let ControllerAxes { controller, device, axes } = part;
    let is_pressed = file.experiment.press.is_some();
    let plant =
        Instrumented::new(machine, axes.clone(), outputs_of(file, part)?, device.has_actuators(), is_pressed);
    let mut station = Station::new(part.name(), dimsart, Box::new(plant));
    station.set_ticks_per_step(controller.every_ticks);
    Ok(station)
}

fn descriptor(file: &RigFile, part: &ControllerAxes<'_>) -> Result<DeviceDescriptor, ExperimentError> {
    let kinds: Vec<AxisKind> = part.sections().map(|(_, axis)| part.device.kind(axis)).collect();
    // Descriptors are static, as in the flash of a board.
    let leak = |names: &[String]| -> &'static [&'static DataType] {
        Vec::leak(names.iter().filter_map(|name| file.data_type(name)).collect())
    };
    #[expect(clippy::cast_possible_truncation, reason = "controllers count in f32")]
    let sample_period_s = (f64::from(part.controller.every_ticks) * file.sample_period_s) as f32;
    let (name, device) = (String::leak(part.name().to_owned()), part.device);
    let described =
        DeviceDescriptor::new(name, &kinds, sample_period_s, leak(&device.measures), leak(&device.takes));
    described
        .and_then(|described| described.with_limits(limits(part)))
        .map_err(|error| ExperimentError::Device { device: part.name().to_owned(), error })
}

/// Range and rate of the actuators, by commanded type.
fn limits(part: &ControllerAxes<'_>) -> &'static [&'static [InputLimits]] {
    let of_axis = |axis: &usize| {
        #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
        let [max, rate_per_s] =
            [part.device.max_force(*axis), part.device.actuator(*axis).max_rate].map(|limit| limit as f32);
        let max = max.min(f32::MAX);
        InputLimits { min: -max, max, rate_per_s, ..InputLimits::NONE }
    };
    let of_type = |name: &String| -> &'static [InputLimits] {
        let is_force = name == types::DES_FORCE.name;
        Vec::leak(part.axes.iter().filter(|_| is_force).map(of_axis).collect())
    };
    Vec::leak(part.device.takes.iter().map(of_type).collect())
}

fn axes_of(file: &RigFile, section: &DeviceSection, let_go_s: &[f64]) -> Result<Vec<Axis>, ExperimentError> {
    let axis = |(axis, of_axis): (usize, &AxisSection)| {
        let load = motions(file, &section.name, axis, LOAD)?;
        let hand = motions(file, &section.name, axis, HAND)?;
        let let_go_s = let_go_s.get(axis).copied().unwrap_or(f64::INFINITY);
        Ok(Axis::new(of_axis.clone(), load, hand, let_go_s))
    };
    section.axes.iter().enumerate().map(axis).collect()
}

fn outputs_of(file: &RigFile, part: &ControllerAxes<'_>) -> Result<Vec<Output>, ExperimentError> {
    let device = part.device;
    let output = |name: &String| {
        let data_type = file.data_type(name).unwrap_or(types::SIGNAL);
        if RigFile::is_sensed(data_type) {
            let sensor = |(axis, of_axis): (usize, &AxisSection)| {
                // Each sensor has a different seed.
                let place = u64::from(data_type.id) << 32 | axis as u64;
                let mut parameters = of_axis.sensor.get(name).cloned().unwrap_or_default();
                parameters.seed =
                    file.seed.wrapping_add(parameters.seed).wrapping_add(place).wrapping_mul(SPREAD);
                let place = format!("device '{}', axis {axis}", device.name);
                parameters.build().map_err(|error| ExperimentError::Plant { place, error })
            };
            let sensors: Result<Vec<_>, _> = part.sections().map(sensor).collect();
            return Ok(Output::Sensed(data_type, sensors?));
        }
        let per_axis = part.axes.iter().map(|axis| motions(file, &device.name, *axis, name));
        Ok(Output::Reference(per_axis.collect::<Result<_, _>>()?))
    };
    device.measures.iter().map(output).collect()
}
