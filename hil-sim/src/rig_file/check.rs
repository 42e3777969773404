//! Checks a rig file for invalid values and combinations; reports all of them, one line each.

use dimsart_core::{DataType, Format, Shape, limits, types};

use super::set::Setting;
use super::{
    ActuatorSection, AxisSection, AxisUnit, BusSection, DeviceSection, HAND, LOAD, LinkSection, MoveSection,
    PressSection, RigFile, TypeSection, WatchSection,
};
use crate::link::InProcessParameters;
use crate::plant::{JointParameters, ParameterError, valid_axes};
use crate::rig::SIZES;
use crate::schemes::suggestion;

/// Longest delay of a device, ticks.
const MAX_DELAY_TICKS: f64 = 3.0;
/// Largest integer that JSON represents exactly.
const MAX_SEED: u64 = (1 << 53) - 1;
/// Maximum ticks of the rig per tick of a controller.
const MAX_EVERY_TICKS: u32 = 1000;
/// Signals that a device has sensors for.
pub(super) const SENSED: [&DataType; 10] = [
    types::POSITION,
    types::VELOCITY,
    types::FORCE,
    types::MOTOR_CURRENT,
    types::MOTOR_VOLTAGE,
    types::WINDING_TEMPERATURE,
    types::MEASURED_TORQUE,
    types::BUS_VOLTAGE,
    types::TEMPERATURE,
    types::DRIVE_FAULT,
];
/// Signals of its motor.
const OF_MOTOR: [&DataType; 3] = [types::MOTOR_CURRENT, types::MOTOR_VOLTAGE, types::WINDING_TEMPERATURE];

/// Signals that a drive on a bus reports in place of sensors.
const OF_DRIVE: [&DataType; 6] = [
    types::POSITION,
    types::VELOCITY,
    types::MEASURED_TORQUE,
    types::BUS_VOLTAGE,
    types::TEMPERATURE,
    types::DRIVE_FAULT,
];

/// Whether it is valid in the names of columns and files.
fn is_name(name: &str) -> bool {
    let is_allowed = |letter: char| letter.is_alphanumeric() || ['_', '-'].contains(&letter);
    !name.is_empty() && name.chars().all(is_allowed) && name != "world"
}

fn no_name(name: &str) -> String {
    format!("invalid name '{name}': use letters, digits, _ and - only; 'world' is reserved")
}

impl RigFile {
    pub(super) fn problems(&self) -> Vec<String> {
        let mut problems = Vec::new();
        if self.duration_s.is_infinite() && self.experiment.press.is_none() {
            problems.push("`duration_s` is missing: set it to a number > 0, in s".to_owned());
        } else if self.duration_s.is_nan() || self.duration_s <= 0.0 {
            problems.push(format!("duration_s is {} s, must be > 0 s", self.duration_s));
        }
        self.check_press(&mut problems);
        if self.seed > MAX_SEED {
            problems.push(format!("seed is {}, must be 0 to {MAX_SEED}", self.seed));
        }
        if !(1e-5..=0.1).contains(&self.sample_period_s) {
            problems
                .push(format!("sample_period_s is {} s, must be 0.00001 s to 0.1 s", self.sample_period_s));
        }
        if self.record.every_ticks == 0 {
            problems.push("record.every_ticks is 0, must be 1 or more".to_owned());
        }
        if self.devices.is_empty() {
            problems.push("no device: add a [[device]]".to_owned());
        }
        for (place, device) in self.devices.iter().enumerate() {
            self.check_device(place, device, &mut problems);
        }
        for (place, controller) in self.controllers.iter().enumerate() {
            self.has_device("controller", &controller.device, &mut problems);
            if self.controllers.iter().take(place).any(|other| other.name() == controller.name()) {
                let name = controller.name();
                problems.push(format!("duplicate controller '{name}': give each controller a unique `name`"));
            }
            if !is_name(controller.name()) && controller.name() != controller.device {
                problems.push(format!("controller {place}: {}", no_name(controller.name())));
            }
            if !(1..=MAX_EVERY_TICKS).contains(&controller.every_ticks) {
                let (name, every) = (controller.name(), controller.every_ticks);
                problems.push(format!(
                    "controller '{name}': every_ticks is {every}, must be 1 to {MAX_EVERY_TICKS}"
                ));
            }
        }
        problems.extend(self.types.iter().filter_map(TypeSection::problem));
        problems.extend(self.buses.iter().flat_map(BusSection::problems));
        for link in &self.links {
            self.check_link(link, &mut problems);
        }
        for (place, moved) in self.experiment.moves.iter().enumerate() {
            let at = format!("experiment.move {place}");
            if self.has_device(&at, &moved.device, &mut problems) {
                self.check_move(&at, moved, &mut problems);
            }
        }
        problems
    }

