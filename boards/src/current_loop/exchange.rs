//! Lock-free exchange between tick and current loop, with atomics only. Interrupts are never masked, so a
//! tick cannot delay the current loop.
//!
//! The current loop can interrupt the tick, but not the reverse. The loop therefore always sees complete
//! commands, and an interrupted tick reads again.

use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use core::sync::atomic::{AtomicU32, compiler_fence, fence};

use dimsart_core::DriveFault;

use super::identifying::IdentificationMailbox;

/// Maximum number of reads: the loop runs once per period, and a read takes less than one.
const MAX_LOOKS: u8 = 4;
/// Command for the bridge to be off.
const OFF: u32 = f32::NAN.to_bits();

/// Data from the current loop to the tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoopState {
    /// Rotor angle in 2⁻³² of a turn.
    pub angle: u32,
    /// Rotor speed, `rad/s`.
    pub speed_rad_per_s: f32,
    /// Torque-producing current, `A`.
    pub current_a: f32,
    /// Supply voltage, `V`.
    pub bus_v: f32,
    /// Bridge temperature, `°C`.
    pub temperature_c: f32,
    /// The fault that keeps the bridge off, if any.
    pub fault: Option<DriveFault>,
    /// Whether the loop follows the torque command: the rotor is aligned.
    pub is_ready: bool,
    /// Number of periods, wrapping.
    pub periods: u32,
}

/// The exchange between a tick and a current loop.
#[derive(Debug)]
pub struct LoopExchange {
    wanted_nm: AtomicU32,
    /// Counts torque commands.
    given: AtomicU32,
    /// Odd during a write.
    version: AtomicU32,
    told: [AtomicU32; 7],
    /// Requests and results of identifications.
    pub identification: IdentificationMailbox,
}

impl Default for LoopExchange {
    fn default() -> Self {
        Self::new()
    }
}

impl LoopExchange {
    /// Creates an exchange with the bridge off.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            wanted_nm: AtomicU32::new(OFF),
            given: AtomicU32::new(0),
            version: AtomicU32::new(0),
            told: [const { AtomicU32::new(0) }; 7],
            identification: IdentificationMailbox::new(),
        }
    }

    /// Commands a torque, `N m`, or `None` for the bridge to be off. Call in every tick.
    pub fn command(&self, torque_nm: Option<f32>) {
        self.wanted_nm.store(torque_nm.map_or(OFF, f32::to_bits), Relaxed);
        // If the loop reads in between, it sees the new torque with the age of the old one.
        compiler_fence(Release);
        self.given.store(self.given.load(Relaxed).wrapping_add(1), Relaxed);
    }

    /// Returns the last torque command, if finite, and the number of commands.
    #[inline]
    #[must_use]
    pub fn command_and_count(&self) -> (Option<f32>, u32) {
        let torque_nm = f32::from_bits(self.wanted_nm.load(Relaxed));
        (torque_nm.is_finite().then_some(torque_nm), self.given.load(Relaxed))
    }

    /// Publishes data to the tick; call from one place only.
    #[inline]
    pub fn publish(&self, told: &LoopState) {
        let version = self.version.load(Relaxed);
        self.version.store(version.wrapping_add(1), Relaxed);
        fence(Release);
        let flags =
            told.fault.map_or(0, |fault| u32::from(fault.reason().number())) | u32::from(told.is_ready) << 8;
        // Unrolled: a loop takes 50 cycles more.
        let [angle, speed, current, bus, temperature, flag_word, periods] = &self.told;
        angle.store(told.angle, Relaxed);
        speed.store(told.speed_rad_per_s.to_bits(), Relaxed);
        current.store(told.current_a.to_bits(), Relaxed);
        bus.store(told.bus_v.to_bits(), Relaxed);
        temperature.store(told.temperature_c.to_bits(), Relaxed);
        flag_word.store(flags, Relaxed);
        periods.store(told.periods, Relaxed);
        self.version.store(version.wrapping_add(2), Release);
    }

    /// Returns the latest data, all of one period; `None` if no consistent read was possible or there is no
    /// data.
    #[must_use]
    pub fn state(&self) -> Option<LoopState> {
        for _ in 0..MAX_LOOKS {
            let version = self.version.load(Acquire);
            let [angle, speed, current, bus, temperature, flags, periods] =
                self.told.each_ref().map(|cell| cell.load(Relaxed));
            fence(Acquire);
            if version != 0 && version.is_multiple_of(2) && version == self.version.load(Relaxed) {
                let [number, is_ready, ..] = flags.to_le_bytes();
                return Some(LoopState {
                    angle,
                    speed_rad_per_s: f32::from_bits(speed),
                    current_a: f32::from_bits(current),
                    bus_v: f32::from_bits(bus),
                    temperature_c: f32::from_bits(temperature),
                    fault: DriveFault::from_number(number),
                    is_ready: is_ready != 0,
                    periods,
                });
            }
        }
        None
    }
}

