//! What a joint shows whose drive is on a bus.

use crate::DriveTrouble;

/// A joint in a tick, all NaN where it shows nothing. Its `Trouble` is that of a kind of drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveReading<Trouble = DriveTrouble> {
    /// Of the output, `rad`; not wrapped.
    pub position_rad: f32,
    /// Of the output, `rad/s`.
    pub velocity_rad_per_s: f32,
    /// By the measured currents, at the output, `N m`.
    pub torque_nm: f32,
    /// Of the supply, `V`.
    pub voltage_v: f32,
    /// Of the drive's board, `°C`.
    pub temperature_c: f32,
    /// What is wrong with it, or limits it.
    pub trouble: Option<Trouble>,
}

impl<Trouble> DriveReading<Trouble> {
    /// Of a joint that shows nothing.
    pub(crate) const NOTHING: Self = Self {
        position_rad: f32::NAN,
        velocity_rad_per_s: f32::NAN,
        torque_nm: f32::NAN,
        voltage_v: f32::NAN,
        temperature_c: f32::NAN,
        trouble: None,
    };
}

impl<Trouble: Copy + Into<u32>> DriveReading<Trouble> {
    /// The number of its trouble as a signal has it; 0 for none.
    #[must_use]
    pub fn fault(&self) -> f32 {
        self.trouble.map_or(0.0, |trouble| trouble.into() as f32)
    }
}

impl<Trouble: Into<DriveTrouble>> DriveReading<Trouble> {
    /// The same, whatever kind of drive it is.
    #[must_use]
    pub fn of_any(self) -> DriveReading {
        let Self { position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, trouble } = self;
        let trouble = trouble.map(Into::into);
        DriveReading { position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, trouble }
    }
}