    fn check_press(&self, problems: &mut Vec<String>) {
        let Some(PressSection { device, path, force }) = &self.experiment.press else { return };
        let at = "experiment.press";
        if self.has_device(at, device, problems) {
            let is_held = |device: &DeviceSection| device.axes.iter().all(|axis| axis.hand.is_some());
            if !self.device(device).is_some_and(is_held) {
                problems.push(format!("{at}: an axis of '{device}' has no hand: add `hand` to every axis"));
            }
            if self.press_pair().is_none() {
                problems.push(format!("{at}: '{device}' has no link to the pressing device: add a [[link]]"));
            }
        }
        if !(path.is_finite() && force.iter().all(|force| force.is_finite())) {
            problems.push(format!("{at}: path and force must be finite"));
        }
    }

    /// Reports forces of the press that were set for nonexistent axes.
    pub(super) fn surplus_forces(&self, settings: &[Setting]) -> Option<String> {
        let PressSection { device, force, .. } = self.experiment.press.as_ref()?;
        let axes = self.device(device)?.axes.len();
        let is_it = |key: &String| key == "experiment.press.force";
        let sets_it = |setting: &&Setting| {
            is_it(&setting.key)
                || self.parameter(&setting.key).is_some_and(|found| found.keys.iter().any(is_it))
        };
        let set = settings.iter().find(sets_it).filter(|_| force.len() > axes)?;
        let (name, count) = (&set.key, force.len());
        Some(format!("{name} has {count} values for {axes} axes: write one value per axis, or increase dof"))
    }

    fn names(&self) -> Vec<String> {
        self.devices.iter().map(|device| device.name.clone()).collect()
    }

    fn has_device(&self, at: &str, name: &str, problems: &mut Vec<String>) -> bool {
        let is_there = self.device(name).is_some();
        if !is_there {
            let near = suggestion(name, &self.names());
            problems.push(format!("{at}: unknown device '{name}'; {near}"));
        }
        is_there
    }

    fn check_device(&self, place: usize, device: &DeviceSection, problems: &mut Vec<String>) {
        let DeviceSection { name, measures, takes, delay_ticks, position_limit, force_limit, axes, .. } =
            device;
        if !is_name(name) {
            problems.push(format!("device {place}: {}", no_name(name)));
        }
        if self.devices.iter().take(place).any(|other| other.name == *name) {
            problems.push(format!("duplicate device '{name}': give each device a unique name"));
        }
        self.check_controllers(device, problems);
        check_coupled(device, problems);
        check_drives(device, problems);
        if !(1..=limits::MAX_DOF).contains(&axes.len()) {
            let most = limits::MAX_DOF;
            problems.push(format!("device '{name}' has {} axes, must have 1 to {most}", axes.len()));
        }
        if !(0.0..=MAX_DELAY_TICKS).contains(delay_ticks) {
            problems.push(format!(
                "device '{name}': delay_ticks is {delay_ticks}, must be 0 to {MAX_DELAY_TICKS}"
            ));
        }
        if let Some(WatchSection { position, force, wave }) = &device.watch {
            for (key, limit) in [("position", position), ("force", force), ("wave", wave)] {
                if limit.is_nan() || *limit <= 0.0 {
                    problems.push(format!("device '{name}': watch.{key} is {limit}, must be > 0"));
                }
            }
        }
        for (key, limit) in [("position_limit", position_limit), ("force_limit", force_limit)] {
            if !(limit.is_finite() && *limit > 0.0) {
                problems.push(format!("device '{name}': {key} is {limit}, must be finite and > 0"));
            }
        }
        for signal in measures {
            let Some(data_type) = self.vector(name, signal, problems) else { continue };
            let is_moved = self.experiment.moves.iter().any(|moved| moved.moves(name, signal));
            if !SENSED.contains(&data_type) && !is_moved {
                let sensed: Vec<&str> = SENSED.iter().map(|data_type| data_type.name).collect();
                problems.push(format!(
                    "device '{name}' measures {signal}, which has no sensor and no [[experiment.move]]: add an \
                    [[experiment.move]] on this signal; signals with a sensor: {}",
                    sensed.join(", ")
                ));
            }
        }
        if device.has_actuators() && takes.as_slice() != [types::DES_FORCE.name] {
            problems.push(format!(
                "device '{name}': takes is {takes:?}, must be [\"DES_FORCE\"], or [] for a device that does not move"
            ));
        }
        if let Some(leads) = &device.leads {
            let can_follow = |led: &DeviceSection| led.has_actuators() && led.axes.len() >= axes.len();
            if device.has_actuators() || !self.device(leads).is_some_and(can_follow) {
                problems.push(format!(
                    "device '{name}' cannot lead '{leads}': only a device with takes = [] can lead, and \
                    '{leads}' must move and have at least as many axes"
                ));
            }
        }
        for (axis, section) in axes.iter().enumerate() {
            let at = format!("device '{name}', axis {axis}");
            if device.has_actuators() && device.coupled_axes().is_none() && section.plant.is_none() {
                problems.push(format!("{at}: missing plant: set at least plant.load.inertia"));
            }
            check_axis(&at, measures, section, problems);
            let of_motor =
                OF_MOTOR.iter().find(|data_type| measures.iter().any(|name| name == data_type.name));
            if let Some(data_type) = of_motor
                && !section.plant.as_ref().is_some_and(|plant| plant.motor.has_winding())
            {
                problems.push(format!(
                    "{at}: measures {} without a motor: set plant.motor.kind to \"brushed\" or \"three_phase\"",
                    data_type.name
                ));
            }
        }
    }

