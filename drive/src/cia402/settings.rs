//! What a joint and its host have to know.

use super::Cia402Node;

/// A drive, who commands it, and in what it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cia402Settings {
    /// The drive's.
    pub node: Cia402Node,
    /// The controller's own.
    pub host: Cia402Node,
    /// Of the objects 6064 and 606C, for one turn of the motor, > 0.
    pub counts_per_turn: f32,
    /// Turns of the motor for one of the output, not 0; below 0 where they turn against each other.
    pub gear_ratio: f32,
    /// Of the controller, `s`, > 0.
    pub tick_s: f32,
    /// Without a heartbeat for so long a drive turns itself off, and is taken for lost, `s`, 0.004 to 60.
    pub timeout_s: f32,
    /// Ticks in a row in which a drive may say nothing, 254 at most.
    pub missing_ticks: u8,
}

impl Cia402Settings {
    /// [`timeout_s`](Self::timeout_s) as drives have it.
    pub(super) fn timeout_ms(&self) -> u16 {
        whole(1e3 * self.timeout_s)
    }

    /// Between two heartbeats: so one that is lost is no loss.
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
