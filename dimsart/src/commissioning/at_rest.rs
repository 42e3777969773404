//! What a board measures while nothing moves it: supply, temperatures, currents, encoders, links.

use std::f64::consts::TAU;
use std::io::{Read, Write};

use boards::catalogue::BoardInfo;

use super::Check;
use crate::connect::{ConnectError, Device, SignalReport, ValueText};

/// Of the largest current: what converters show without one.
const CURRENT_SHARE: f64 = 0.03;
/// Where the board's own limits are not known, `°C`.
const TEMPERATURES_C: [f64; 2] = [-20.0, 85.0];
/// Counts that an encoder at rest may go to and fro.
const RESTLESS_COUNTS: f64 = 2.0;

/// Signals as they were at the beginning and at the end.
pub(super) struct Looks {
    before: Vec<SignalReport>,
    after: Vec<SignalReport>,
    measured: Vec<String>,
}

impl Looks {
    pub(super) fn begin<S: Read + Write>(device: &mut Device<S>) -> Result<Self, ConnectError> {
        let [measured, _] = device.device_types()?;
        Ok(Self { before: device.signals(&[])?, after: Vec::new(), measured })
    }

    pub(super) fn look<S: Read + Write>(&mut self, device: &mut Device<S>) -> Result<(), ConnectError> {
        self.after = device.signals(&[])?;
        Ok(())
    }

    /// A signal's values at the beginning and at the end, and its unit.
    fn signal(&self, name: &str) -> Option<([Vec<f64>; 2], &str)> {
        let find = |reports: &'_ [SignalReport]| {
            let report = reports.iter().find(|report| report.name == name)?;
            Some(report.values.iter().map(number).collect::<Vec<_>>())
        };
        let unit = self.after.iter().find(|report| report.name == name)?.unit.as_str();
        Some(([find(&self.before)?, find(&self.after)?], unit))
    }
}

fn number(value: &ValueText) -> f64 {
    match value {
        ValueText::Real(value) => f64::from(*value),
        #[expect(clippy::cast_precision_loss, reason = "of 32 bits")]
        ValueText::Whole(value) => *value as f64,
        ValueText::Flag(value) => f64::from(u8::from(*value)),
        ValueText::Name(_) => f64::NAN,
    }
}

/// What is measured, by the limits of a board of the catalogue. `holder` may have it move: then nothing of it is at rest.
pub(super) fn checks(looks: &Looks, board: Option<&BoardInfo>, holder: Option<u8>) -> Vec<Check> {
    let limits = board.and_then(|board| board.tooling.drive).map(|drive| drive.configuration.limits);
    let motor = board.and_then(|board| board.tooling.motor);
    let supply =
        limits.map_or([0.0, f64::INFINITY], |limits| [limits.least_bus_v, limits.most_bus_v].map(f64::from));
    let [least_c, most_c] = TEMPERATURES_C;
    let temperature = [least_c, limits.map_or(most_c, |limits| f64::from(limits.derating_c))];
    let current = motor.map_or(f64::INFINITY, |motor| CURRENT_SHARE * f64::from(motor.max_current_a));
    let mut checks = Vec::new();
    for name in looks.measured.iter().map(String::as_str) {
        let (range, next) = match name {
            "SUPPLY_VOLTAGE" | "BUS_VOLTAGE" => (
                supply,
                "look at the supply, its switch and its wires; correct the limits in `boards/src/catalogue/`",
            ),
            "BRIDGE_TEMPERATURE" | "TEMPERATURE" | "WINDING_TEMPERATURE" => {
                (temperature, "let it cool, or look at the sensor")
            }
            "MOTOR_CURRENT" => {
                ([-current, current], "look at the shunts' amplifiers with the motor unplugged")
            }
            "DRIVE_FAULT" => ([0.0, 0.0], "look the number up in the drive's manual"),
            _ => continue,
        };
        checks.extend(within(looks, name, range, next, holder));
    }
    let counts = motor.map(|motor| f64::from(motor.counts_per_turn));
    checks.extend(encoders(looks, counts, holder));
    checks.extend(links(looks));
    checks
}

fn driven(name: &str, holder: u8) -> Check {
    Check::not_run(name, format!("client {holder} holds the lease, so the device may move"))
}