    /// Checks that every axis of a device has one controller.
    fn check_controllers(&self, device: &DeviceSection, problems: &mut Vec<String>) {
        let (name, count) = (&device.name, device.axes.len());
        let its = self.controllers.iter().filter(|controller| controller.device == *name);
        let axes: Vec<usize> = its.flat_map(|controller| controller.axes(device)).collect();
        for axis in axes.iter().filter(|axis| **axis >= count) {
            problems.push(format!("a controller uses axis {axis} of '{name}', but {}", valid_axes(count)));
        }
        for axis in 0..count {
            let controllers = axes.iter().filter(|known| **known == axis).count();
            if controllers != 1 {
                problems.push(format!(
                    "axis {axis} of '{name}' has {controllers} controllers, must have exactly one: set `axes` \
                    of each [[controller]]"
                ));
            }
        }
    }

    /// Finds a type by name that has one `f32` per axis.
    fn vector(&self, device: &str, name: &str, problems: &mut Vec<String>) -> Option<&'static DataType> {
        let is_vector = |data_type: &&'static DataType| {
            data_type.format == Format::F32 && data_type.shape == Shape::Vector
        };
        let found = self.data_type(name).filter(is_vector);
        if found.is_none() {
            let known = types::ALL.iter().filter(is_vector).map(|data_type| data_type.name.to_owned());
            let known: Vec<String> = known.chain(self.types.iter().map(|own| own.name.clone())).collect();
            let near = suggestion(name, &known);
            problems.push(format!("device '{device}' measures unknown data type '{name}'; {near}"));
        }
        found
    }

    fn check_link(&self, link: &LinkSection, problems: &mut Vec<String>) {
        let known: Vec<String> =
            self.controllers.iter().map(|controller| controller.name().to_owned()).collect();
        for name in [&link.from, &link.to].into_iter().filter(|name| !known.contains(name)) {
            let near = suggestion(name, &known);
            problems.push(format!("link: unknown controller '{name}'; {near}"));
        }
        let buses: Vec<String> = self.buses.iter().map(|bus| bus.name.clone()).collect();
        for name in link.bus.iter().filter(|name| !buses.contains(name)) {
            let near = suggestion(name, &buses);
            problems.push(format!("link from '{}': unknown bus '{name}'; {near}", link.from));
        }
        for number in [link.from_link, link.to_link] {
            if usize::from(number) >= SIZES.links {
                problems.push(format!(
                    "link {number} is out of range: a controller has {} links, numbered from \
                0",
                    SIZES.links
                ));
            }
        }
        let InProcessParameters { loss, duplication, reordering, .. } = link.carrier;
        for (key, share) in [("loss", loss), ("duplication", duplication), ("reordering", reordering)] {
            if !(0.0..=1.0).contains(&share) {
                problems.push(format!("link from '{}': {key} is {share}, must be 0 to 1", link.from));
            }
        }
    }

    fn check_move(&self, at: &str, moved: &MoveSection, problems: &mut Vec<String>) {
        let Some(device) = self.device(&moved.device) else { return };
        if moved.axis >= device.axes.len() {
            let (axis, count) = (moved.axis, device.axes.len());
            problems.push(format!(
                "{at}: axis {axis} of '{}' is out of range: {}",
                device.name,
                valid_axes(count)
            ));
        }
        let sensed = SENSED.map(|data_type| data_type.name);
        let references: Vec<String> =
            device.measures.iter().filter(|signal| !sensed.contains(&signal.as_str())).cloned().collect();
        if moved.on == HAND {
            let section = device.axes.get(moved.axis);
            if section.is_some_and(|axis| axis.hand_stiffness() <= 0.0) {
                problems.push(format!(
                    "{at}: axis {} of '{}' has no hand with a stiffness: add `hand = {{ inertia, damping, \
                    stiffness }}`",
                    moved.axis, device.name
                ));
            }
        } else if moved.on != LOAD && !references.contains(&moved.on) {
            let known: Vec<String> = references.into_iter().chain([LOAD, HAND].map(str::to_owned)).collect();
            let near = suggestion(&moved.on, &known);
            problems.push(format!(
                "{at}: the device '{}' has no reference '{}': add the reference to the device's `measures`; {near}",
                device.name, moved.on
            ));
        }
        problems.extend(moved.problems().into_iter().map(|problem| format!("{at}: {problem}")));
    }
}

