//! CiA 402 drive on a `CANopen` bus, with an ideal torque source.
//!
//! Implements CiA 301 and CiA 402-2, and manuals of drives where these leave a choice: a lost heartbeat of the
//! controller causes emergency 8130, leaves *operational*, and executes object 6007; a quick stop removes the torque
//! and stays active; process data objects can be changed only while disabled. Monitoring starts with the first
//! heartbeat. A time passes between *fault reaction active* and *fault*, and between two heartbeats.

mod objects;

use core::f64::consts::TAU;
use std::collections::VecDeque;

use objects::Objects;

/// State as the lowest bits of a statusword, plus *remote* and *voltage enabled*.
const SWITCH_ON_DISABLED: u16 = 0x0250;
const READY_TO_SWITCH_ON: u16 = 0x0231;
const SWITCHED_ON: u16 = 0x0233;
const OPERATION_ENABLED: u16 = 0x0237;
const QUICK_STOP_ACTIVE: u16 = 0x0217;
const FAULT_REACTION_ACTIVE: u16 = 0x021f;
const FAULT: u16 = 0x0218;

const BOOTING: u8 = 0x00;
const STOPPED: u8 = 0x04;
const OPERATIONAL: u8 = 0x05;
const PRE_OPERATIONAL: u8 = 0x7f;

const HEARTBEAT_LOST: u16 = 0x8130;
const TORQUE_MODE: u32 = 10;
/// Bits of an identifier: disabled flag and identifier.
const OFF: u32 = 1 << 31;
const ID: u32 = 0x7ff;

/// A drive on a bus.
#[derive(Debug, Clone)]
pub struct Cia402Drive {
    node: u8,
    counts_per_rad: f64,
    /// Motor turns per output turn.
    gear_ratio: f64,
    rated_nm: f64,
    objects: Objects,
    network: u8,
    state: u16,
    /// Received, executed at SYNC.
    waiting: Option<Vec<u8>>,
    syncs: u32,
    since_host_s: Option<f64>,
    since_own_s: f64,
    frames: VecDeque<(u16, Vec<u8>)>,
}

impl Cia402Drive {
    /// Creates a booted drive at 0 rad: node id, counts per motor turn, motor turns per output turn, and rated motor
    /// torque, `N m`.
    #[must_use]
    pub fn new(node: u8, counts_per_turn: f64, gear_ratio: f64, rated_nm: f64) -> Self {
        let counts_per_rad = counts_per_turn * gear_ratio / TAU;
        let mut drive = Self {
            node,
            counts_per_rad,
            gear_ratio,
            rated_nm,
            objects: Objects::new(node, rated_nm),
            network: BOOTING,
            state: SWITCH_ON_DISABLED,
            waiting: None,
            syncs: 0,
            since_host_s: None,
            since_own_s: 0.0,
            frames: VecDeque::new(),
        };
        drive.boot();
        drive
    }

    /// Removes an object, as in a drive without it.
    pub fn remove_object(&mut self, object: u16) {
        self.objects.forget(object);
    }

    /// Power-cycles the drive.
    pub fn boot(&mut self) {
        self.objects.reset(self.node, self.rated_nm);
        (self.network, self.state, self.waiting) = (PRE_OPERATIONAL, SWITCH_ON_DISABLED, None);
        (self.since_host_s, self.since_own_s) = (None, 0.0);
        self.send(0x700, vec![BOOTING]);
    }

    /// Sets the output to the position and velocity of the plant.
    pub fn set_state(&mut self, position_rad: f64, velocity_rad_per_s: f64) {
        self.objects.show(0x6064, whole(position_rad * self.counts_per_rad));
        self.objects.show(0x606c, whole(velocity_rad_per_s * self.counts_per_rad));
    }

    /// Triggers a fault with this code, which disables the drive until a reset.
    pub fn raise_fault(&mut self, code: u16) {
        self.state = FAULT_REACTION_ACTIVE;
        self.send_emergency(code);
    }

    /// Returns its statusword.
    #[must_use]
    pub fn statusword(&self) -> u16 {
        // In torque mode: follows the command.
        self.state | if self.state == OPERATION_ENABLED { 0x1000 } else { 0 }
    }

