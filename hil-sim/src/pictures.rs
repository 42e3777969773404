//! The pictures of a bilateral run: positions, forces, energy in the channel.

use crate::recorder::CHANNEL_ENERGY;
use crate::recording::Recording;
use crate::report::{Figure, Line, Panel, Span};
use crate::scenario::Phases;

/// The figures that the recorded signals allow.
#[must_use]
pub fn figures(recording: &Recording, phases: &Phases, dof: usize) -> Vec<Figure> {
    let positions = per_axis(
        recording,
        dof,
        "position (m)",
        &[
            ("master", "world", "master.position"),
            ("slave", "world", "slave.position"),
            ("slave's desired", "slave", "DES_POSITION"),
        ],
    );
    let forces = per_axis(
        recording,
        dof,
        "force (N)",
        &[
            ("hand on master", "world", "master.hand_force"),
            ("controller on master", "master", "DES_FORCE"),
            ("controller on slave", "slave", "DES_FORCE"),
            ("wall on slave", "world", "slave.wall_force"),
        ],
    );
    let mut energy = per_axis(
        recording,
        dof,
        "wave (sqrt(W))",
        &[
            ("leaves master", "master", "CH1_WAVES"),
            ("reaches slave", "slave", "CH2_WAVES"),
            ("leaves slave", "slave", "CH1_WAVES"),
            ("reaches master", "master", "CH2_WAVES"),
        ],
    );
    energy.truncate(1);
    let lines = lines(recording, &[("energy in the channel", "world", CHANNEL_ENERGY)], None);
    let title = "Energy in the channel: sent in and not come out yet".to_owned();
    energy.insert(0, Panel { title, y_label: "energy (J)".to_owned(), lines });
    [("positions", "Positions", positions), ("forces", "Forces", forces), ("energy", "Wave energy", energy)]
        .into_iter()
        .map(|(file_stem, title, panels)| Figure {
            file_stem: file_stem.to_owned(),
            title: title.to_owned(),
            panels,
            spans: spans(recording, phases),
        })
        .collect()
}

/// A label, and the source and signal of its column.
type Wanted<'a> = (&'a str, &'a str, &'a str);

fn per_axis(recording: &Recording, dof: usize, y_label: &str, wanted: &[Wanted<'_>]) -> Vec<Panel> {
    let panel = |axis| Panel {
        title: format!("Axis {axis}"),
        y_label: y_label.to_owned(),
        lines: lines(recording, wanted, Some(axis)),
    };
    (0..dof).map(panel).filter(|panel| !panel.lines.is_empty()).collect()
}

fn lines(recording: &Recording, wanted: &[Wanted<'_>], axis: Option<usize>) -> Vec<Line> {
    let line = |(label, source, signal): &Wanted<'_>| {
        // A device of one axis has its vectors recorded as scalars.
        let column = recording.find(source, signal, axis).or_else(|| recording.find(source, signal, None))?;
        Some(Line { label: (*label).to_owned(), column })
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
