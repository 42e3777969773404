//! Time driver in whole ticks, advanced by the host or by a timer's interrupt.
//!
//! A timeout therefore always expires in a tick, never between two.

use core::cell::{Cell, RefCell};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
use embassy_time_driver::{Driver, time_driver_impl};
use embassy_time_queue_utils::Queue;

use super::{Interrupt, Register, unmask};
use crate::{CLOCK_HZ, TICK_HZ};

const CONTROL: Register = Register(0x4000_0000);
const RELOAD: Register = Register(0x4000_0008);
const CLEAR: Register = Register(0x4000_000C);
const ENABLE_AND_INTERRUPT: u32 = 0b1001;

struct Clock {
    now: Mutex<Cell<u64>>,
    queue: Mutex<RefCell<Queue>>,
}

time_driver_impl!(static CLOCK: Clock = Clock {
    now: Mutex::new(Cell::new(0)),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl Clock {
    fn wake_what_is_due(&self, section: CriticalSection<'_>) {
        let now = self.now.borrow(section).get();
        // No alarm is set: every tick polls.
        let _ = self.queue.borrow_ref_mut(section).next_expiration(now);
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        critical_section::with(|section| self.now.borrow(section).get())
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|section| {
            if self.queue.borrow_ref_mut(section).schedule_wake(at, waker) {
                self.wake_what_is_due(section);
            }
        });
    }
}

/// Advances time by one tick and wakes expired tasks.
pub(super) fn advance() {
    critical_section::with(|section| {
        let now = CLOCK.now.borrow(section);
        now.set(now.get() + 1);
        CLOCK.wake_what_is_due(section);
    });
}

/// Starts timer 0.
pub(super) fn start_timer() {
    const { assert!(embassy_time_driver::TICK_HZ == TICK_HZ as u64, "time is counted in ticks of the controller") };
    RELOAD.write(CLOCK_HZ / TICK_HZ - 1);
    CONTROL.write(ENABLE_AND_INTERRUPT);
    unmask(Interrupt::Timer0);
}

pub(super) extern "C" fn timer_interrupt() {
    CLEAR.write(1);
    advance();
}
