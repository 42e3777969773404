//! The pictures of a bilateral run: positions, forces, energy in the channel.

use crate::report::{Curve, Figure, Level, Panel, Span};
use hil_sim::bilateral::Side;
use hil_sim::bilateral::phases::Phases;
use hil_sim::plant::EnvironmentKind;
use hil_sim::recorder::CHANNEL_ENERGY;
use hil_sim::recording::Recording;
use hil_sim::scenario::Scenario;

/// Names of the figures' files, without what says their format.
pub const FILE_STEMS: [&str; 3] = ["positions", "forces", "energy"];

/// The figures that the recorded signals allow, of a run of both sides or of one.
#[must_use]
pub fn figures(
    recording: &Recording,
    phases: &Phases,
    scenario: &Scenario,
    side: Option<Side>,
) -> Vec<Figure> {
    let dof = scenario.dof;
    let mut positions = per_axis(
        recording,
        dof,
        "position (m)",
        &[
            ("slave's desired", "slave", "DES_POSITION"),
            ("slave", "world", "slave.position"),
            ("master", "world", "master.position"),
        ],
    );
    if scenario.environment == EnvironmentKind::Wall {
        let value = scenario.environments.wall.position_m;
        positions.iter_mut().for_each(|panel| panel.levels.push(Level { label: "wall".to_owned(), value }));
    }
    let forces = per_axis(
        recording,
        dof,
        "force (N)",
        &[
            ("hand on master", "world", "master.hand_force"),
            ("wall on slave", "world", "slave.wall_force"),
            ("controller on slave", "slave", "DES_FORCE"),
            ("controller on master", "master", "DES_FORCE"),
        ],
    );
    let waves = per_axis(
        recording,
        dof,
        "wave (sqrt(W))",
        &[
            ("leaves master", "master", "CH1_WAVES"),
            ("leaves slave", "slave", "CH1_WAVES"),
            ("reaches slave", "slave", "CH2_WAVES"),
            ("reaches master", "master", "CH2_WAVES"),
        ],
    );
    let energy = std::iter::once(energy(recording, dof, side)).chain(waves);
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

/// The energy in the channel, as far as the waves at its ends are known here.
fn energy(recording: &Recording, dof: usize, side: Option<Side>) -> Panel {
    let title = match side {
        Some(Side::Master) => "Energy that the master gave the channel and has not got back",
        Some(Side::Slave) => "Energy that the slave gave the channel and has not got back",
        None => "Energy in the channel: sent into it at both ends and not come out yet",
    };
    let mut curves = curves(recording, &[("all axes", "world", CHANNEL_ENERGY)], None);
    let axes = (0..dof).filter_map(|axis| {
        let column = recording.find("world", CHANNEL_ENERGY, Some(axis))?;
        Some(Curve { label: format!("axis {axis}"), column, minus: None })
    });
    // Of one axis, it is the same twice.
    curves.extend(axes.filter(|_| dof > 1));
    Panel { title: title.to_owned(), y_label: "energy (J)".to_owned(), curves, levels: Vec::new() }
}

/// A label, and the source and signal of its column.
type Wanted<'a> = (&'a str, &'a str, &'a str);

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
    let line = |(label, source, signal): &Wanted<'_>| {
        let column = recording.find(source, signal, axis)?;
        Some(Curve { label: (*label).to_owned(), column, minus: None })
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
