//! Messages of ROS 2 in CDR, with the fields of their definitions.

use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde_json::Value;

use crate::cdr;
use crate::connect::{SubscribedSignal, SubscriptionRow};

/// A message type: its DDS name and the hash of its definition (REP 2016).
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

/// Level of a `DiagnosticStatus`.
#[derive(Debug, Clone, Copy)]
enum Level {
    Ok = 0,
    Warn = 1,
    Error = 2,
    /// The device is unreachable.
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

/// Encodes a row as `JointState`: POSITION, and VELOCITY and FORCE if present, by axis. None without a position.
pub(super) fn joint_state(
    device: &str,
    signals: &[SubscribedSignal],
    row: &SubscriptionRow,
    now: SystemTime,
) -> Option<Vec<u8>> {
    let values = |name: &str| {
        let place = signals.iter().position(|signal| signal.name == name)?;
        let words = |signals: &[SubscribedSignal]| signals.iter().map(|signal| signal.words).sum::<usize>();
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
    cdr::encode(&state)
}

/// Encodes the output of `dimsart connect PORT faults --json` as `DiagnosticArray`, or why the device is unreachable.
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
    cdr::encode(&DiagnosticArray { header: header(now), status: vec![status] })
}

/// An existing fault is an error, an earlier fault a warning.
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
    // ROS 2 counts seconds in 31 bits.
    let stamp =
        Time { sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX), nanosec: since.subsec_nanos() };
    Header { stamp, frame_id: "" }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use dimsart_core::Format;

    const SINCE: Duration = Duration::new(1_700_000_000, 250_000_000);

    fn now() -> SystemTime {
        SystemTime::UNIX_EPOCH + SINCE
    }

    fn hexadecimal(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn signals(named: &[(&str, usize)]) -> Vec<SubscribedSignal> {
        named.iter().map(|(name, words)| SubscribedSignal::new(name, "rad", *words, Format::F32)).collect()
    }

    /// Expected bytes: encoded by `rosbags` 0.11.
    #[test]
    fn a_joint_state_has_the_bytes_that_another_writer_gives_it() {
        let arm = signals(&[("DES_FORCE", 2), ("POSITION", 2), ("VELOCITY", 2)]);
        let row = SubscriptionRow { tick: 7, values: vec![9.0, 9.0, 0.5, -1.25, 0.125, 2.0] };
        let message = joint_state("left-arm", &arm, &row, now()).unwrap();
        assert_eq!(
            hexadecimal(&message),
            "0001000000f1536580b2e60e0100000000000000020000000b0000006c6566742d61726d5f3000000b000000\
         6c6566742d61726d5f31000002000000000000000000e03f000000000000f4bf020000000000000000000000\
         0000c03f000000000000004000000000"
        );
        let axis = signals(&[("POSITION", 1), ("FORCE", 1)]);
        let row = SubscriptionRow { tick: 7, values: vec![0.5, 3.0] };
        let message = joint_state("axis", &axis, &row, now()).unwrap();
        assert_eq!(
            hexadecimal(&message),
            "0001000000f1536580b2e60e0100000000000000010000000500000061786973000000000100000000000000\
         000000000000e03f00000000010000000000000000000840"
        );
        assert_eq!(joint_state("motor", &signals(&[("FORCE", 1)]), &row, now()), None);
    }

    /// As above.
    #[test]
    fn diagnostics_have_the_bytes_that_another_writer_gives_them() {
        let faults = json!({
            "state": "the device is NOT commanded: \"x\"", "ticks": 1000, "refused_ticks": 2, "drive": "fault",
            "cut_out": null, "first_fault": {"tick": 17, "reason": "word 0 of POSITION is not a finite number"},
            "faults": 0, "findings": [{"is_fault": false, "text": "FORCE is a tick old"}],
        });
        assert_eq!(
            hexadecimal(&diagnostics("left-arm", Ok(&faults), now()).unwrap()),
            "0001000000f1536580b2e60e01000000000000000100000001000000090000006c6566742d61726d00000000\
         2100000074686520646576696365206973204e4f5420636f6d6d616e6465643a202278220000000009000000\
         6c6566742d61726d0000000005000000060000006472697665000000060000006661756c7400000006000000\
         7469636b730000000500000031303030000000000e000000726566757365645f7469636b7300000002000000\
         320000000c00000066697273745f6661756c7400330000007469636b2031373a20776f72642030206f662050\
         4f534954494f4e206973206e6f7420612066696e697465206e756d62657200000800000066696e64696e6700\
         14000000464f5243452069732061207469636b206f6c6400"
        );
        assert_eq!(
            hexadecimal(&diagnostics("left-arm", Err("no answer"), now()).unwrap()),
            "0001000000f1536580b2e60e01000000000000000100000003000000090000006c6566742d61726d00000000\
         0a0000006e6f20616e73776572000000090000006c6566742d61726d0000000000000000"
        );
    }

    #[test]
    fn what_is_to_be_repaired_is_an_error_and_what_was_once_a_warning() {
        let of = |faults, cut_out, first| {
            level(&json!({"faults": faults, "cut_out": cut_out, "first_fault": first})) as u8
        };
        assert_eq!(of(0, Value::Null, Value::Null), 0);
        assert_eq!(of(0, Value::Null, json!({"tick": 1})), 1);
        assert_eq!(of(0, json!("PDCTRL_MOD failed"), json!({"tick": 1})), 2);
        assert_eq!(of(1, Value::Null, Value::Null), 2);
    }
}
