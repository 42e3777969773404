//! The pictures of a rig's run: what follows what, and by which forces, device by device.

use dimsart_core::types;

use crate::recording::Recording;
use crate::report::{Curve, Figure, Panel};
use crate::rig_file::RigFile;

/// Names of the figures' files of a rig, without what says their format.
#[must_use]
pub fn file_stems(file: &RigFile) -> Vec<String> {
    file.devices.iter().map(|device| device.name.clone()).collect()
}

/// The figures that the recorded signals allow.
#[must_use]
pub fn figures(recording: &Recording, file: &RigFile) -> Vec<Figure> {
    let figure = |device: &crate::rig_file::DeviceSection| {
        let name = device.name.as_str();
        let panels = |axis: usize| {
            let [unit, speed_unit, force_unit] =
                [types::POSITION, types::VELOCITY, types::DES_FORCE].map(|data_type| {
                    let kind = device.axes.get(axis).map(|axis| axis.unit.kind()).unwrap_or_default();
                    data_type.unit.symbol(kind)
                });
            let truth = |quantity: &str| ("world", format!("{name}.{quantity}"));
            let of_controller = |signal: &str| (name, signal.to_owned());
            [
                (
                    "position",
                    unit,
                    vec![("reference", of_controller("DES_POSITION")), ("joint", truth("position"))],
                ),
                (
                    "velocity",
                    speed_unit,
                    vec![("reference", of_controller("DES_VELOCITY")), ("joint", truth("velocity"))],
                ),
                (
                    "force",
                    force_unit,
                    vec![
                        ("commanded", of_controller("DES_FORCE")),
                        ("at the joint", truth("actuator_force")),
                        ("load", truth("load")),
                    ],
                ),
            ]
            .map(|(what, unit, wanted)| panel(recording, axis, &format!("{what} ({unit})"), wanted))
        };
        let panels = (0..device.axes.len()).flat_map(panels).filter(|panel| !panel.curves.is_empty());
        Figure {
            file_stem: name.to_owned(),
            title: format!("Response of {name}"),
            panels: panels.collect(),
            spans: Vec::new(),
        }
    };
    file.devices.iter().map(figure).filter(|figure| !figure.panels.is_empty()).collect()
}

/// A label, and the source and signal of its column.
type Wanted<'a> = (&'a str, (&'a str, String));

fn panel(recording: &Recording, axis: usize, y_label: &str, wanted: Vec<Wanted<'_>>) -> Panel {
    let curve = |(label, (source, signal)): Wanted<'_>| {
        let column = recording.find(source, &signal, Some(axis))?;
        Some(Curve { label: label.to_owned(), column })
    };
    Panel {
        title: format!("Axis {axis}"),
        y_label: y_label.to_owned(),
        curves: wanted.into_iter().filter_map(curve).collect(),
        levels: Vec::new(),
    }
}