/// Age of a torque command.
#[derive(Debug, Clone)]
pub struct CommandAge {
    given: u32,
    periods: u16,
    max_periods: u16,
}

impl CommandAge {
    /// Sets the maximum age in periods; there is no command yet.
    #[must_use]
    pub const fn new(max_periods: u16) -> Self {
        Self { given: 0, periods: max_periods, max_periods }
    }

    /// Counts a period; returns the torque command unless it has expired.
    #[inline]
    pub fn fresh_command(&mut self, (torque_nm, given): (Option<f32>, u32)) -> Option<f32> {
        if given == self.given {
            self.periods = self.periods.saturating_add(1);
        } else {
            (self.given, self.periods) = (given, 0);
        }
        torque_nm.filter(|_| self.periods < self.max_periods)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::thread;

    use super::*;

    #[test]
    fn a_torque_that_is_not_given_anew_is_none_after_its_age() {
        let (exchange, mut age) = (LoopExchange::new(), CommandAge::new(60));
        assert_eq!(age.fresh_command(exchange.command_and_count()), None, "nothing was given yet");
        for _ in 0..3 {
            exchange.command(Some(0.25));
            for period in 0..80 {
                assert_eq!(
                    age.fresh_command(exchange.command_and_count()).is_some(),
                    period < 60,
                    "{period}"
                );
            }
        }
        exchange.command(Some(-1.0));
        assert_eq!(age.fresh_command(exchange.command_and_count()), Some(-1.0));
        exchange.command(None);
        assert_eq!(age.fresh_command(exchange.command_and_count()), None);
    }

    #[test]
    fn what_is_no_number_is_no_torque() {
        let exchange = LoopExchange::new();
        for torque_nm in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            exchange.command(Some(torque_nm));
            assert_eq!(exchange.command_and_count().0, None);
        }
    }

    #[test]
    fn every_fault_comes_through() {
        let exchange = LoopExchange::new();
        assert_eq!(exchange.state(), None);
        for fault in DriveFault::ALL.iter().copied().map(Some).chain([None]) {
            let told = LoopState { fault, is_ready: fault.is_none(), bus_v: 24.0, ..LoopState::default() };
            exchange.publish(&told);
            assert_eq!(exchange.state(), Some(told));
        }
    }

    #[test]
    fn what_is_read_is_of_one_period() {
        let (exchange, is_over) = (LoopExchange::new(), AtomicBool::new(false));
        thread::scope(|scope| {
            scope.spawn(|| {
                for periods in 1..200_000_u32 {
                    let value = periods as f32;
                    exchange.publish(&LoopState {
                        angle: periods,
                        speed_rad_per_s: value,
                        current_a: value,
                        bus_v: value,
                        temperature_c: value,
                        periods,
                        ..LoopState::default()
                    });
                }
                is_over.store(true, Relaxed);
            });
            let mut seen = 0;
            while !is_over.load(Relaxed) {
                let Some(told) = exchange.state() else { continue };
                let value = told.periods as f32;
                assert_eq!(told.angle, told.periods);
                for word in [told.speed_rad_per_s, told.current_a, told.bus_v, told.temperature_c] {
                    assert_eq!(word.to_bits(), value.to_bits());
                }
                assert!(told.periods >= seen);
                seen = told.periods;
            }
        });
        assert_eq!(exchange.state().map(|told| told.periods), Some(199_999));
    }
}
