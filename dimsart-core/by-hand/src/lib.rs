//! Table 1, master side, hand-written as one function: the reference for the engine's cost.
//!
//! Computes everything that the modular scheme does, bit-identical and with the same checks, for three axes
//! and with constant parameters: the code for a fixed scheme.
#![no_std]

use dimsart_core::{LinkState, counter_distance, is_newer, math, next_packet_number};

/// Degrees of freedom.
pub const DOF: usize = 3;
/// Words of a packet: a wave and its two counters per axis.
pub const PACKET_WORDS: usize = 3 * DOF;

/// Content of a packet: one wave on three linear axes.
const CONTENT: u16 = 0x3630;

const PERIOD_S: f32 = 1e-3;
const STIFFNESS: f32 = 3000.0;
const DAMPING_PER_TICK: f32 = 0.0 / PERIOD_S;
const IMPEDANCE: f32 = 10.0;
const MOBILITY: f32 = 1.0 / IMPEDANCE;
const MOBILITY_PER_TICK: f32 = PERIOD_S / IMPEDANCE;
const DELAY_TICKS: usize = 10;
const SETTLING: f32 = 0.125;
const RESTART_TICKS: u32 = 100;
const TIMEOUT_TICKS: u32 = 20;
const HOLD_TICKS: u32 = 20;
const WAVE_COUNTS: f32 = PERIOD_S / (1.0 / 268_435_456.0);
const ENERGY_COUNTS: f32 = PERIOD_S / (1.0 / 1_073_741_824.0);

/// A packet, in or out; a host reads and writes it in an image's memory.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct Packet {
    /// Content.
    pub content: u16,
    /// Low half of its number.
    pub counter: u16,
    /// Counter of the newest packet that the sender has received.
    pub echo: u16,
    /// Whether the samples are finite; checked outside the tick, as in the engine.
    pub is_finite: bool,
    /// Samples, then counters.
    pub words: [u32; PACKET_WORDS],
}

/// Every signal of the scheme, which the modular version has in its Data Base.
#[derive(Debug, Default)]
pub struct Signals {
    /// Measured, `m`.
    pub position: [f32; DOF],
    /// `CH2_WAVES`, `sqrt(W)`.
    pub wave_in: [f32; DOF],
    /// `DES_POSITION`, `m`.
    pub desired_position: [f32; DOF],
    /// `DES_FORCE`, `N`.
    pub force: [f32; DOF],
    /// `CH1_WAVES`, `sqrt(W)`.
    pub wave_out: [f32; DOF],
    /// `CH1_TD_WAVES`, `sqrt(W)`.
    pub delayed_wave: [f32; DOF],
    /// `LINE_FORCE`, `N`.
    pub line_force: [f32; DOF],
    /// `LINE_VELOCITY`, `m/s`.
    pub line_velocity: [f32; DOF],
    /// `LINK_AGE`.
    pub age_ticks: u32,
    /// `LINK_LOST`.
    pub lost: u32,
    /// `LINK_ROUND_TRIP`.
    pub round_trip_ticks: u32,
    /// `LINK_REFUSED`.
    pub refused: u32,
    /// `LINK_STATE`.
    pub state: LinkState,
    /// `LINK_JITTER`.
    pub jitter_ticks: f32,
}

/// The master: signals and state.
#[derive(Debug)]
pub struct Master {
    /// Results of the last tick.
    pub signals: Signals,
    a: f32,
    two_over_a: f32,
    is_running_in: bool,
    position_sum: [f32; DOF],
    position_lost: [f32; DOF],
    previous_force: [f32; DOF],
    settled_force: [f32; DOF],
    previous_error: [f32; DOF],
    line: [[f32; DOF]; DELAY_TICKS],
    oldest: usize,
    wave_count: [u32; DOF],
    wave_rest: [f32; DOF],
    energy_count: [u32; DOF],
    energy_rest: [f32; DOF],
    number: u32,
    received_counter: u16,
    accepted_counter: u16,
    is_lost: bool,
}

impl Default for Master {
    fn default() -> Self {
        Self::new()
    }
}

impl Master {
    /// State before the first tick.
    #[must_use]
    pub fn new() -> Self {
        let a = math::sqrt(2.0 * IMPEDANCE);
        Self {
            signals: Signals::default(),
            a,
            two_over_a: 2.0 / a,
            is_running_in: true,
            position_sum: [0.0; DOF],
            position_lost: [0.0; DOF],
            previous_force: [0.0; DOF],
            settled_force: [0.0; DOF],
            previous_error: [0.0; DOF],
            line: [[0.0; DOF]; DELAY_TICKS],
            oldest: 0,
            wave_count: [0; DOF],
            wave_rest: [0.0; DOF],
            energy_count: [0; DOF],
            energy_rest: [0.0; DOF],
            number: 0,
            received_counter: 0,
            accepted_counter: 0,
            is_lost: false,
        }
    }

