//! Common interface of drives on a bus, and common parameters of rig files.

use drive::DriveReading;
use serde::{Deserialize, Serialize};

use super::QUEUE_FRAMES;
use crate::bus::can::{CanFrame, CanParameters, Identifier};
use crate::plant::parameter::valid_axes;

/// A drive, and its driver on the controller.
pub(super) trait DriveNode: core::fmt::Debug + Send {
    /// Identifiers received by the drive and by the controller.
    fn identifiers(&self) -> (Vec<Identifier>, Vec<Identifier>);
    /// Sets up the drive before the first tick, independent of the bus: known to the controller and at rest.
    fn prepare(&mut self);

    /// Returns the controller's frame, if any.
    fn command(&mut self, torque_nm: Option<f32>) -> Option<CanFrame>;
    /// Receives a frame on the controller.
    fn hear(&mut self, frame: &CanFrame);
    fn read(&mut self) -> DriveReading;

    /// Receives a frame on the drive.
    fn obey(&mut self, frame: &CanFrame);
    /// Returns the drive's frames to send.
    fn sent(&mut self) -> Vec<CanFrame>;
    fn raise_fault(&mut self, number: u16);
    fn set_state(&mut self, position_rad: f64, velocity_rad_per_s: f64);
    fn torque_nm(&self) -> f64;
    /// Returns the time until the torque times out.
    fn time_to_timeout_s(&self) -> Option<f64>;
    fn advance(&mut self, period_s: f64);
}

/// A bus with its faults.
#[derive(Debug)]
pub(super) struct BusParameters {
    pub(super) can: CanParameters,
    pub(super) reply_delay_s: f64,
    pub(super) fault: Vec<InjectedFault>,
    pub(super) absent: Vec<Absence>,
}

/// A fault reported by a drive.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct InjectedFault {
    /// Axis.
    pub axis: usize,
    /// Tick start time of the fault, `s`.
    pub at_s: f64,
    /// Fault number of the drive.
    pub number: u16,
}

/// An absence from the bus.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Absence {
    /// Axis of the drive; `None` for the controller.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<usize>,
    /// From the tick that starts then, `s`.
    pub from_s: f64,
    /// Until the tick that starts then, `s`.
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

/// Returns the errors of the parameters, for a device of `axes` axes.
pub(super) fn check(wires: &BusParameters, axes: usize, problems: &mut Vec<String>) {
    if !(1e-6..=1e-3).contains(&wires.reply_delay_s) {
        problems.push(format!("reply_delay_s is {} s, must be 0.000001 s to 0.001 s", wires.reply_delay_s));
    }
    if !(0.0..=1.0).contains(&wires.can.bit_error_rate) {
        problems.push(format!("bit_error_rate is {}, must be 0 to 1", wires.can.bit_error_rate));
    }
    let named = wires.fault.iter().map(|fault| fault.axis);
    let named = named.chain(wires.absent.iter().filter_map(|absence| absence.axis));
    for axis in named.filter(|axis| *axis >= axes) {
        problems.push(format!("`fault` or `absent`: axis {axis} is out of range: {}", valid_axes(axes)));
    }
}

impl BusParameters {
    /// Creates a bus with nominal and data bit rate; bus-off nodes do not recover.
    pub(super) fn new(
        [bits_per_s, data_bits_per_s]: [u32; 2],
        bit_error_rate: f64,
        reply_delay_s: f64,
        fault: &[InjectedFault],
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
