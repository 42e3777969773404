//! The figures of a run as tables, for the terminal and the report.

use std::io::{self, Write};

use comfy_table::{CellAlignment, Table as TextTable};

use super::output::text_table;
use crate::report::{SummaryRow, Table};
use dimsart_core::types;
use hil_sim::bus::Traffic;
use hil_sim::outcome::{
    AxisOutcome, ContactStiffness, LimitCycle, LoopFigures, Outcome, PerceivedStiffness, RealTime, Received,
    Saturation,
};

/// Placeholder of a missing figure.
const NONE: &str = "-";

/// Prints the tables, warnings and faults.
pub(super) fn print(out: &mut dyn Write, outcome: &Outcome) -> io::Result<()> {
    print_tables(out, facts(outcome), axes(outcome))?;
    for warning in &outcome.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    for fault in &outcome.faults {
        writeln!(out, "fault: {fault}")?;
    }
    outcome.undecided.iter().try_for_each(|undecided| writeln!(out, "{undecided}"))
}

/// Prints the figures of the run, then of each axis.
fn print_tables(out: &mut dyn Write, facts: Vec<SummaryRow>, axes: Table) -> io::Result<()> {
    let mut table = text_table();
    for fact in facts {
        table.add_row([fact.name, fact.value, fact.unit, fact.note]);
    }
    writeln!(out, "{}", right_aligned(table, 1..2))?;
    if !axes.rows.is_empty() {
        let columns = axes.header.len();
        let mut table = text_table();
        table.set_header(axes.header).add_rows(axes.rows);
        writeln!(out, "{}", right_aligned(table, 0..columns))?;
    }
    Ok(())
}

fn right_aligned(mut table: TextTable, columns: std::ops::Range<usize>) -> TextTable {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

fn fact(name: &str, value: String, unit: &str, note: &str) -> SummaryRow {
    SummaryRow { name: name.to_owned(), value, unit: unit.to_owned(), note: note.to_owned() }
}

/// The figures of a run as a whole.
pub(super) fn facts(outcome: &Outcome) -> Vec<SummaryRow> {
    let (stable, note) = match outcome.stable {
        true => ("yes", "all signals in range; no growth, no sustained oscillation"),
        false if outcome.faults.is_empty() => {
            ("undecided", "stability not determined; see the message below")
        }
        false => ("NO", "see the fault message"),
    };
    let ticks = format!("{} ticks", outcome.ticks);
    let factor = match outcome.realtime_factor {
        factor if factor < 10.0 => format!("{factor:.3} times real time"),
        factor => format!("{factor:.0} times real time"),
    };
    let mut facts = vec![
        fact("stable", stable.to_owned(), "", note),
        fact("simulated time", format!("{:.3}", outcome.simulated_s), "s", &ticks),
        fact("computing time", format!("{:.3}", outcome.wall_s), "s", &factor),
    ];
    if has_contacts(outcome) {
        facts.push(round_trip(outcome));
        match &outcome.real_time {
            None => facts.push(channel_energy(outcome.energy_min_j)),
            Some(real_time) => facts.extend(one_side(outcome, real_time)),
        }
    } else {
        facts.extend(outcome.perceived.iter().map(perceived));
    }
    facts.extend(outcome.energy_ports_min_j.map(port_energy));
    facts.extend(outcome.rounding_creep_m_per_h.map(|creep| {
        fact(
            "rounding creep",
            format!("{:.2}", 1e3 * creep),
            "mm/h",
            "maximum creep of a hand in contact due to f32 rounding: 12 u F/b (unit roundoff u, force F, impedance b)",
        )
    }));
    facts.extend(limit_cycles(&outcome.limit_cycles));
    facts.extend(outcome.saturated.iter().map(|found| saturated(found, outcome.simulated_s)));
    facts.extend(lost(&outcome.received));
    facts.extend(outcome.media.iter().map(medium));
    facts
}

/// Whether a hand is in contact on any axis.
fn has_contacts(outcome: &Outcome) -> bool {
    outcome.axes.iter().any(|axis| axis.contact.is_some())
}

/// Minimum energy at the robots' ports.
fn port_energy(energy_j: f64) -> SummaryRow {
    let (value, note) = match energy_j < 0.0 {
        true => (
            format!("{energy_j:.3e}"),
            "minimum over all axes; below 0: controllers and channel generated energy",
        ),
        false => (
            "0".to_owned(),
            "minimum over all axes; never below 0: controllers and channel were passive in this run",
        ),
    };
    fact("minimum energy at the robots", value, "J", note)
}

/// Limit cycles, if any.
fn limit_cycles(cycles: &[LimitCycle]) -> Option<SummaryRow> {
    let widest = cycles.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))?;
    let LimitCycle { device, axis, hz, amplitude, .. } = widest;
    let note = format!(
        "axes that oscillate at rest; largest amplitude: axis {axis} of {device}, ±{amplitude:.1e} at {hz:.1} Hz"
    );
    Some(fact("limit cycles", cycles.len().to_string(), "axes", &note))
}