/// Checks drives on a bus, and that the device measures only signals that they report.
fn check_drives(device: &DeviceSection, problems: &mut Vec<String>) {
    let name = &device.name;
    let measured = |data_type: &&DataType| device.measures.iter().any(|name| name == data_type.name);
    let axes = device.axes.len();
    let of_moteus = device.moteus.as_ref().map(|moteus| ("moteus", moteus.problems(axes)));
    let of_cia402 = device.cia402.as_ref().map(|cia402| ("cia402", cia402.problems(axes)));
    let Some((kind, wrong)) = of_moteus.or(of_cia402) else {
        // Signals that sensors measure as well are checked with the sensors.
        for data_type in OF_DRIVE.into_iter().skip(2).filter(measured) {
            problems.push(format!(
                "device '{name}' measures {} but has no drives: add [device.moteus] or [device.cia402]",
                data_type.name
            ));
        }
        return;
    };
    problems.extend(wrong.into_iter().map(|problem| format!("device '{name}': {kind}: {problem}")));
    if device.coupled_axes().is_some() {
        problems.push(format!("device '{name}' has both coupled axes and {kind} drives: keep one of them"));
    }
    if device.moteus.is_some() && device.cia402.is_some() {
        problems.push(format!("device '{name}' has both moteus and cia402 drives: keep one of them"));
    }
    if device.delay_ticks > 0.0 {
        problems.push(format!(
            "device '{name}': delay_ticks is not allowed with drives, whose bus sets the \
        delay: remove `delay_ticks`"
        ));
    }
    if device.axes.iter().any(|axis| axis.unit != AxisUnit::Radian) {
        problems.push(format!("device '{name}': drives are rotary: set the unit of every axis to \"rad\""));
    }
    let is_silent = |data_type: &&DataType| {
        !OF_DRIVE.contains(data_type) || device.cia402.is_some() && data_type.id == types::TEMPERATURE.id
    };
    let silent = SENSED.into_iter().filter(is_silent);
    for data_type in silent.filter(measured) {
        problems.push(format!("device '{name}' measures {}, which its drives do not report", data_type.name));
    }
}

