//! Observers of a step, for example to measure its modules.

use core::hint::cold_path;

use crate::data_base::Data;
use crate::device::Counter;
use crate::scheme::wiring::{any, module_bit};
use crate::scheme::{Call, Wiring};

/// Makes the calls of a step. The core reads no clock: an observer can read one around each call.
///
/// `()` observes nothing and costs nothing.
pub trait Observer: Sized {
    /// Makes one call of a module, exactly once: the one at index `place` of the
    /// [`steps`](crate::Engine::steps). Modules that are isolated or do not run in this tick are not called.
    fn call(&mut self, place: usize, call: impl FnOnce());

    /// Makes all calls of a step.
    #[inline]
    fn observe_step(&mut self, mut calls: Calls<'_>, data: &Data<'_>) {
        calls.run_by(data, |place, call| {
            self.call(place, || (call.compute)(data, call.configuration, call.state));
        });
    }
}

impl Observer for () {
    #[inline(always)]
    fn call(&mut self, _: usize, call: impl FnOnce()) {
        call();
    }

    #[inline(always)]
    fn observe_step(&mut self, calls: Calls<'_>, data: &Data<'_>) {
        calls.run(data);
    }
}

/// The calls of a tick.
#[derive(Debug)]
pub struct Calls<'a> {
    pub(super) wiring: &'a Wiring,
    /// Whether any module initialises its state at its next call.
    pub(super) begins: bool,
    /// Modules that do not run in this tick, unless they begin; one bit per place in the plug-in order.
    pub(super) resting: u32,
    /// Failed modules, one bit per place in the plug-in order.
    pub(super) failed: &'a mut u32,
    pub(super) counter: Option<&'a Counter>,
}

impl Calls<'_> {
    /// Not generic, so that it is compiled with the core.
    #[inline(never)]
    fn run(mut self, data: &Data<'_>) {
        self.run_by(data, |_, call| (call.compute)(data, call.configuration, call.state));
    }

    /// Makes every call through a function and checks the written words.
    #[inline(always)]
    fn run_by(&mut self, data: &Data<'_>, mut make: impl FnMut(usize, &Call)) {
        let wiring = self.wiring;
        let mut failed = *self.failed;
        let mut is_usual = !self.begins && self.resting == 0 && failed == 0;
        for (place, call) in wiring.calls().iter().enumerate() {
            if is_usual || self.prepare(call, failed, data) {
                let start = self.counter.map_or(0, |counter| counter.now());
                make(place, call);
                if self.counter.is_some_and(|counter| counter.elapsed_since(start) > call.budget_counts) {
                    cold_path();
                    failed |= module_bit(call.order);
                    is_usual = false;
                }
            }
            if call.checked_words.count != 0
                && let Some(checked_words) = wiring.checked_words(call)
                && any(checked_words, |span| data.has_wrong(span))
            {
                cold_path();
                failed |= module_bit(call.order);
                is_usual = false;
            }
        }
        *self.failed = failed;
    }

    /// Initialises a module before its first stage if needed; returns whether to make the call.
    #[cold]
    #[inline(never)]
    fn prepare(&self, call: &Call, failed: u32, data: &Data<'_>) -> bool {
        let Some(called) = self.wiring.called(call) else { return false };
        if called.needs & failed != 0 {
            return false;
        }
        let begins = self.begins && called.begins;
        if begins && let Some(begin) = call.begin {
            begin(data, call.configuration, call.state, called.takes_over);
        }
        begins || self.resting & module_bit(call.order) == 0
    }
}
