//! Pictures of a rig's run: responses and forces of each device, and both sides of a link with a hand.

use dimsart_core::{DataType, types};

use crate::report::{Curve, Figure, Panel};
use hil_sim::recording::Recording;
use hil_sim::rig_file::{AxisSection, ControllerAxes, DeviceSection, LinkSection, RigFile};

/// Returns the file names of a rig's figures, without extension.
#[must_use]
pub(super) fn file_stems(file: &RigFile) -> Vec<String> {
    let sides = led(file).into_iter().map(|[hand, other]| sides_stem(&hand, &other));
    sides.chain(drawn(file).map(|device| device.name.clone())).collect()
}

fn sides_stem(hand: &ControllerAxes<'_>, other: &ControllerAxes<'_>) -> String {
    format!("{}_{}", hand.name(), other.name())
}

/// Returns pairs of a device that a hand moves and the device that follows it over a link.
fn led(file: &RigFile) -> Vec<[ControllerAxes<'_>; 2]> {
    let parts = ControllerAxes::all(file);
    let named = |name: &str| parts.iter().find(|part| part.name() == name && part.device.has_actuators());
    let both = |link: &LinkSection| Some([named(&link.from)?.clone(), named(&link.to)?.clone()]);
    let has_hand =
        |part: &ControllerAxes<'_>| part.sections().any(|(_, section)| section.hand_stiffness() > 0.0);
    file.links.iter().filter_map(both).filter(|[hand, other]| has_hand(hand) && !has_hand(other)).collect()
}

/// Creates the figure of both sides: positions, hand force and commanded force per axis.
fn sides(recording: &Recording, [hand, other]: &[ControllerAxes<'_>; 2]) -> Figure {
    let [one, two] = [hand, other].map(ControllerAxes::name);
    let truth = |name: &str, quantity: &str| ("world", format!("{name}.{quantity}"));
    let same = hand.sections().zip(other.sections()).enumerate();
    let same = same.filter(|(_, ((_, section), (_, other)))| section.unit == other.unit);
    let panels = same.flat_map(|(axis, ((_, section), _))| {
        let unit = |data_type: &DataType| data_type.unit.symbol(section.unit.kind());
        let title = format!("Axis {axis}");
        let drawn = |what: &str, wanted| panel(recording, (&title, axis), what, wanted);
        let hand_on = format!("hand on {one}");
        let on_other = format!("commanded to {two}");
        let positions = vec![(one, truth(one, "position")), (two, truth(two, "position"))];
        let forces =
            vec![(hand_on.as_str(), truth(one, "load")), (on_other.as_str(), (two, "DES_FORCE".to_owned()))];
        [
            drawn(&format!("position ({})", unit(types::POSITION)), positions),
            drawn(&format!("force ({})", unit(types::DES_FORCE)), forces),
        ]
    });
    Figure {
        file_stem: sides_stem(hand, other),
        title: format!("{one} leads {two}"),
        panels: panels.filter(|panel| !panel.curves.is_empty()).collect(),
        spans: Vec::new(),
    }
}

/// Returns the devices with a figure; a pure reference is drawn with its follower.
fn drawn(file: &RigFile) -> impl Iterator<Item = &DeviceSection> {
    file.devices.iter().filter(|device| device.has_actuators())
}

/// Creates the figures of the recorded signals.
#[must_use]
pub(super) fn figures(recording: &Recording, file: &RigFile) -> Vec<Figure> {
    let parts = ControllerAxes::all(file);
    let figure = |device: &DeviceSection| {
        let of_device: Vec<&ControllerAxes<'_>> =
            parts.iter().filter(|part| part.device.name == device.name).collect();
        let panels = |part: &&ControllerAxes<'_>| -> Vec<Panel> {
            let sections = part.sections().map(|(_, section)| section).enumerate();
            let title = |axis: usize| match of_device.as_slice() {
                [_] => format!("Axis {axis}"),
                _ => part.name().to_owned(),
            };
            sections
                .flat_map(|(axis, section)| of_axis(recording, part, &title(axis), axis, section))
                .collect()
        };
        Figure {
            file_stem: device.name.clone(),
            title: format!("Response of {}", device.name),
            panels: of_device.iter().flat_map(panels).filter(|panel| !panel.curves.is_empty()).collect(),
            spans: Vec::new(),
        }
    };
    let sides = led(file).into_iter().map(|both| sides(recording, &both));
    sides.chain(drawn(file).map(figure)).filter(|figure| !figure.panels.is_empty()).collect()
}