/// Unit behind a value.
fn listed(values: &[f64], unit: &str) -> String {
    let values: Vec<String> = values.iter().map(|value| format!("{value:.3}")).collect();
    format!("{} {unit}", values.join(", ")).trim_end().to_owned()
}

fn within(
    looks: &Looks,
    name: &str,
    [least, most]: [f64; 2],
    next: &str,
    holder: Option<u8>,
) -> Option<Check> {
    if let Some(holder) = holder.filter(|_| name == "MOTOR_CURRENT") {
        return Some(driven(name, holder));
    }
    let ([_, values], unit) = looks.signal(name)?;
    let expected = match (least.is_finite(), most.is_finite()) {
        (true, true) => format!("{least} to {most} {unit}"),
        (true, false) => format!("above {least} {unit}"),
        _ => "a number".to_owned(),
    };
    let is_well = values.iter().all(|value| value.is_finite() && (least..=most).contains(value));
    Some(Check::new(name, is_well, listed(&values, unit), expected.trim_end(), next))
}

fn encoders(looks: &Looks, counts_per_turn: Option<f64>, holder: Option<u8>) -> Option<Check> {
    let name = "encoders";
    if let Some(holder) = holder {
        return Some(driven(name, holder));
    }
    let ([before, after], unit) = looks.signal("POSITION")?;
    let most = counts_per_turn.map_or(0.01, |counts| RESTLESS_COUNTS * TAU / counts);
    let moved: Vec<f64> = before.iter().zip(&after).map(|(before, after)| after - before).collect();
    Some(Check::new(
        name,
        moved.iter().all(|moved| moved.is_finite() && moved.abs() <= most),
        format!("{}, moved by {} in a second", listed(&after, unit), listed(&moved, unit)),
        format!(
            "finite, and still to {most:.4} {unit}: turn the shafts by hand, and `watch POSITION` follows"
        ),
        "hold the shafts still; if nothing turns, look at the encoder's supply, ground and shield",
    ))
}

/// States of a link, by number, as `LINK_STATE` has them.
const STATES: [&str; 7] =
    ["no data yet", "ok", "some lost", "repeated", "wrong sequence", "error", "timeout"];

fn links(looks: &Looks) -> Vec<Check> {
    let names = looks.after.iter().map(|report| report.name.as_str());
    let mut checks: Vec<Check> = names
        .filter_map(|name| name.strip_prefix("LINK_STATE"))
        .filter_map(|suffix| link(looks, suffix))
        .collect();
    if checks.is_empty() {
        checks.push(Check::not_run("links", "the scheme takes nothing from a link"));
    }
    checks.extend(growth(looks, "CAN_REJOINS").map(|(rejoins, in_all)| {
        Check::new(
            "CAN bus",
            rejoins <= 0.0,
            format!("joined again {rejoins} times in a second, {in_all} since the start"),
            "that it stays on the bus",
            "look at both ends' 120 ohm, at CANH and CANL, at the transceiver and at the bit rates of all nodes",
        )
    }));
    checks
}

/// By how much a count has grown, and what it is now.
fn growth(looks: &Looks, name: &str) -> Option<(f64, f64)> {
    let ([before, after], _) = looks.signal(name)?;
    Some((after.first()? - before.first()?, *after.first()?))
}

fn link(looks: &Looks, suffix: &str) -> Option<Check> {
    let name = format!("link LINK_STATE{suffix}");
    let ([_, state], _) = looks.signal(&format!("LINK_STATE{suffix}"))?;
    let state = *state.first()?;
    let text = STATES
        .iter()
        .zip(0_u8..)
        .find(|(_, number)| (f64::from(*number) - state).abs() < 0.5)
        .map_or("unknown to this version", |(text, _)| text);
    let of = |name: &str| growth(looks, &format!("{name}{suffix}")).unwrap_or_default();
    let ([lost, _], [refused, _]) = (<[f64; 2]>::from(of("LINK_LOST")), <[f64; 2]>::from(of("LINK_REFUSED")));
    if text == "no data yet" {
        return Some(Check::not_run(&name, "nothing has come over it yet: connect the other side"));
    }
    Some(Check::new(
        &name,
        text == "ok" && lost <= 0.0 && refused <= 0.0,
        format!("{text}; {lost} lost and {refused} refused in a second"),
        "ok, and none lost or refused",
        "see to the other side, the wires and the bit rates",
    ))
}
