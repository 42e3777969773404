//! moteus drive (mjbots) on its CAN FD bus, with an ideal torque source.
//!
//! Implements `docs/protocol/can.md` and `docs/protocol/registers.md` of <https://github.com/mjbots/moteus>, and the
//! firmware's behaviour otherwise: writing the mode first resets the rest of a command; a frame is executed after its
//! reply, up to a truncated end; frames without a mode do not reset the watchdog.
//!
//! Supported states: stopped, position mode, timeout and fault; other modes are refused. After a timeout it is
//! free-running (`servo.timeout_mode` 0); a drive as delivered brakes.

use core::f64::consts::TAU;
use core::ops::Range;

const MODE_STOPPED: u8 = 0;
const MODE_FAULT: u8 = 1;
const MODE_POSITION: u8 = 10;
const MODE_TIMEOUT: u8 = 11;
/// Limited by the maximum current.
const LIMITED_BY_CURRENT: u8 = 99;

/// Default of `servo.default_timeout_s`.
const DEFAULT_TIMEOUT_S: f64 = 0.1;
/// Gains of the position controller, per turn, without integral part.
const PROPORTIONAL_NM: f64 = 4.0;
const DERIVATIVE_NM_S: f64 = 0.05;

/// Registers 0x020 to 0x02b after the mode was written: position, velocity, torque, scales of the proportional and
/// derivative parts, two others, timeout, and four more.
const UNSPECIFIED: [f64; 12] =
    [0.0, 0.0, 0.0, 1.0, 1.0, f64::NAN, f64::NAN, 0.0, f64::NAN, f64::NAN, f64::NAN, 1.0];

/// A mode and its registers 0x020 to 0x02b.
type Command = (u8, [f64; 12]);

/// A drive on a bus.
#[derive(Debug, Clone)]
pub struct MoteusDrive {
    id: u8,
    max_torque_nm: f64,
    mode: u8,
    fault: u8,
    command: [f64; 12],
    since_command_s: f64,
    position_turns: f64,
    velocity_turns_per_s: f64,
}

impl MoteusDrive {
    /// Creates a stopped drive with its `id` at 0 rad and a maximum torque of `max_torque_nm`.
    #[must_use]
    pub fn new(id: u8, max_torque_nm: f64) -> Self {
        Self {
            id,
            max_torque_nm,
            mode: MODE_STOPPED,
            fault: 0,
            command: UNSPECIFIED,
            since_command_s: 0.0,
            position_turns: 0.0,
            velocity_turns_per_s: 0.0,
        }
    }

    /// Sets the output to the position and velocity of the plant.
    pub fn set_state(&mut self, position_rad: f64, velocity_rad_per_s: f64) {
        (self.position_turns, self.velocity_turns_per_s) = (position_rad / TAU, velocity_rad_per_s / TAU);
    }

    /// Triggers a fault, which disables the drive until a stop command.
    pub fn raise_fault(&mut self, number: u8) {
        (self.mode, self.fault) = (MODE_FAULT, number);
    }

    /// Returns the torque at the output, `N m`.
    #[must_use]
    pub fn torque_nm(&self) -> f64 {
        let (wanted_nm, max_nm) = (self.wanted_nm(), self.max_torque_nm);
        if wanted_nm.abs() > max_nm { max_nm.copysign(wanted_nm) } else { wanted_nm }
    }

    /// Advances time.
    pub fn advance(&mut self, period_s: f64) {
        if self.mode != MODE_POSITION {
            return;
        }
        self.since_command_s += period_s;
        if self.since_command_s >= self.timeout_s() {
            self.mode = MODE_TIMEOUT;
        }
    }

    /// Returns the time until its timeout, `s`; `None` if inactive or without a timeout.
    #[must_use]
    pub fn time_to_timeout_s(&self) -> Option<f64> {
        let time_to_timeout_s = self.timeout_s() - self.since_command_s;
        (self.mode == MODE_POSITION && !time_to_timeout_s.is_nan()).then_some(time_to_timeout_s.max(0.0))
    }