/// Lost packets at all receivers; none without a receiver.
fn lost(received: &[Received]) -> Option<SummaryRow> {
    let sum: u64 = received.iter().map(|received| u64::from(received.lost)).sum();
    let is_clean = |received: &&Received| received.lost + received.superseded + received.refused == 0;
    let clean: Vec<&str> =
        received.iter().filter(is_clean).map(|received| received.station.as_str()).collect();
    let others = received.iter().filter(|received| !is_clean(received));
    let each = others.map(|Received { station, lost, superseded, refused }| {
        let together = match superseded {
            0 => String::new(),
            superseded => format!(", {superseded} superseded by newer packets in the same tick"),
        };
        format!("packets to {station}: {lost} lost, {refused} refused{together}")
    });
    let clean = (!clean.is_empty()).then(|| format!("0 packets lost or refused to {}", clean.join(", ")));
    let note = each.chain(clean).collect::<Vec<_>>().join("; ");
    (!received.is_empty()).then(|| fact("lost packets", sum.to_string(), "", &note))
}

/// Load and errors of a medium.
fn medium(traffic: &Traffic) -> SummaryRow {
    let Traffic { medium, load, packets, dropped, errors, bus_offs, longest_s } = traffic;
    let gone = if *bus_offs > 0 { format!(", {bus_offs} bus-off") } else { String::new() };
    let note = format!(
        "load; {packets} packets, {dropped} dropped, max delivery time {:.3} ms; {errors} errors{gone}",
        1e3 * longest_s
    );
    fact(medium, format!("{:.1}", 100.0 * load), "%", &note)
}

fn saturated(found: &Saturation, simulated_s: f64) -> SummaryRow {
    let Saturation { device, axis, time_s } = found;
    let share = 100.0 * time_s / simulated_s.max(f64::MIN_POSITIVE);
    let note = format!(
        "for {share:.0} % of the run, commands exceeded the range or rate limit of axis {axis} of {device}"
    );
    fact("saturated", format!("{time_s:.3}"), "s", &note)
}

fn perceived(felt: &PerceivedStiffness) -> SummaryRow {
    let PerceivedStiffness { device, axis, met_by, unit, stiffness, unsettled } = felt;
    let settled = unsettled.as_ref().map_or_else(String::new, |how| format!("; NOT settled: {how}"));
    let note = format!("hand at axis {axis} of {device}, obstacle at {met_by}{settled}");
    fact("perceived stiffness", format!("{stiffness:.1}"), unit, &note)
}

fn round_trip(outcome: &Outcome) -> SummaryRow {
    let note = match outcome.round_trip_ticks {
        None => "no reply, or the peer's scheme is unknown",
        Some(_) => "measured on the link, plus delay of the delay modules",
    };
    let ticks = outcome.round_trip_ticks.map_or(NONE.to_owned(), |ticks| ticks.to_string());
    fact("round trip", ticks, "ticks", note)
}

fn channel_energy(energy_min_j: Option<f64>) -> SummaryRow {
    let (value, note) = match energy_min_j {
        None => (NONE.to_owned(), "requires wave variables on both sides"),
        Some(energy_j) if energy_j < 0.0 => {
            (format!("{energy_j:.3e}"), "minimum over all axes; below 0: the channel is not passive")
        }
        Some(_) => ("0".to_owned(), "minimum over all axes; never below 0: the channel is passive"),
    };
    fact("minimum channel energy", value, "J", note)
}

