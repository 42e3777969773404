//! `[device.cia402]`: CiA 402 drives and their bus.

use drive::{Cia402Host, Cia402Joint, Cia402Node, Cia402Settings, DriveReading};
use serde::{Deserialize, Serialize};

use super::common::{
    Absence, BusParameters, DriveNode, InjectedFault, bits_per_s, check, missing_ticks, reply_delay_s,
    timeout_s,
};
use super::{DriveBus, classic};
use crate::bus::can::{CanFrame, Format, Identifier};
use crate::plant::{Cia402Drive, Joint};

/// Ticks of setup: for all requests, and for data sent with every tenth SYNC only.
const PREPARING_TICKS: u32 = 200;

/// `[device.cia402]`: the drives of a device's axes, and their bus.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Cia402Parameters {
    /// Node id of the drive of each axis, 1 to 127.
    pub nodes: Vec<u8>,
    /// Node id of the controller, 1 to 127.
    #[serde(default = "host")]
    pub host: u8,
    /// Encoder counts per motor turn.
    #[serde(default = "counts_per_turn")]
    pub counts_per_turn: f32,
    /// Motor turns per output turn, nonzero; negative if the directions differ.
    #[serde(default = "one")]
    pub gear_ratio: f32,
    /// Rated torque of a motor, `N m`; the maximum is three times this.
    #[serde(default = "one")]
    pub rated_torque_nm: f32,
    /// Timeout of heartbeats, in both directions, `s`.
    #[serde(default = "timeout_s")]
    pub timeout_s: f32,
    /// Maximum consecutive ticks without a reply of a drive.
    #[serde(default = "missing_ticks")]
    pub missing_ticks: u8,
    /// Time from SYNC to the queued reply, `s`.
    #[serde(default = "reply_delay_s")]
    pub reply_delay_s: f64,
    /// Bit rate.
    #[serde(default = "bits_per_s")]
    pub bits_per_s: u32,
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

fn host() -> u8 {
    127
}

fn counts_per_turn() -> f32 {
    65_536.0
}

fn one() -> f32 {
    1.0
}

/// Maximum torque of a drive over its rated torque (object 6072).
const MAX_OVERLOAD: f64 = 3.0;

impl Cia402Parameters {
    /// Returns the maximum torque of a drive at the output, `N m`.
    #[must_use]
    pub fn max_torque_nm(&self) -> f64 {
        MAX_OVERLOAD * f64::from(self.rated_torque_nm) * f64::from(self.gear_ratio)
    }

    /// Creates the bus with its drives, set up and at rest with their joints, for ticks of `tick_s`. `seed`
    /// determines bit errors.
    #[must_use]
    pub fn build(&self, joints: Vec<Joint>, tick_s: f64, seed: u64) -> DriveBus {
        let settings = |node: u8| {
            #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
            let tick_s = tick_s as f32;
            Some(Cia402Settings {
                node: Cia402Node::new(node)?,
                host: Cia402Node::new(self.host)?,
                counts_per_turn: self.counts_per_turn,
                gear_ratio: self.gear_ratio,
                tick_s,
                timeout_s: self.timeout_s,
                missing_ticks: self.missing_ticks,
            })
        };
        let drives = self.nodes.iter().filter_map(|node| {
            let settings = settings(*node)?;
            let [counts, gear_ratio, rated_nm] =
                [self.counts_per_turn, self.gear_ratio, self.rated_torque_nm].map(f64::from);
            let drive = Cia402Drive::new(*node, counts, gear_ratio, rated_nm);
            let control = Cia402Joint::new(&settings);
            Some(Box::new(Cia402 { control, drive, settings }) as Box<dyn DriveNode>)
        });
        let host = self
            .nodes
            .first()
            .and_then(|node| settings(*node))
            .map(|into_drive_reading| Cia402Host::new(&into_drive_reading));
        DriveBus::new(self.wires(), drives.zip(joints), host, seed)
    }

