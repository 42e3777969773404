//! What drives of every kind have in common on a bus, and what a rig file says of it.

use drive::DriveReading;
use serde::{Deserialize, Serialize};

use super::QUEUE_FRAMES;
use crate::bus::can::{CanFrame, CanParameters, Identifier};

/// A drive, and its joint on the controller's side.
pub(super) trait OnBus: core::fmt::Debug + Send {
    /// What the drive listens for, and what the controller does.
    fn identifiers(&self) -> (Vec<Identifier>, Vec<Identifier>);
    /// Before the first tick, whatever the wires: the controller knows the drive, which is at rest.
    fn prepare(&mut self);

    /// The controller's frame, if there is any.
    fn command(&mut self, torque_nm: Option<f32>) -> Option<CanFrame>;
    /// What comes to the controller.
    fn hear(&mut self, frame: &CanFrame);
    fn read(&mut self) -> DriveReading;

    /// What comes to the drive.
    fn obey(&mut self, frame: &CanFrame);
    /// What the drive has to send.
    fn sent(&mut self) -> Vec<CanFrame>;
    fn raise_fault(&mut self, number: u16);
    fn set_state(&mut self, position_rad: f64, velocity_rad_per_s: f64);
    fn torque_nm(&self) -> f64;
    /// Time until the torque goes by itself.
    fn left_s(&self) -> Option<f64>;
    fn advance(&mut self, period_s: f64);
}

/// A bus, and what goes wrong on it.
#[derive(Debug)]
pub(super) struct Wires {
    pub(super) can: CanParameters,
    pub(super) reply_delay_s: f64,
    pub(super) fault: Vec<FoundFault>,
    pub(super) absent: Vec<Absence>,
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
    pub number: u16,
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

pub(super) fn timeout_s() -> f32 {
    0.02
}

pub(super) fn missing_ticks() -> u8 {
    3
}

pub(super) fn reply_delay_s() -> f64 {
    2e-5
}

pub(super) fn bits_per_s() -> u32 {
    1_000_000
}

/// What is wrong with them, for a device of so many axes.
pub(super) fn check(wires: &Wires, axes: usize, problems: &mut Vec<String>) {
    if !(1e-6..=1e-3).contains(&wires.reply_delay_s) {
        problems.push(format!("reply_delay_s is {}: give it 0.000001 to 0.001", wires.reply_delay_s));
    }
    if !(0.0..=1.0).contains(&wires.can.bit_error_rate) {
        problems.push(format!("bit_error_rate is {}: give it 0 to 1", wires.can.bit_error_rate));
    }
    let named = wires.fault.iter().map(|fault| fault.axis);
    let named = named.chain(wires.absent.iter().filter_map(|absence| absence.axis));
    for axis in named.filter(|axis| *axis >= axes) {
        problems.push(format!("a fault or an absence of axis {axis}: there are {axes}, from 0"));
    }
}

impl Wires {
    /// At these bit rates, the nominal one first; nobody that was driven off joins the bus again.
    pub(super) fn new(
        [bits_per_s, data_bits_per_s]: [u32; 2],
        bit_error_rate: f64,
        reply_delay_s: f64,
        fault: &[FoundFault],
        absent: &[Absence],
    ) -> Self {
        let can = CanParameters {
            bits_per_s,
            data_bits_per_s,
            bit_error_rate,
            rejoins: 0,
            queue_frames: QUEUE_FRAMES,
        };
        Self { can, reply_delay_s, fault: fault.to_vec(), absent: absent.to_vec() }
    }

    pub(super) fn is_absent(&self, axis: Option<usize>, now_s: f64) -> bool {
        let mut its = self.absent.iter().filter(|absence| absence.axis == axis);
        its.any(|absence| (absence.from_s..absence.until_s).contains(&now_s))
    }
}