fn of_axis(
    recording: &Recording,
    part: &ControllerAxes<'_>,
    title: &str,
    axis: usize,
    section: &AxisSection,
) -> Vec<Panel> {
    let (name, kind) = (part.name(), part.device.kind(section));
    let unit = |data_type: &DataType| data_type.unit.symbol(section.unit.kind());
    let truth = |quantity: &str| ("world", format!("{name}.{quantity}"));
    let of_controller = |signal: &str| (name, signal.to_owned());
    let drawn =
        |what: &str, unit, wanted| panel(recording, (title, axis), &format!("{what} ({unit})"), wanted);
    // Rotary joints of a device that is held at its tip.
    if kind != section.unit.kind() {
        let tip_force = vec![("commanded", of_controller("DES_TIP_FORCE")), ("load", truth("load"))];
        let torque =
            vec![("commanded", of_controller("DES_FORCE")), ("at the joint", truth("actuator_force"))];
        return vec![
            drawn("position", unit(types::POSITION), vec![("tip", truth("position"))]),
            drawn("velocity", unit(types::VELOCITY), vec![("tip", truth("velocity"))]),
            drawn("force", unit(types::DES_FORCE), tip_force),
            drawn("torque", types::DES_FORCE.unit.symbol(kind), torque),
        ];
    }
    let panels = [
        (
            "position",
            unit(types::POSITION),
            vec![("reference", of_controller("DES_POSITION")), ("joint", truth("position"))],
        ),
        (
            "velocity",
            unit(types::VELOCITY),
            vec![("reference", of_controller("DES_VELOCITY")), ("joint", truth("velocity"))],
        ),
        (
            "force",
            unit(types::DES_FORCE),
            vec![
                ("commanded", of_controller("DES_FORCE")),
                ("at the joint", truth("actuator_force")),
                ("load", truth("load")),
            ],
        ),
    ]
    .map(|(what, unit, wanted)| drawn(what, unit, wanted));
    let [position, velocity, force] = panels;
    let error = error_of(&position, &format!("position error ({})", unit(types::POSITION)));
    let error = error.filter(|_| !recording.is_decimated());
    [position].into_iter().chain(error).chain([velocity, force]).collect()
}

/// Creates a separate panel of the difference between the two curves of `panel`, which is too small on a common axis.
fn error_of(panel: &Panel, y_label: &str) -> Option<Panel> {
    let [reference, joint] = panel.curves.as_slice() else { return None };
    let error =
        Curve { label: "error".to_owned(), column: reference.column, subtracted_column: Some(joint.column) };
    Some(Panel {
        title: panel.title.clone(),
        y_label: y_label.to_owned(),
        curves: vec![error],
        levels: Vec::new(),
    })
}

/// Label, source and signal of a column.
type Wanted<'a> = (&'a str, (&'a str, String));

fn panel(
    recording: &Recording,
    (title, axis): (&str, usize),
    y_label: &str,
    wanted: Vec<Wanted<'_>>,
) -> Panel {
    let curve = |(label, (source, signal)): Wanted<'_>| {
        let column = recording.find(source, &signal, Some(axis))?;
        Some(Curve { label: label.to_owned(), column, subtracted_column: None })
    };
    Panel {
        title: title.to_owned(),
        y_label: y_label.to_owned(),
        curves: wanted.into_iter().filter_map(curve).collect(),
        levels: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use hil_sim::experiment::run;

    use super::*;

    #[test]
    fn a_phantom_is_drawn_by_its_tip_beside_the_robot_that_it_leads_and_its_torques_apart() {
        let text = RigFile::shipped("phantom_tip").unwrap();
        let sets = ["duration_s=0.02".to_owned()];
        let file = RigFile::read(text, "phantom_tip", PathBuf::new(), &sets).unwrap();
        let run = run(&file).unwrap();
        let figures = figures(&run.recording, &file);
        let stems: Vec<&str> = figures.iter().map(|figure| figure.file_stem.as_str()).collect();
        assert_eq!(stems, ["phantom_robot", "phantom", "robot"]);
        assert_eq!(file_stems(&file), stems);
        let [sides, phantom, _] = figures.as_slice() else { panic!("{stems:?}") };
        for panel in sides.panels.iter().chain(&phantom.panels) {
            for curve in &panel.curves {
                let unit = &run.recording.columns()[curve.column].unit;
                assert!(panel.y_label.ends_with(&format!(" ({unit})")), "{panel:?}: {unit}");
            }
        }
        let [_, _, force, torque, ..] = phantom.panels.as_slice() else { panic!("{phantom:?}") };
        assert_eq!([&*force.y_label, &*torque.y_label], ["force (N)", "torque (N·m)"]);
    }
}