    /// NaN: no timeout.
    fn timeout_s(&self) -> f64 {
        match self.command[7] {
            timeout_s if timeout_s.abs() <= 0.0 => DEFAULT_TIMEOUT_S,
            timeout_s => timeout_s,
        }
    }

    /// Receives a frame; returns arbitration id and data of the reply, if requested and not empty.
    pub fn receive(&mut self, arbitration_id: u32, mut bytes: &[u8]) -> Option<(u32, Vec<u8>)> {
        let [destination, source, 0, 0] = arbitration_id.to_le_bytes() else { return None };
        if destination != self.id {
            return None;
        }
        let (mut reply, mut staged) = (Vec::new(), None);
        // Stops at a truncated end.
        let _ = self.take_apart(&mut bytes, &mut staged, &mut reply);
        if let Some(staged) = staged {
            self.obey(staged);
        }
        if reply.len() > 8 {
            let length = [12, 16, 20, 24, 32, 48].into_iter().find(|length| reply.len() <= *length);
            reply.resize(length.unwrap_or(64), 0x50);
        }
        let reply_id = u32::from_be_bytes([0, 0, self.id, source & 0x7f]);
        (source & 0x80 != 0 && !reply.is_empty()).then_some((reply_id, reply))
    }

    fn take_apart(&self, bytes: &mut &[u8], staged: &mut Option<Command>, reply: &mut Vec<u8>) -> Option<()> {
        while let Some([kind]) = take(bytes) {
            match kind {
                0x00..=0x1f => {}
                0x50 => continue,
                _ => return None,
            }
            let width = kind & 0x0c;
            let count = if kind & 3 == 0 { varuint(bytes)? } else { u32::from(kind & 3) };
            let first = varuint(bytes)?;
            // Registers beyond the frame's capacity are ignored.
            let registers = first..first.checked_add(count.min(64))?;
            if kind < 0x10 {
                for register in registers {
                    let value = decode(width, register, bytes)?;
                    if let Err(error) = write(staged, register, value) {
                        refuse(0x30, register, error, reply);
                    }
                }
            } else {
                self.answer(width, registers, reply);
            }
        }
        Some(())
    }

    /// Reads all requested registers in one subframe, or returns the first nonexistent register.
    fn answer(&self, width: u8, registers: Range<u32>, reply: &mut Vec<u8>) {
        let missing = registers.clone().find(|register| self.value(*register).is_none());
        match (missing, low(registers.end - registers.start)) {
            (Some(register), _) => return refuse(0x31, register, 1, reply),
            (None, count @ 1..=3) => reply.extend([0x20 | width | count, low(registers.start)]),
            (None, count) => reply.extend([0x20 | width, count, low(registers.start)]),
        }
        for register in registers {
            encode(width, register, self.value(register).unwrap_or(f64::NAN), reply);
        }
    }

    fn obey(&mut self, (mode, command): Command) {
        match (mode, self.mode) {
            (MODE_STOPPED, _) => (self.mode, self.fault) = (MODE_STOPPED, 0),
            // Only a stop command ends these states.
            (_, MODE_FAULT | MODE_TIMEOUT) => {}
            _ => {
                (self.mode, self.command, self.since_command_s) = (mode, command, 0.0);
                if self.command[0].is_nan() {
                    self.command[0] = self.position_turns;
                }
            }
        }
    }

    fn wanted_nm(&self) -> f64 {
        if self.mode != MODE_POSITION {
            return 0.0;
        }
        let [position, velocity, torque_nm, proportional, derivative, ..] = self.command;
        torque_nm
            + proportional * PROPORTIONAL_NM * (position - self.position_turns)
            + derivative.min(proportional) * DERIVATIVE_NM_S * (velocity - self.velocity_turns_per_s)
    }

    /// Reads a register; `None` if it does not exist.
    fn value(&self, register: u32) -> Option<f64> {
        Some(match register {
            0x00 => f64::from(self.mode),
            0x01 => self.position_turns,
            0x02 => self.velocity_turns_per_s,
            0x03 => self.torque_nm(),
            0x0d => 24.0,
            0x0e => 30.0,
            0x0f if self.wanted_nm().abs() > self.max_torque_nm => f64::from(LIMITED_BY_CURRENT),
            0x0f => f64::from(self.fault),
            _ => return None,
        })
    }
}