    /// Runs one tick; returns false if a number is not finite or the link is lost, so that the force is zero.
    #[inline(never)]
    #[expect(clippy::indexing_slicing, reason = "the axes of fixed arrays, as one writes it by hand")]
    #[expect(clippy::cast_possible_truncation, reason = "counters: towards zero and saturating")]
    #[expect(clippy::cast_precision_loss, reason = "counters: differences are small")]
    pub fn tick(
        &mut self,
        position: &[f32; DOF],
        received: Option<&Packet>,
        force: &mut [f32; DOF],
        send: &mut Packet,
    ) -> bool {
        if position.iter().any(|x| !x.is_finite()) {
            *force = [0.0; DOF];
            return false;
        }
        let signals = &mut self.signals;

        let mut is_new = false;
        if let Some(packet) = received {
            let is_next =
                self.received_counter != 0 && packet.counter == self.received_counter.wrapping_add(1);
            is_new = packet.content == CONTENT && packet.is_finite;
            signals.state = LinkState::Ok;
            let mut delta = 1;
            if !is_new {
                signals.refused = signals.refused.wrapping_add(1);
                signals.state = LinkState::Error;
            } else if !is_next {
                let is_old = !is_newer(packet.counter, self.received_counter);
                let is_restart = is_old && signals.age_ticks >= RESTART_TICKS || self.received_counter == 0;
                delta = u32::from(counter_distance(packet.counter, self.received_counter));
                signals.state = match delta {
                    _ if self.received_counter == 0 => LinkState::Ok,
                    _ if packet.counter == self.received_counter => LinkState::Repeated,
                    1 => LinkState::Ok,
                    2..=3 if !is_old => LinkState::OkSomeLost,
                    _ => LinkState::WrongSequence,
                };
                if is_old && !is_restart {
                    signals.refused = signals.refused.wrapping_add(1);
                    is_new = false;
                } else if !is_restart {
                    signals.lost = signals.lost.wrapping_add(delta - 1);
                }
            }
            if is_new {
                if self.received_counter != 0 {
                    let deviation = (signals.age_ticks + 1).abs_diff(delta) as f32;
                    signals.jitter_ticks += (deviation - signals.jitter_ticks) * (1.0 / 16.0);
                }
                self.received_counter = packet.counter;
                self.accepted_counter = packet.counter;
                if packet.echo != 0 {
                    let packets = u32::from(counter_distance(self.number as u16, packet.echo));
                    if packets < self.number {
                        signals.round_trip_ticks = packets + 1;
                    }
                }
                for axis in 0..DOF {
                    signals.wave_in[axis] = f32::from_bits(packet.words[axis]);
                }
            }
        }
        let mut is_down = false;
        if is_new {
            signals.age_ticks = 0;
        } else {
            signals.age_ticks = signals.age_ticks.saturating_add(1);
            self.is_lost |= self.received_counter != 0 && signals.age_ticks >= TIMEOUT_TICKS;
            is_down = self.received_counter == 0 && signals.age_ticks >= TIMEOUT_TICKS;
            if received.is_none() {
                signals.state = LinkState::NoData;
            }
            if signals.age_ticks > HOLD_TICKS {
                signals.wave_in = [0.0; DOF];
            }
        }

        if self.is_lost {
            signals.state = LinkState::Timeout;
        }

        let is_first = self.is_running_in;
        self.is_running_in = false;
        self.number = next_packet_number(self.number);
        send.content = CONTENT;
        send.counter = self.number as u16;
        send.echo = self.accepted_counter;
        let mut is_finite = true;
        for axis in 0..DOF {
            let x = position[axis];
            signals.position[axis] = x;
            let wave = signals.wave_in[axis];

            if is_first {
                self.position_sum[axis] = x;
            }
            let step = MOBILITY_PER_TICK * (self.a * wave - self.previous_force[axis]);
            let step = step - self.position_lost[axis];
            let sum = self.position_sum[axis] + step;
            self.position_lost[axis] = (sum - self.position_sum[axis]) - step;
            self.position_sum[axis] = sum;
            let desired = sum - MOBILITY_PER_TICK * self.settled_force[axis];
            signals.desired_position[axis] = desired;

            let error = desired - x;
            let change = if is_first { 0.0 } else { error - self.previous_error[axis] };
            self.previous_error[axis] = error;
            let command = STIFFNESS * error + DAMPING_PER_TICK * change;
            signals.force[axis] = command;
            force[axis] = command;
            is_finite &= command.is_finite();

            self.previous_force[axis] = command;
            self.settled_force[axis] += SETTLING * (command - self.settled_force[axis]);
            let out = wave - self.two_over_a * command;
            signals.wave_out[axis] = out;
            signals.line_force[axis] = -command;
            signals.line_velocity[axis] = MOBILITY * (self.a * wave - command);

            let delayed = core::mem::replace(&mut self.line[self.oldest][axis], out);
            signals.delayed_wave[axis] = delayed;

            let counts = self.wave_rest[axis] + delayed * WAVE_COUNTS;
            let whole = counts as i32;
            self.wave_rest[axis] = counts - whole as f32;
            self.wave_count[axis] = self.wave_count[axis].wrapping_add(whole.cast_unsigned());
            let counts = self.energy_rest[axis] + (0.5 * delayed * delayed) * ENERGY_COUNTS;
            let whole = counts as i32;
            self.energy_rest[axis] = counts - whole as f32;
            self.energy_count[axis] = self.energy_count[axis].wrapping_add(whole.cast_unsigned());

            send.words[axis] = delayed.to_bits();
            send.words[DOF + 2 * axis] = self.wave_count[axis];
            send.words[DOF + 2 * axis + 1] = self.energy_count[axis];
        }
        self.oldest += 1;
        if self.oldest == DELAY_TICKS {
            self.oldest = 0;
        }
        if !is_finite || self.is_lost || is_down {
            *force = [0.0; DOF];
        }
        is_finite && !self.is_lost && !is_down
    }
}
