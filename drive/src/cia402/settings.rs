//! Settings of a joint and its host.

use super::Cia402Node;

/// Nodes, units and timing of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cia402Settings {
    /// Node of the drive.
    pub node: Cia402Node,
    /// Node of the controller.
    pub host: Cia402Node,
    /// Counts of objects 6064 and 606C per turn of the motor, > 0.
    pub counts_per_turn: f32,
    /// Motor turns per output turn, not 0; negative for opposite directions.
    pub gear_ratio: f32,
    /// Tick of the controller, `s`, > 0.
    pub tick_s: f32,
    /// Heartbeat timeout, `s`, 0.004 to 60: the drive turns itself off, and the controller treats it as lost.
    pub timeout_s: f32,
    /// Consecutive ticks in which the drive may be silent, at most 254.
    pub missing_ticks: u8,
}

impl Cia402Settings {
    /// Returns [`timeout_s`](Self::timeout_s) in milliseconds.
    pub(super) fn timeout_ms(&self) -> u16 {
        whole(1e3 * self.timeout_s)
    }

    /// Returns the heartbeat period, a quarter of the timeout: single losses are tolerated.
    pub(super) fn heartbeat_ms(&self) -> u16 {
        (self.timeout_ms() / 4).max(1)
    }

    pub(super) fn timeout_ticks(&self) -> u16 {
        whole(self.timeout_s / self.tick_s).saturating_add(1)
    }

    pub(super) fn heartbeat_ticks(&self) -> u16 {
        whole(1e-3 * f32::from(self.heartbeat_ms()) / self.tick_s).max(1)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
fn whole(number: f32) -> u16 {
    (number + 0.5) as u16
}