/// Writes to the command started by a mode; ignored without a mode. Returns the error number.
fn write(staged: &mut Option<Command>, register: u32, value: f64) -> Result<(), u8> {
    match register {
        0x00 if value.abs() < 0.5 => *staged = Some((MODE_STOPPED, UNSPECIFIED)),
        0x00 if (value - f64::from(MODE_POSITION)).abs() < 0.5 => {
            *staged = Some((MODE_POSITION, UNSPECIFIED))
        }
        0x00 => return Err(3),
        0x01..=0x03 | 0x0d..=0x0f => return Err(2),
        0x20..=0x2b => {
            let index = usize::from(low(register) - 0x20);
            if let Some(place) = staged.as_mut().and_then(|(_, command)| command.get_mut(index)) {
                *place = value;
            }
        }
        _ => return Err(1),
    }
    Ok(())
}

/// Resolutions of integers with 8, 16 and 32 bits.
fn steps(register: u32) -> [f64; 3] {
    match register {
        0x01 | 0x20 => [0.01, 0.0001, 0.00001],
        0x02 | 0x21 => [0.1, 0.00025, 0.00001],
        0x03 | 0x22 | 0x25 => [0.5, 0.01, 0.001],
        0x0d => [0.5, 0.1, 0.001],
        0x0e => [1.0, 0.1, 0.001],
        0x23 | 0x24 | 0x2b => [127.0, 32_767.0, 2_147_483_647.0].map(f64::recip),
        0x27 => [0.01, 0.001, 0.000_001],
        _ => [1.0; 3],
    }
}

/// Reads a value of 8, 16 or 32 bits or a float; `None` at the end of the frame.
fn decode(width: u8, register: u32, bytes: &mut &[u8]) -> Option<f64> {
    let [step8, step16, step32] = steps(register);
    let (number, least, step) = match width {
        0x00 => (i8::from_le_bytes(take(bytes)?).into(), i8::MIN.into(), step8),
        0x04 => (i16::from_le_bytes(take(bytes)?).into(), i16::MIN.into(), step16),
        0x08 => (i32::from_le_bytes(take(bytes)?), i32::MIN, step32),
        _ => return Some(f32::from_le_bytes(take(bytes)?).into()),
    };
    Some(if number == least { f64::NAN } else { f64::from(number) * step })
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "the nearest float is wanted, and a number that is held before"
)]
fn encode(width: u8, register: u32, value: f64, reply: &mut Vec<u8>) {
    let [step8, step16, step32] = steps(register);
    let (most, step, bytes) = match width {
        0x00 => (f64::from(i8::MAX), step8, 1),
        0x04 => (f64::from(i16::MAX), step16, 2),
        0x08 => (f64::from(i32::MAX), step32, 4),
        _ => return reply.extend((value as f32).to_le_bytes()),
    };
    let number = if value.is_nan() { -most - 1.0 } else { (value / step).round().clamp(-most, most) };
    reply.extend((number as i32).to_le_bytes().into_iter().take(bytes));
}

/// Register error with any number.
fn refuse(kind: u8, register: u32, error: u8, reply: &mut Vec<u8>) {
    reply.push(kind);
    let mut rest = register;
    while rest > 0x7f {
        reply.push(low(rest) | 0x80);
        rest >>= 7;
    }
    reply.extend([low(rest), error]);
}

fn varuint(bytes: &mut &[u8]) -> Option<u32> {
    let mut number = 0;
    for shift in (0..35).step_by(7) {
        let byte = u8::from_le_bytes(take(bytes)?);
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return number.try_into().ok();
        }
    }
    None
}

fn take<const LENGTH: usize>(bytes: &mut &[u8]) -> Option<[u8; LENGTH]> {
    let (taken, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*taken)
}

fn low(number: u32) -> u8 {
    number.to_le_bytes()[0]
}