    fn wires(&self) -> BusParameters {
        BusParameters::new(
            [self.bits_per_s; 2],
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
        if self.nodes.len() != axes {
            let count = self.nodes.len();
            problems.push(format!("`nodes` has {count} entries for {axes} axes: write one node id per axis"));
        }
        for (place, node) in self.nodes.iter().chain([&self.host]).enumerate() {
            if Cia402Node::new(*node).is_none() {
                problems.push(format!("node id {node} is out of range, must be 1 to 127"));
            }
            if self.nodes.iter().take(place).any(|other| other == node) {
                problems.push(format!("duplicate node id {node}: ids of drives and host must be unique"));
            }
        }
        if !(self.gear_ratio.is_finite() && self.gear_ratio.abs() > 0.0) {
            problems.push(format!("gear_ratio is {}, must be finite and nonzero", self.gear_ratio));
        }
        if !(0.004..=60.0).contains(&self.timeout_s) {
            problems.push(format!("timeout_s is {} s, must be 0.004 s to 60 s", self.timeout_s));
        }
        for (key, value) in [
            ("counts_per_turn", f64::from(self.counts_per_turn)),
            ("rated_torque_nm", f64::from(self.rated_torque_nm)),
            ("bits_per_s", self.bits_per_s.into()),
        ] {
            if !(value.is_finite() && value > 0.0) {
                problems.push(format!("{key} is {value}, must be finite and > 0"));
            }
        }
        check(&self.wires(), axes, &mut problems);
        problems
    }
}

/// A drive, and its driver on a board.
#[derive(Debug)]
struct Cia402 {
    control: Cia402Joint,
    drive: Cia402Drive,
    settings: Cia402Settings,
}

impl DriveNode for Cia402 {
    fn identifiers(&self) -> (Vec<Identifier>, Vec<Identifier>) {
        let Cia402Settings { node, host, .. } = self.settings;
        let by_drive = [
            Cia402Node::NMT_ID,
            Cia402Node::SYNC_ID,
            node.rpdo_id(1),
            node.request_id(),
            host.heartbeat_id(),
        ];
        let pdos = [1, 2, 3].map(|pdo| node.tpdo_id(pdo));
        let by_host = [node.emergency_id(), node.response_id(), node.heartbeat_id()].into_iter().chain(pdos);
        (by_drive.map(Identifier::Standard).to_vec(), by_host.map(Identifier::Standard).collect())
    }

    fn prepare(&mut self) {
        for _ in 0..PREPARING_TICKS {
            if let Some(frame) = self.control.frame(None) {
                self.drive.receive(frame.id(), frame.bytes());
            }
            self.drive.receive(Cia402Node::SYNC_ID, &[]);
            self.drive.advance(self.settings.tick_s.into());
            self.drive.take_frames().for_each(|(id, data)| self.control.receive(id, &data));
            self.control.read();
        }
    }

    fn command(&mut self, torque_nm: Option<f32>) -> Option<CanFrame> {
        classic(&self.control.frame(torque_nm)?)
    }

    fn hear(&mut self, frame: &CanFrame) {
        if let Identifier::Standard(id) = frame.identifier {
            self.control.receive(id, frame.data());
        }
    }

    fn read(&mut self) -> DriveReading {
        self.control.read().into_drive_reading()
    }

    fn obey(&mut self, frame: &CanFrame) {
        if let Identifier::Standard(id) = frame.identifier {
            self.drive.receive(id, frame.data());
        }
    }

    fn sent(&mut self) -> Vec<CanFrame> {
        let frame =
            |(id, data): (u16, Vec<u8>)| CanFrame::new(Identifier::Standard(id), Format::Classic, &data);
        self.drive.take_frames().filter_map(frame).collect()
    }

    fn raise_fault(&mut self, number: u16) {
        self.drive.raise_fault(number);
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