    /// Returns the torque at the output, `N m`.
    #[must_use]
    pub fn torque_nm(&self) -> f64 {
        f64::from(self.thousandths()) * 1e-3 * self.rated_nm * self.gear_ratio
    }

    fn thousandths(&self) -> i16 {
        if self.state != OPERATION_ENABLED || self.objects.value(0x6061, 0) != TORQUE_MODE {
            return 0;
        }
        let most = low(self.objects.value(0x6072, 0)).cast_signed();
        low(self.objects.value(0x6071, 0)).cast_signed().clamp(-most, most)
    }

    /// Returns the time until it is disabled without a heartbeat, `s`; `None` without monitoring.
    #[must_use]
    pub fn time_to_timeout_s(&self) -> Option<f64> {
        let timeout_s = 1e-3 * f64::from(low(self.objects.value(0x1016, 1)));
        let since_s = self.since_host_s.filter(|_| timeout_s > 0.0)?;
        Some((timeout_s - since_s).max(0.0))
    }

    /// Advances time.
    pub fn advance(&mut self, period_s: f64) {
        if self.state == FAULT_REACTION_ACTIVE {
            self.state = FAULT;
        }
        self.since_host_s = self.since_host_s.map(|since_s| since_s + period_s);
        if self.time_to_timeout_s().is_some_and(|time_to_timeout_s| time_to_timeout_s <= 0.0) {
            self.since_host_s = None;
            self.lose_host();
        }
        self.since_own_s += period_s;
        let heartbeat_s = 1e-3 * f64::from(self.objects.value(0x1017, 0));
        // 0.5 µs less, to tolerate rounding.
        if heartbeat_s > 0.0 && self.since_own_s >= heartbeat_s - 5e-7 {
            self.since_own_s = 0.0;
            self.send(0x700, vec![self.network]);
        }
    }

    /// Returns frames to send.
    pub fn take_frames(&mut self) -> impl Iterator<Item = (u16, Vec<u8>)> {
        core::mem::take(&mut self.frames).into_iter()
    }

    /// Receives a frame from the bus.
    pub fn receive(&mut self, id: u16, data: &[u8]) {
        let host = self.objects.value(0x1016, 1).to_le_bytes()[2];
        match (id, data) {
            (0x000, [command, node]) if [0, self.node].contains(node) => self.manage(*command),
            (0x080, []) if self.network == OPERATIONAL => self.sync(),
            (_, [_]) if host != 0 && id == 0x700 + u16::from(host) => self.since_host_s = Some(0.0),
            (_, data) if self.network != STOPPED && id == 0x600 + u16::from(self.node) => self.answer(data),
            (_, data) if self.network == OPERATIONAL => {
                let own = self.objects.value(0x1400, 1);
                if own & OFF == 0 && u32::from(id) == own & ID && data.len() == self.objects.length(0x1600) {
                    self.waiting = Some(data.to_vec());
                    // Event-driven, not SYNC-driven.
                    if self.objects.value(0x1400, 2) > 240 {
                        self.obey();
                    }
                }
            }
            _ => {}
        }
    }

    fn manage(&mut self, command: u8) {
        match command {
            0x01 => (self.network, self.syncs) = (OPERATIONAL, 0),
            0x02 => self.network = STOPPED,
            0x80 => self.network = PRE_OPERATIONAL,
            0x81 | 0x82 => self.boot(),
            _ => {}
        }
    }

    /// Sends its state, then executes received commands.
    fn sync(&mut self) {
        self.syncs += 1;
        self.objects.show(0x6041, self.statusword().into());
        self.objects.show(0x6077, u16::from_le_bytes(self.thousandths().to_le_bytes()).into());
        for pdo in 0..4 {
            let own = self.objects.value(0x1800 + pdo, 1);
            let every = self.objects.value(0x1800 + pdo, 2);
            if own & OFF == 0 && (1..=240).contains(&every) && self.syncs.is_multiple_of(every) {
                let data = self.objects.mapped(0x1a00 + pdo);
                self.frames.push_back((low(own & ID), data));
            }
        }
        self.obey();
    }