/// Figures of a single side in real time, and figures that it lacks.
fn one_side(outcome: &Outcome, real_time: &RealTime) -> Vec<SummaryRow> {
    let RealTime { side, late_ticks, worst_lateness_s } = real_time;
    let latest = format!(
        "of {} ticks, late by more than a period; max delay {:.3} ms",
        outcome.ticks,
        1e3 * worst_lateness_s
    );
    let unknown = |name: &str, unit: &str, note: &str| {
        fact(name, NONE.to_owned(), unit, &format!("unknown on the {side}: {note}"))
    };
    let mut facts = vec![
        fact("late ticks", late_ticks.to_string(), "", &latest),
        unknown("minimum channel energy", "J", "requires the wave variables of both sides"),
    ];
    if outcome.k_perceived_n_per_m.iter().all(Option::is_none) {
        facts.push(fact(
            "perceived stiffness",
            NONE.to_owned(),
            "N/m",
            match side.as_str() {
                "slave" => "unknown on the slave: the operator perceives stiffness at the master",
                _ => "no settled contact on any axis",
            },
        ));
    }
    facts
}

/// Figures of each axis; empty for a single side without measurements.
pub(super) fn axes(outcome: &Outcome) -> Table {
    if has_contacts(outcome) { contacts(outcome) } else { followings(outcome) }
}

/// Perceived stiffness of each axis, and its prediction.
fn contacts(outcome: &Outcome) -> Table {
    let number = |value: Option<f64>| value.map_or(NONE.to_owned(), |value| format!("{value:.3}"));
    let row = |axis: &AxisOutcome| {
        let ContactStiffness { k_perceived_n_per_m: perceived, k_predicted_n_per_m: predicted } =
            axis.contact?;
        let difference = match (perceived, predicted) {
            (Some(perceived), Some(predicted)) => format!("{:+.1e}", (perceived - predicted) / predicted),
            (Some(_), None) => NONE.to_owned(),
            (None, _) => "no settled contact".to_owned(),
        };
        Some(vec![axis.axis.to_string(), number(perceived), number(predicted), difference])
    };
    let has_perceived = outcome.k_perceived_n_per_m.iter().any(Option::is_some);
    let shown = outcome.axes.iter().filter(|_| outcome.real_time.is_none() || has_perceived);
    let header = ["axis", "perceived stiffness (N/m)", "predicted (N/m)", "relative difference"];
    Table { header: header.map(str::to_owned).to_vec(), rows: shown.filter_map(row).collect() }
}

/// Tracking figures of each axis.
fn followings(outcome: &Outcome) -> Table {
    let header = [
        "axis",
        "reference",
        "rise (s)",
        "overshoot",
        "settling (s)",
        "rms error",
        "peak error",
        "phase margin",
        "gain margin",
        "bandwidth",
    ];
    let seconds = |time_s: Option<f64>| time_s.map_or(NONE.to_owned(), |time_s| format!("{time_s:.4}"));
    let row = |axis: &AxisOutcome| {
        let following = axis.following?;
        let unit = following.unit;
        let LoopFigures { phase_margin_deg, gain_margin, bandwidth_hz, .. } =
            axis.loop_figures.unwrap_or_default();
        let number = |value: Option<f64>, unit: &str| {
            value.map_or(NONE.to_owned(), |value| format!("{value:.1}{unit}"))
        };
        Some(vec![
            format!("{} {}", axis.device, axis.axis),
            following.reference.to_owned(),
            seconds(following.rise_time_s),
            following.overshoot.map_or(NONE.to_owned(), |share| format!("{:.1} %", 100.0 * share)),
            seconds(following.settling_time_s),
            format!("{:.1e} {unit}", following.rms_error),
            format!("{:.1e} {unit}", following.peak_error),
            number(phase_margin_deg, "°"),
            number(gain_margin, ""),
            number(bandwidth_hz, " Hz"),
        ])
    };
    let rows: Vec<Vec<String>> = outcome.axes.iter().filter_map(row).collect();
    let is_usual = outcome
        .axes
        .iter()
        .filter_map(|axis| axis.following)
        .all(|following| following.reference == types::DES_POSITION.name);
    // Hides empty columns.
    let is_shown = |column: &usize| match column {
        1 => !is_usual,
        _ => rows.iter().any(|row| row.get(*column).is_some_and(|entry| entry != NONE)),
    };
    let shown: Vec<usize> = (0..header.len()).filter(is_shown).collect();
    let pick = |row: &[String]| shown.iter().filter_map(|column| row.get(*column).cloned()).collect();
    Table { header: pick(&header.map(str::to_owned)), rows: rows.iter().map(|row| pick(row)).collect() }
}
