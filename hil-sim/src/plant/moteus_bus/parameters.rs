//! What a rig file says of moteus drives and their bus.

use drive::MoteusAddress;
use serde::{Deserialize, Serialize};

/// `[device.moteus]`: the drives of a device's axes, and the bus that they are on.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MoteusParameters {
    /// `id.id` of each axis' drive, 0 to 126.
    pub ids: Vec<u8>,
    /// Number of the controller on the bus, 0 to 126.
    #[serde(default)]
    pub host: u8,
    /// Time for which a drive holds a torque if no other comes, `s`.
    #[serde(default = "timeout_s")]
    pub timeout_s: f32,
    /// Ticks in a row in which a reply may be missing.
    #[serde(default = "missing_ticks")]
    pub missing_ticks: u8,
    /// Of every drive, at the output, `N m`.
    #[serde(default = "most_torque_nm")]
    pub most_torque_nm: f64,
    /// From a frame's end to when the reply waits for the bus, `s`. None is published: look at your drives'.
    #[serde(default = "reply_delay_s")]
    pub reply_delay_s: f64,
    /// Nominal bit rate.
    #[serde(default = "bits_per_s")]
    pub bits_per_s: u32,
    /// Bit rate of the data.
    #[serde(default = "data_bits_per_s")]
    pub data_bits_per_s: u32,
    /// Share of the bits that all nodes see wrong, 0 to 1.
    #[serde(default)]
    pub bit_error_rate: f64,
    /// Faults that drives find.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fault: Vec<FoundFault>,
    /// Who is off the bus, and when. What is sent to a drive that is not there is acknowledged by somebody else.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absent: Vec<Absence>,
}

/// A fault that a drive finds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FoundFault {
    /// Whose.
    pub axis: usize,
    /// In the tick that begins then, `s`.
    pub at_s: f64,
    /// As the drive has it.
    pub number: u8,
}

/// A time in which somebody neither sends nor receives.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Absence {
    /// Whose drive; without one, the controller.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<usize>,
    /// From the tick that begins then, `s`.
    pub from_s: f64,
    /// To the tick that begins then, `s`.
    pub until_s: f64,
}

fn timeout_s() -> f32 {
    0.02
}

fn missing_ticks() -> u8 {
    3
}

fn most_torque_nm() -> f64 {
    4.0
}

fn reply_delay_s() -> f64 {
    2e-5
}

fn bits_per_s() -> u32 {
    1_000_000
}

fn data_bits_per_s() -> u32 {
    5_000_000
}

impl MoteusParameters {
    /// What is wrong with it, for a device of so many axes.
    #[must_use]
    pub fn problems(&self, axes: usize) -> Vec<String> {
        let mut problems = Vec::new();
        if self.ids.len() != axes {
            problems.push(format!("ids has {} entries: give it one for each of {axes} axes", self.ids.len()));
        }
        for (place, id) in self.ids.iter().enumerate() {
            if MoteusAddress::new(self.host, *id).is_none() {
                let host = self.host;
                problems.push(format!("id {id} with host {host}: give them 0 to 126, and not the same"));
            }
            if self.ids.iter().take(place).any(|other| other == id) {
                problems.push(format!("id {id} is there twice: give each drive its own"));
            }
        }
        let positive = [
            ("timeout_s", f64::from(self.timeout_s)),
            ("most_torque_nm", self.most_torque_nm),
            ("bits_per_s", self.bits_per_s.into()),
            ("data_bits_per_s", self.data_bits_per_s.into()),
        ];
        for (key, value) in positive.into_iter().filter(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            problems.push(format!("{key} is {value}: give it a number > 0"));
        }
        if !(1e-6..=1e-3).contains(&self.reply_delay_s) {
            problems.push(format!("reply_delay_s is {}: give it 0.000001 to 0.001", self.reply_delay_s));
        }
        if !(0.0..=1.0).contains(&self.bit_error_rate) {
            problems.push(format!("bit_error_rate is {}: give it 0 to 1", self.bit_error_rate));
        }
        let named = self.fault.iter().map(|fault| fault.axis);
        let named = named.chain(self.absent.iter().filter_map(|absence| absence.axis));
        for axis in named.filter(|axis| *axis >= axes) {
            problems.push(format!("a fault or an absence of axis {axis}: there are {axes}, from 0"));
        }
        problems
    }

    pub(super) fn is_absent(&self, axis: Option<usize>, now_s: f64) -> bool {
        let mut its = self.absent.iter().filter(|absence| absence.axis == axis);
        its.any(|absence| (absence.from_s..absence.until_s).contains(&now_s))
    }
}
