//! Checks a board's measurements at rest: supply, temperatures, currents, encoders, links.

use std::f64::consts::TAU;
use std::io::{Read, Write};

use boards::catalogue::BoardInfo;

use super::Check;
use crate::connect::{ConnectError, Device, DisplayValue, SignalReport};

/// Offset of current measurements without a current, as a share of the maximum.
const CURRENT_SHARE: f64 = 0.03;
/// Default limits, `°C`.
const TEMPERATURES_C: [f64; 2] = [-20.0, 85.0];
/// Tolerance of an encoder at rest, counts.
const RESTLESS_COUNTS: f64 = 2.0;

/// Signals at the start and at the end.
pub(super) struct Looks {
    before: Vec<SignalReport>,
    after: Vec<SignalReport>,
    measured: Vec<String>,
}

impl Looks {
    pub(super) fn begin<S: Read + Write>(device: &mut Device<S>) -> Result<Self, ConnectError> {
        let [measured, _] = device.measured_and_commanded()?;
        Ok(Self { before: device.signals(&[])?, after: Vec::new(), measured })
    }

    pub(super) fn look<S: Read + Write>(&mut self, device: &mut Device<S>) -> Result<(), ConnectError> {
        self.after = device.signals(&[])?;
        Ok(())
    }

    /// Returns a signal's values at the start and at the end, and its unit.
    fn signal(&self, name: &str) -> Option<([Vec<f64>; 2], &str)> {
        let find = |reports: &'_ [SignalReport]| {
            let report = reports.iter().find(|report| report.name == name)?;
            Some(report.values.iter().map(number).collect::<Vec<_>>())
        };
        let unit = self.after.iter().find(|report| report.name == name)?.unit.as_str();
        Some(([find(&self.before)?, find(&self.after)?], unit))
    }
}

fn number(value: &DisplayValue) -> f64 {
    match value {
        DisplayValue::Real(value) => f64::from(*value),
        #[expect(clippy::cast_precision_loss, reason = "of 32 bits")]
        DisplayValue::Whole(value) => *value as f64,
        DisplayValue::Flag(value) => f64::from(u8::from(*value)),
        DisplayValue::Name(_) => f64::NAN,
    }
}

/// Checks measurements against the limits of the catalogue. `holder` is the client that may move the board.
pub(super) fn checks(looks: &Looks, board: Option<&BoardInfo>, holder: Option<u8>) -> Vec<Check> {
    let limits = board.and_then(|board| board.tooling.drive).map(|drive| drive.configuration.limits);
    let motor = board.and_then(|board| board.tooling.motor);
    let supply =
        limits.map_or([0.0, f64::INFINITY], |limits| [limits.min_bus_v, limits.max_bus_v].map(f64::from));
    let [min_c, max_c] = TEMPERATURES_C;
    let temperature = [min_c, limits.map_or(max_c, |limits| f64::from(limits.derating_c))];
    let current = motor.map_or(f64::INFINITY, |motor| CURRENT_SHARE * f64::from(motor.max_current_a));
    let mut checks = Vec::new();
    for name in looks.measured.iter().map(String::as_str) {
        let (range, next) = match name {
            "SUPPLY_VOLTAGE" | "BUS_VOLTAGE" => {
                (supply, "check the supply, its switch and wires, or the limits in `boards/src/catalogue/`")
            }
            "BRIDGE_TEMPERATURE" | "TEMPERATURE" | "WINDING_TEMPERATURE" => {
                (temperature, "let the drive cool down, or check the temperature sensor")
            }
            "MOTOR_CURRENT" => ([-current, current], "disconnect the motor and check the shunt amplifiers"),
            "DRIVE_FAULT" => ([0.0, 0.0], "look up the value of DRIVE_FAULT in the drive's manual"),
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
    Check::not_run(
        name,
        format!("board not at rest: client {holder} holds the lease; disarm that client first"),
    )
}

/// Formats values with their unit.
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
        _ => "a finite number".to_owned(),
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
        format!("{}, moved by {} in 1 s", listed(&after, unit), listed(&moved, unit)),
        format!(
            "finite and constant within {most:.4} {unit}; turn the shaft by hand and check with `watch POSITION` that \
             the value follows"
        ),
        "hold the shafts still; if they do not turn, check the encoder's supply, ground and shield",
    ))
}

/// Names of the values of `LINK_STATE`.
const STATES: [&str; 7] =
    ["no data yet", "ok", "packets lost", "packet repeated", "wrong sequence", "error", "timeout"];

fn links(looks: &Looks) -> Vec<Check> {
    let names = looks.after.iter().map(|report| report.name.as_str());
    let mut checks: Vec<Check> = names
        .filter_map(|name| name.strip_prefix("LINK_STATE"))
        .filter_map(|suffix| link(looks, suffix))
        .collect();
    if checks.is_empty() {
        checks.push(Check::not_run("links", "the scheme receives no packets from a link"));
    }
    checks.extend(growth(looks, "CAN_REJOINS").map(|(rejoins, in_all)| {
        Check::new(
            "CAN bus",
            rejoins <= 0.0,
            format!("{rejoins} bus-off recoveries in 1 s, {in_all} since the start"),
            "no bus-off recovery",
            "check the 120 ohm termination at both ends, CANH and CANL, the transceiver and the bit rates of all nodes",
        )
    }));
    checks
}

/// Returns the increase of a count, and its value.
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
        .map_or("unknown state", |(text, _)| text);
    let of = |name: &str| growth(looks, &format!("{name}{suffix}")).unwrap_or_default();
    let ([lost, _], [refused, _]) = (<[f64; 2]>::from(of("LINK_LOST")), <[f64; 2]>::from(of("LINK_REFUSED")));
    if text == "no data yet" {
        return Some(Check::not_run(&name, "no packet received yet: connect the peer"));
    }
    Some(Check::new(
        &name,
        text == "ok" && lost <= 0.0 && refused <= 0.0,
        format!("{text}; {lost} packets lost and {refused} refused in 1 s"),
        "ok, no packet lost or refused",
        "check the peer, the wires and the bit rates",
    ))
}
