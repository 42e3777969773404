//! Reading of a joint whose drive is on a bus.

use crate::JointFault;

/// Reading of a joint in a tick; all NaN without data. `Fault` is the fault type of the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveReading<Fault = JointFault> {
    /// Position of the output, `rad`, not wrapped.
    pub position_rad: f32,
    /// Velocity of the output, `rad/s`.
    pub velocity_rad_per_s: f32,
    /// Torque at the output from the measured currents, `N m`.
    pub torque_nm: f32,
    /// Supply voltage, `V`.
    pub voltage_v: f32,
    /// Temperature of the drive, `°C`.
    pub temperature_c: f32,
    /// Fault or active limit.
    pub fault: Option<Fault>,
}

impl<Fault> DriveReading<Fault> {
    /// Reading without data.
    pub(crate) const NOTHING: Self = Self {
        position_rad: f32::NAN,
        velocity_rad_per_s: f32::NAN,
        torque_nm: f32::NAN,
        voltage_v: f32::NAN,
        temperature_c: f32::NAN,
        fault: None,
    };
}

impl<Fault: Copy + Into<u32>> DriveReading<Fault> {
    /// Returns the fault number in a signal; 0 for none.
    #[must_use]
    pub fn fault(&self) -> f32 {
        self.fault.map_or(0.0, |fault| fault.into() as f32)
    }
}

impl<Fault: Into<JointFault>> DriveReading<Fault> {
    /// Converts to a reading independent of the drive type.
    #[must_use]
    pub fn into_drive_reading(self) -> DriveReading {
        let Self { position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, fault } = self;
        let fault = fault.map(Into::into);
        DriveReading { position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, fault }
    }
}
