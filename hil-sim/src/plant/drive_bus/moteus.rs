//! Parameters of moteus drives and their bus in rig files.

use drive::{DriveReading, MoteusAddress, MoteusFrame, MoteusJoint};
use serde::{Deserialize, Serialize};

use super::DriveBus;
use super::common::{
    Absence, BusParameters, DriveNode, InjectedFault, bits_per_s, check, missing_ticks, reply_delay_s,
    timeout_s,
};
use crate::bus::can::{CanFrame, Format, Identifier};
use crate::plant::{Joint, MoteusDrive};

/// `[device.moteus]`: the drives of a device's axes, and their bus.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MoteusParameters {
    /// `id.id` of the drive of each axis, 0 to 126.
    pub ids: Vec<u8>,
    /// Id of the controller on the bus, 0 to 126.
    #[serde(default)]
    pub host: u8,
    /// Timeout of a torque command, `s`.
    #[serde(default = "timeout_s")]
    pub timeout_s: f32,
    /// Maximum consecutive ticks without a reply.
    #[serde(default = "missing_ticks")]
    pub missing_ticks: u8,
    /// Maximum torque of a drive at the output, `N m`.
    #[serde(default = "max_torque_nm")]
    pub max_torque_nm: f64,
    /// Time from the end of a frame to the queued reply, `s`. No value is published: measure your drives.
    #[serde(default = "reply_delay_s")]
    pub reply_delay_s: f64,
    /// Nominal bit rate.
    #[serde(default = "bits_per_s")]
    pub bits_per_s: u32,
    /// Data bit rate.
    #[serde(default = "data_bits_per_s")]
    pub data_bits_per_s: u32,
    /// Probability of a bit error seen by all nodes, 0 to 1.
    #[serde(default)]
    pub bit_error_rate: f64,
    /// Faults reported by drives.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fault: Vec<InjectedFault>,
    /// Times at which a drive or the controller is off the bus. Another node acknowledges frames to an absent drive.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absent: Vec<Absence>,
}

fn max_torque_nm() -> f64 {
    4.0
}

fn data_bits_per_s() -> u32 {
    5_000_000
}

impl MoteusParameters {
    /// Creates the bus with its drives, at rest with their joints. `seed` determines bit errors.
    #[must_use]
    pub fn build(&self, joints: Vec<Joint>, seed: u64) -> DriveBus {
        let drives = self.ids.iter().filter_map(|id| {
            let address = MoteusAddress::new(self.host, *id)?;
            let control = MoteusJoint::new(address, self.timeout_s, self.missing_ticks);
            let drive = MoteusDrive::new(*id, self.max_torque_nm);
            Some(Box::new(Moteus { control, drive, reply: None }) as Box<dyn DriveNode>)
        });
        DriveBus::new(self.wires(), drives.zip(joints), None, seed)
    }

    fn wires(&self) -> BusParameters {
        BusParameters::new(
            [self.bits_per_s, self.data_bits_per_s],
            self.bit_error_rate,
            self.reply_delay_s,
            &self.fault,
            &self.absent,
        )
    }

    /// Returns the errors of its parameters, for a device of `axes` axes.
    #[must_use]
    pub fn problems(&self, axes: usize) -> Vec<String> {
        let mut problems = Vec::new();
        if self.ids.len() != axes {
            problems
                .push(format!("`ids` has {} entries for {axes} axes: write one id per axis", self.ids.len()));
        }
        for (place, id) in self.ids.iter().enumerate() {
            if MoteusAddress::new(self.host, *id).is_none() {
                let host = self.host;
                problems.push(format!(
                    "drive id {id} is invalid with host id {host}: ids must be 0 to 126 and unique"
                ));
            }
            if self.ids.iter().take(place).any(|other| other == id) {
                problems.push(format!("duplicate drive id {id}: ids must be unique"));
            }
        }
        let positive = [
            ("timeout_s", f64::from(self.timeout_s)),
            ("max_torque_nm", self.max_torque_nm),
            ("bits_per_s", self.bits_per_s.into()),
            ("data_bits_per_s", self.data_bits_per_s.into()),
        ];
        for (key, value) in positive.into_iter().filter(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            problems.push(format!("{key} is {value}, must be finite and > 0"));
        }
        if self.fault.iter().any(|fault| fault.number > 255) {
            problems.push("fault number is out of range, must be 0 to 255".to_owned());
        }
        check(&self.wires(), axes, &mut problems);
        problems
    }
}

/// A drive, and its driver on a board.
#[derive(Debug)]
struct Moteus {
    control: MoteusJoint,
    drive: MoteusDrive,
    reply: Option<CanFrame>,
}

impl DriveNode for Moteus {
    fn identifiers(&self) -> (Vec<Identifier>, Vec<Identifier>) {
        let address = self.control.address();
        (vec![Identifier::Extended(address.command_id())], vec![Identifier::Extended(address.reply_id())])
    }

    fn prepare(&mut self) {
        let query = frame(self.control.address().command_id(), MoteusFrame::query().bytes());
        query.iter().for_each(|query| self.obey(query));
        self.sent().iter().for_each(|reply| self.hear(reply));
    }

    fn command(&mut self, torque_nm: Option<f32>) -> Option<CanFrame> {
        frame(self.control.address().command_id(), self.control.frame(torque_nm).bytes())
    }

    fn hear(&mut self, frame: &CanFrame) {
        // An empty reply counts as missing.
        let _ = self.control.receive(raw(frame.identifier), frame.data());
    }

    fn read(&mut self) -> DriveReading {
        self.control.read().into_drive_reading()
    }

    fn obey(&mut self, asked: &CanFrame) {
        let reply = self.drive.receive(raw(asked.identifier), asked.data());
        self.reply = reply.and_then(|(id, data)| frame(id, &data));
    }

    fn sent(&mut self) -> Vec<CanFrame> {
        self.reply.take().into_iter().collect()
    }

    fn raise_fault(&mut self, number: u16) {
        self.drive.raise_fault(u8::try_from(number).unwrap_or(u8::MAX));
    }

    fn set_state(&mut self, position_rad: f64, velocity_rad_per_s: f64) {
        self.drive.set_state(position_rad, velocity_rad_per_s);
    }

    fn torque_nm(&self) -> f64 {
        self.drive.torque_nm()
    }

    fn time_to_timeout_s(&self) -> Option<f64> {
        self.drive.time_to_timeout_s()
    }

    fn advance(&mut self, period_s: f64) {
        self.drive.advance(period_s);
    }
}

fn frame(id: u32, data: &[u8]) -> Option<CanFrame> {
    CanFrame::new(Identifier::Extended(id), Format::Fd, data)
}

fn raw(identifier: Identifier) -> u32 {
    match identifier {
        Identifier::Standard(base) => base.into(),
        Identifier::Extended(all) => all,
    }
}