    fn obey(&mut self) {
        let Some(data) = self.waiting.take() else { return };
        let before = self.objects.value(0x6040, 0);
        self.objects.take(0x1600, &data);
        self.command(low(before), low(self.objects.value(0x6040, 0)));
    }

    /// State machine.
    fn command(&mut self, before: u16, controlword: u16) {
        let is_reset = controlword & !before & 0x80 != 0;
        self.state = match (self.state, controlword & 0x0f) {
            (FAULT, _) if is_reset => {
                self.send_emergency(0);
                SWITCH_ON_DISABLED
            }
            (FAULT | FAULT_REACTION_ACTIVE, _) => return,
            // A fault reset contains no other command.
            _ if controlword & 0x80 != 0 => return,
            // Disable voltage.
            (_, command) if command & 0x02 == 0 => SWITCH_ON_DISABLED,
            // Quick stop.
            (OPERATION_ENABLED, command) if command & 0x04 == 0 => QUICK_STOP_ACTIVE,
            (READY_TO_SWITCH_ON | SWITCHED_ON, command) if command & 0x04 == 0 => SWITCH_ON_DISABLED,
            (state, command) if command & 0x04 == 0 => state,
            // Shutdown.
            (SWITCH_ON_DISABLED | SWITCHED_ON | OPERATION_ENABLED, command) if command & 1 == 0 => {
                READY_TO_SWITCH_ON
            }
            // Switch on, and disable operation.
            (READY_TO_SWITCH_ON | OPERATION_ENABLED, 0x07) => SWITCHED_ON,
            // Enable operation, from *ready to switch on* via *switched on*.
            (READY_TO_SWITCH_ON | SWITCHED_ON | QUICK_STOP_ACTIVE, 0x0f) => OPERATION_ENABLED,
            (state, _) => state,
        };
    }

    fn lose_host(&mut self) {
        self.send_emergency(HEARTBEAT_LOST);
        if self.network == OPERATIONAL {
            self.network = PRE_OPERATIONAL;
        }
        match self.objects.value(0x6007, 0) {
            1 => self.state = FAULT_REACTION_ACTIVE,
            2 => self.command(0, 0x00),
            3 => self.command(0, 0x02),
            _ => {}
        }
    }

    /// Writes or reads an object, or returns an abort code.
    fn answer(&mut self, data: &[u8]) {
        let &[kind, a, b, part, ref value @ ..] = data else { return };
        let (index, Ok(value)) = (u16::from_le_bytes([a, b]), value.try_into()) else { return };
        let value = u32::from_le_bytes(value);
        let done = match kind {
            0x40 => self.objects.read(index, part).map(|(bytes, value)| (0x43 | (4 - bytes) << 2, value)),
            0x23 | 0x27 | 0x2b | 0x2f => {
                let before = low(self.objects.value(0x6040, 0));
                self.objects.write(index, part, 4 - (kind >> 2 & 3), value).map(|()| {
                    if index == 0x6040 {
                        self.command(before, low(value));
                    }
                    (0x60, 0)
                })
            }
            0x80 => return,
            _ => Err(0x0504_0001),
        };
        let (kind, value) = done.unwrap_or_else(|code| (0x80, code));
        let head = [kind, a, b, part];
        self.send(0x580, head.into_iter().chain(value.to_le_bytes()).collect());
    }

    fn send_emergency(&mut self, code: u16) {
        let [low, high] = code.to_le_bytes();
        self.send(0x080, vec![low, high, u8::from(code != 0), 0, 0, 0, 0, 0]);
    }

    fn send(&mut self, function: u16, data: Vec<u8>) {
        self.frames.push_back((function + u16::from(self.node), data));
    }
}

fn low(value: u32) -> u16 {
    let [low, high, ..] = value.to_le_bytes();
    u16::from_le_bytes([low, high])
}

/// Counts with wrap-around.
#[expect(clippy::cast_possible_truncation, reason = "nothing moves so far that 64 bits do not hold it")]
fn whole(counts: f64) -> u32 {
    let [a, b, c, d, ..] = (counts.round() as i64).to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}
