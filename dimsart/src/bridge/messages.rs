//! Messages of ROS 2, field by field as their definitions have them, in CDR.

use std::time::{Duration, SystemTime};

use byteorder::LittleEndian;
use serde::Serialize;
use serde_json::Value;

use crate::connect::{TapRow, TapSignal};

/// What a message in little endian begins with.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// A type of messages: its name as DDS writes it, and the hash of its definition (REP 2016).
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageType {
    pub(super) name: &'static str,
    pub(super) hash: &'static str,
}

/// `sensor_msgs/msg/JointState`.
pub(super) const JOINT_STATE: MessageType = MessageType {
    name: "sensor_msgs::msg::dds_::JointState_",
    hash: "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
};
/// `diagnostic_msgs/msg/DiagnosticArray`.
pub(super) const DIAGNOSTIC_ARRAY: MessageType = MessageType {
    name: "diagnostic_msgs::msg::dds_::DiagnosticArray_",
    hash: "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
};

/// What a `DiagnosticStatus` says of a device.
#[derive(Debug, Clone, Copy)]
enum Level {
    Ok = 0,
    Warn = 1,
    Error = 2,
    /// Nothing is heard of it.
    Stale = 3,
}

#[derive(Debug, Serialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Debug, Serialize)]
struct Header {
    stamp: Time,
    frame_id: &'static str,
}

#[derive(Debug, Serialize)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct DiagnosticArray {
    header: Header,
    status: Vec<DiagnosticStatus>,
}

#[derive(Debug, Serialize)]
struct DiagnosticStatus {
    level: u8,
    name: String,
    message: String,
    hardware_id: String,
    values: Vec<KeyValue>,
}

#[derive(Debug, Serialize)]
struct KeyValue {
    key: String,
    value: String,
}

/// A row as `JointState`: POSITION, VELOCITY and FORCE by axis, as far as they are in the Data Base. None without a position.
pub(super) fn joint_state(
    device: &str,
    signals: &[TapSignal],
    row: &TapRow,
    now: SystemTime,
) -> Option<Vec<u8>> {
    let values = |name: &str| {
        let place = signals.iter().position(|signal| signal.name == name)?;
        let words = |signals: &[TapSignal]| signals.iter().map(|signal| signal.words).sum::<usize>();
        let (first, count) = (words(signals.get(..place)?), signals.get(place)?.words);
        row.values.get(first..first + count).map(<[f64]>::to_vec)
    };
    let position = values("POSITION")?;
    let name = |axis: usize| if position.len() == 1 { device.to_owned() } else { format!("{device}_{axis}") };
    let state = JointState {
        header: header(now),
        name: (0..position.len()).map(name).collect(),
        velocity: values("VELOCITY").unwrap_or_default(),
        effort: values("FORCE").unwrap_or_default(),
        position,
    };
    cdr(&state)
}

/// How a device is doing as `DiagnosticArray`: what `dimsart connect PORT faults --json` says of it, or why it says nothing.
pub(super) fn diagnostics(device: &str, faults: Result<&Value, &str>, now: SystemTime) -> Option<Vec<u8>> {
    let (level, message, values) = match faults {
        Ok(faults) => (level(faults), text(faults.get("state")), values(faults)),
        Err(reason) => (Level::Stale, reason.to_owned(), Vec::new()),
    };
    let status = DiagnosticStatus {
        level: level as u8,
        name: device.to_owned(),
        message,
        hardware_id: device.to_owned(),
        values,
    };
    cdr(&DiagnosticArray { header: header(now), status: vec![status] })
}

/// What is to be repaired is an error, what was once a warning.
fn level(faults: &Value) -> Level {
    let is_there = |name: &str| faults.get(name).is_some_and(|found| !found.is_null());
    let count = faults.get("faults").and_then(Value::as_u64).unwrap_or_default();
    match (count, is_there("cut_out"), is_there("first_fault")) {
        (1.., ..) | (_, true, _) => Level::Error,
        (.., true) => Level::Warn,
        _ => Level::Ok,
    }
}

fn values(faults: &Value) -> Vec<KeyValue> {
    let plain = ["drive", "ticks", "refused_ticks", "cut_out"].into_iter();
    let plain = plain.filter_map(|key| {
        let found = faults.get(key).filter(|found| !found.is_null())?;
        Some(KeyValue { key: key.to_owned(), value: text(Some(found)) })
    });
    let first = faults.get("first_fault").filter(|first| !first.is_null()).map(|first| {
        let value = format!("tick {}: {}", text(first.get("tick")), text(first.get("reason")));
        KeyValue { key: "first_fault".to_owned(), value }
    });
    let findings = faults.get("findings").and_then(Value::as_array).into_iter().flatten();
    let findings =
        findings.map(|finding| KeyValue { key: "finding".to_owned(), value: text(finding.get("text")) });
    plain.chain(first).chain(findings).collect()
}

/// A value without the quotes of JSON.
fn text(value: Option<&Value>) -> String {
    match value {
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
        None => String::new(),
    }
}

fn header(now: SystemTime) -> Header {
    let since = now.duration_since(SystemTime::UNIX_EPOCH).unwrap_or(Duration::ZERO);
    // ROS 2 counts seconds in 31 bits, as long as they last.
    let stamp =
        Time { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() };
    Header { stamp, frame_id: "" }
}

fn cdr(message: &impl Serialize) -> Option<Vec<u8>> {
    // The messages are made of what CDR has.
    let body = cdr_encoding::to_vec::<_, LittleEndian>(message).ok()?;
    Some([LITTLE_ENDIAN.as_slice(), &body].concat())
}
