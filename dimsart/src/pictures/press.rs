//! Pictures of a press: positions, forces, energy in the channel.

use crate::report::{Curve, Figure, Level, Panel, Span};
use hil_sim::phases::Phases;
use hil_sim::recorder::CHANNEL_ENERGY;
use hil_sim::recording::Recording;
use hil_sim::rig_file::RigFile;

/// File names of the figures, without extension.
pub(super) const FILE_STEMS: [&str; 3] = ["positions", "forces", "energy"];

/// Creates the figures of the recorded signals, of both stations or of one `alone`.
#[must_use]
pub(super) fn figures(
    recording: &Recording,
    phases: &Phases,
    file: &RigFile,
    alone: Option<&str>,
) -> Vec<Figure> {
    let Some([hand, other]) = file.press_pair() else { return Vec::new() };
    let (one, two) = (hand.name(), other.name());
    let dof = hand.axes.len();
    let world = |name: &str, quantity: &str| ("world", format!("{name}.{quantity}"));
    let of = |name, signal: &str| (name, signal.to_owned());
    let mut positions = per_axis(
        recording,
        dof,
        "position (m)",
        &[
            (&format!("{two}'s desired"), of(two, "DES_POSITION")),
            (two, world(two, "position")),
            (one, world(one, "position")),
        ],
    );
    let walls = other.sections().map(|(_, section)| section.active_wall());
    for (panel, wall) in positions.iter_mut().zip(walls) {
        panel.levels.extend(wall.map(|wall| Level { label: "wall".to_owned(), value: wall.position }));
    }
    let forces = per_axis(
        recording,
        dof,
        "force (N)",
        &[
            (&format!("hand on {one}"), world(one, "hand_force")),
            (&format!("wall on {two}"), world(two, "wall_force")),
            (&format!("controller on {two}"), of(two, "DES_FORCE")),
            (&format!("controller on {one}"), of(one, "DES_FORCE")),
        ],
    );
    let waves = per_axis(
        recording,
        dof,
        "wave (sqrt(W))",
        &[
            (&format!("leaves {one}"), of(one, "CH1_WAVES")),
            (&format!("leaves {two}"), of(two, "CH1_WAVES")),
            (&format!("reaches {two}"), of(two, "CH2_WAVES")),
            (&format!("reaches {one}"), of(one, "CH2_WAVES")),
        ],
    );
    let energy = std::iter::once(energy(recording, dof, alone)).chain(waves);
    let energy = energy.filter(|panel| !panel.curves.is_empty()).collect::<Vec<_>>();
    FILE_STEMS
        .into_iter()
        .zip([("Positions", positions), ("Forces", forces), ("Wave energy", energy)])
        .filter(|(_, (_, panels))| !panels.is_empty())
        .map(|(file_stem, (title, panels))| Figure {
            file_stem: file_stem.to_owned(),
            title: title.to_owned(),
            panels,
            spans: spans(recording, phases),
        })
        .collect()
}

/// Creates the panel of the channel energy, from the known waves at its ends.
fn energy(recording: &Recording, dof: usize, alone: Option<&str>) -> Panel {
    let title = match alone {
        Some(name) => format!("Energy in the channel: sent minus received by {name}"),
        None => "Energy in the channel: sent minus received at both ends".to_owned(),
    };
    let mut curves = curves(recording, &[("all axes", ("world", CHANNEL_ENERGY.to_owned()))], None);
    let axes = (0..dof).filter_map(|axis| {
        let column = recording.find("world", CHANNEL_ENERGY, Some(axis))?;
        Some(Curve { label: format!("axis {axis}"), column, subtracted_column: None })
    });
    // With one axis, the sum is sufficient.
    curves.extend(axes.filter(|_| dof > 1));
    Panel { title, y_label: "energy (J)".to_owned(), curves, levels: Vec::new() }
}

/// Label, source and signal of a column.
type Wanted<'a> = (&'a str, (&'a str, String));

fn per_axis(recording: &Recording, dof: usize, y_label: &str, wanted: &[Wanted<'_>]) -> Vec<Panel> {
    let panel = |axis| Panel {
        title: format!("Axis {axis}"),
        y_label: y_label.to_owned(),
        curves: curves(recording, wanted, Some(axis)),
        levels: Vec::new(),
    };
    (0..dof).map(panel).filter(|panel| !panel.curves.is_empty()).collect()
}

fn curves(recording: &Recording, wanted: &[Wanted<'_>], axis: Option<usize>) -> Vec<Curve> {
    let line = |(label, (source, signal)): &Wanted<'_>| {
        let column = recording.find(source, signal, axis)?;
        Some(Curve { label: (*label).to_owned(), column, subtracted_column: None })
    };
    wanted.iter().filter_map(line).collect()
}

fn spans(recording: &Recording, phases: &Phases) -> Vec<Span> {
    let end_s = recording.time_s().last().copied().unwrap_or_default();
    let all = [
        (0.0, phases.contact_start_s, "free motion"),
        (phases.contact_start_s, phases.settled_s, "contact"),
        (phases.settled_s, phases.release_s, "settled"),
        (phases.release_s, phases.end_s, "release"),
    ];
    let span = |(start_s, until_s, label): (f64, f64, &str)| Span {
        start_s,
        end_s: until_s.min(end_s),
        label: label.to_owned(),
    };
    all.into_iter().filter(|(start_s, ..)| *start_s < end_s).map(span).collect()
}