/// Checks an arm or a `PHANToM`, and that its axes have no plants of their own.
fn check_coupled(device: &DeviceSection, problems: &mut Vec<String>) {
    let Some(count) = device.coupled_axes() else { return };
    let name = &device.name;
    if device.arm.is_some() && device.phantom.is_some() {
        problems.push(format!("device '{name}' has both arm and phantom: keep one of them"));
    }
    if device.axes.len() != count {
        problems.push(format!(
            "device '{name}' has {count} coupled axes but {} [[device.axis]] entries: give \
        one per axis, or remove all",
            device.axes.len()
        ));
    }
    for (axis, _) in device.axes.iter().enumerate().filter(|(_, section)| section.plant.is_some()) {
        problems.push(format!(
            "device '{name}', axis {axis}: a coupled axis cannot have a plant: remove `plant`"
        ));
    }
    let of_arm = device.arm.as_ref().map(|arm| arm.check().map_err(|error| error.with_path_prefix("arm")));
    let of_phantom = device
        .phantom
        .as_ref()
        .map(|phantom| phantom.check().map_err(|error| error.with_path_prefix("phantom")));
    for error in of_arm.into_iter().chain(of_phantom).filter_map(Result::err) {
        let ParameterError { path, value, allowed } = error;
        problems.push(format!("device '{name}': {path} is {value}, must be {allowed}"));
    }
    let hands: Vec<f64> =
        device.axes.iter().map(|axis| axis.hand.as_ref().map_or(0.0, |hand| hand.inertia)).collect();
    let is_one_mass =
        hands.windows(2).all(|pair| matches!(pair, [one, other] if one.to_bits() == other.to_bits()));
    if device.phantom.as_ref().is_some_and(|phantom| phantom.port.is_held_at_tip()) && !is_one_mass {
        problems.push(format!(
            "device '{name}': the axes of a tip have different values of hand.inertia: set the same value on every axis"
        ));
    }
}

fn check_axis(at: &str, measures: &[String], section: &AxisSection, problems: &mut Vec<String>) {
    let AxisSection { plant, sensor, .. } = section;
    if section.active_wall().is_some() && plant.as_ref().is_some_and(|plant| plant.stops.is_some()) {
        problems.push(format!("{at}: both wall and plant.stops are set: keep one of them"));
    }
    let ActuatorSection { max_force, max_rate } = section.actuator;
    for (key, limit) in [("max_force", max_force), ("max_rate", max_rate)] {
        if limit.is_nan() || limit <= 0.0 {
            problems.push(format!("{at}: actuator.{key} is {limit}, must be > 0 or inf"));
        }
    }
    let of_hand = section.hand.iter().flat_map(|hand| {
        [("hand.inertia", hand.inertia), ("hand.damping", hand.damping), ("hand.stiffness", hand.stiffness)]
    });
    let of_spring = section
        .spring
        .iter()
        .flat_map(|spring| [("spring.stiffness", spring.stiffness), ("spring.damping", spring.damping)]);
    let of_wall = section.wall.iter().map(|wall| ("wall.damping", wall.damping));
    for (key, value) in of_hand.chain(of_spring).chain(of_wall) {
        if !(value.is_finite() && value >= 0.0) {
            problems.push(format!("{at}: {key} is {value}, must be finite and >= 0"));
        }
    }
    if let Some(wall) =
        section.wall.as_ref().filter(|wall| !(wall.stiffness > 0.0 && wall.position.is_finite()))
    {
        problems.push(format!(
            "{at}: wall.position is {} and wall.stiffness is {}: the position must be finite and the stiffness > 0",
            wall.position, wall.stiffness
        ));
    }
    let checked = |plant: &JointParameters| plant.check().map_err(|error| error.with_path_prefix("plant"));
    let of_plant = plant.as_ref().map_or(Ok(()), checked);
    let of_plant = of_plant.and_then(|()| section.joint().as_ref().map_or(Ok(()), checked));
    let of_sensors = sensor.iter().map(|(signal, sensor)| {
        sensor.check().map_err(|error| error.with_path_prefix(&format!("sensor.{signal}")))
    });
    for error in std::iter::once(of_plant).chain(of_sensors).filter_map(Result::err) {
        let ParameterError { path, value, allowed } = error;
        problems.push(format!("{at}: {path} is {value}, must be {allowed}"));
    }
    let sensed = SENSED.map(|data_type| data_type.name.to_owned());
    let sensed: Vec<String> = sensed.into_iter().filter(|sensed| measures.contains(sensed)).collect();
    for signal in sensor.keys().filter(|signal| !sensed.contains(signal)) {
        let near = suggestion(signal, &sensed);
        problems.push(format!(
            "{at}: sensor.{signal} has no effect, the device does not measure '{signal}' by a \
        sensor; {near}"
        ));
    }
}
