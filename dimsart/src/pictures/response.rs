//! The pictures of a rig's run: what follows what, and by which forces, device by device.

use dimsart_core::types;

use crate::report::{Curve, Figure, Panel};
use hil_sim::recording::Recording;
use hil_sim::response::Part;
use hil_sim::rig_file::{AxisSection, DeviceSection, RigFile};

/// Names of the figures' files of a rig, without what says their format.
#[must_use]
pub fn file_stems(file: &RigFile) -> Vec<String> {
    drawn(file).map(|device| device.name.clone()).collect()
}

/// References alone are drawn with what follows them.
fn drawn(file: &RigFile) -> impl Iterator<Item = &DeviceSection> {
    file.devices.iter().filter(|device| device.moves())
}

/// The figures that the recorded signals allow.
#[must_use]
pub fn figures(recording: &Recording, file: &RigFile) -> Vec<Figure> {
    let parts = Part::of_all(file);
    let figure = |device: &DeviceSection| {
        let of_device: Vec<&Part<'_>> = parts.iter().filter(|part| part.device.name == device.name).collect();
        let panels = |part: &&Part<'_>| -> Vec<Panel> {
            let sections = part.sections().map(|(_, section)| section).enumerate();
            let title = |axis: usize| match of_device.as_slice() {
                [_] => format!("Axis {axis}"),
                _ => part.name().to_owned(),
            };
            sections
                .flat_map(|(axis, section)| of_axis(recording, part.name(), &title(axis), axis, section))
                .collect()
        };
        Figure {
            file_stem: device.name.clone(),
            title: format!("Response of {}", device.name),
            panels: of_device.iter().flat_map(panels).filter(|panel| !panel.curves.is_empty()).collect(),
            spans: Vec::new(),
        }
    };
    drawn(file).map(figure).filter(|figure| !figure.panels.is_empty()).collect()
}

fn of_axis(recording: &Recording, name: &str, title: &str, axis: usize, section: &AxisSection) -> Vec<Panel> {
    let unit = |data_type: &dimsart_core::DataType| data_type.unit.symbol(section.unit.kind());
    let truth = |quantity: &str| ("world", format!("{name}.{quantity}"));
    let of_controller = |signal: &str| (name, signal.to_owned());
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
    .map(|(what, unit, wanted)| panel(recording, (title, axis), &format!("{what} ({unit})"), wanted));
    let [position, velocity, force] = panels;
    let error = error_of(&position, &format!("position error ({})", unit(types::POSITION)));
    let error = error.filter(|_| !recording.is_thinned());
    [position].into_iter().chain(error).chain([velocity, force]).collect()
}

/// A panel of its own for what the second curve of `panel` is off the first: on one axis with both, it is a line.
fn error_of(panel: &Panel, y_label: &str) -> Option<Panel> {
    let [reference, joint] = panel.curves.as_slice() else { return None };
    let error = Curve { label: "error".to_owned(), column: reference.column, minus: Some(joint.column) };
    Some(Panel {
        title: panel.title.clone(),
        y_label: y_label.to_owned(),
        curves: vec![error],
        levels: Vec::new(),
    })
}

/// A label, and the source and signal of its column.
type Wanted<'a> = (&'a str, (&'a str, String));

fn panel(
    recording: &Recording,
    (title, axis): (&str, usize),
    y_label: &str,
    wanted: Vec<Wanted<'_>>,
) -> Panel {
    let curve = |(label, (source, signal)): Wanted<'_>| {
        let column = recording.find(source, &signal, Some(axis))?;
        Some(Curve { label: label.to_owned(), column, minus: None })
    };
    Panel {
        title: title.to_owned(),
        y_label: y_label.to_owned(),
        curves: wanted.into_iter().filter_map(curve).collect(),
        levels: Vec::new(),
    }
}
