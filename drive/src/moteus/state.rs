//! State reported by a drive.

use core::f32::consts::TAU;

use super::register::{FAULT, MODE, POSITION, TEMPERATURE, TORQUE, VELOCITY, VOLTAGE};
use super::reply::{Value, read};
use super::{MoteusFault, MoteusMode, MoteusReplyError};

/// State of a drive in its reply. Unknown quantities are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoteusState {
    /// Mode.
    pub mode: MoteusMode,
    /// Position of the output, `rad`, not wrapped.
    pub position_rad: f32,
    /// Velocity of the output, `rad/s`.
    pub velocity_rad_per_s: f32,
    /// Torque at the output from the measured currents, `N m`.
    pub torque_nm: f32,
    /// Supply voltage, `V`, in steps of 0.5 V up to 63.5 V.
    pub voltage_v: f32,
    /// Board temperature, `°C`, in steps of 1 °C up to 127 °C.
    pub temperature_c: f32,
    /// Fault or active limit.
    pub fault: Option<MoteusFault>,
}

impl MoteusState {
    /// Decodes the reply to a [`MoteusFrame`](crate::MoteusFrame); ignores registers that were not queried.
    ///
    /// # Errors
    /// Returns [`MoteusReplyError`] with the first error.
    pub fn from_reply(reply: &[u8]) -> Result<Self, MoteusReplyError> {
        let [mut mode, mut position, mut velocity, mut torque] = [None; 4];
        let [mut voltage, mut temperature, mut fault] = [None; 3];
        read(reply, |register, value| {
            let place = match u8::try_from(register) {
                Ok(MODE) => &mut mode,
                Ok(POSITION) => &mut position,
                Ok(VELOCITY) => &mut velocity,
                Ok(TORQUE) => &mut torque,
                Ok(VOLTAGE) => &mut voltage,
                Ok(TEMPERATURE) => &mut temperature,
                Ok(FAULT) => &mut fault,
                _ => return,
            };
            *place = Some(value);
        })?;
        Ok(Self {
            mode: MoteusMode::from_number(whole(mode, MODE)?),
            position_rad: TAU * scaled(position, POSITION, [1e-2, 1e-4, 1e-5])?,
            velocity_rad_per_s: TAU * scaled(velocity, VELOCITY, [0.1, 2.5e-4, 1e-5])?,
            torque_nm: scaled(torque, TORQUE, [0.5, 1e-2, 1e-3])?,
            voltage_v: scaled(voltage, VOLTAGE, [0.5, 0.1, 1e-3])?,
            temperature_c: scaled(temperature, TEMPERATURE, [1.0, 0.1, 1e-3])?,
            fault: MoteusFault::from_number(whole(fault, FAULT)?),
        })
    }
}

/// Scales a value by the step of an 8, 16 or 32-bit integer; the minimum integer is NaN.
fn scaled(
    value: Option<Value>,
    register: u8,
    [step8, step16, step32]: [f32; 3],
) -> Result<f32, MoteusReplyError> {
    Ok(match value.ok_or(MoteusReplyError::Missing { register })? {
        Value::Int8(i8::MIN) | Value::Int16(i16::MIN) | Value::Int32(i32::MIN) => f32::NAN,
        Value::Int8(steps) => f32::from(steps) * step8,
        Value::Int16(steps) => f32::from(steps) * step16,
        Value::Int32(steps) => steps as f32 * step32,
        Value::Float(value) => value,
    })
}

fn whole(value: Option<Value>, register: u8) -> Result<u8, MoteusReplyError> {
    let number = match value.ok_or(MoteusReplyError::Missing { register })? {
        Value::Int8(number) => u8::try_from(number).ok(),
        Value::Int16(number) => u8::try_from(number).ok(),
        Value::Int32(number) => u8::try_from(number).ok(),
        // Not queried as a float.
        Value::Float(_) => None,
    };
    number.ok_or(MoteusReplyError::NotAnInteger { register })
}
