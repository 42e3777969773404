//! Who looks on while an engine steps, such as to measure what its modules take.

use crate::data::Data;
use crate::wiring::{Call, Wiring, module_bit};

/// Makes the calls of a step. The core reads no clock: whoever has one can read it around each call.
///
/// `()` looks at nothing and costs nothing.
pub trait Observer: Sized {
    /// Makes one call of a module, once.
    fn call(&mut self, call: impl FnOnce());

    /// Makes all calls of a step.
    #[inline]
    fn look_on(&mut self, calls: Calls<'_>, data: &Data<'_>) {
        for call in calls.wiring.calls() {
            if calls.is_usual() || calls.prepare(call, data) {
                self.call(|| (call.compute)(data, call.configuration, call.state));
            }
        }
    }
}

impl Observer for () {
    #[inline(always)]
    fn call(&mut self, call: impl FnOnce()) {
        call();
    }

    #[inline(always)]
    fn look_on(&mut self, calls: Calls<'_>, data: &Data<'_>) {
        calls.run(data);
    }
}

/// The calls of a tick.
#[derive(Debug)]
pub struct Calls<'a> {
    pub(super) wiring: &'a Wiring,
    /// Whether there is a module that begins with its next call.
    pub(super) begins: bool,
    /// Modules that are cut out, a bit for each place in the plug-in order.
    pub(super) fallen: u32,
}

impl Calls<'_> {
    /// Not generic: compiled with the core, for speed or for size as the modules are.
    #[inline(never)]
    fn run(self, data: &Data<'_>) {
        for call in self.wiring.calls() {
            if self.is_usual() || self.prepare(call, data) {
                (call.compute)(data, call.configuration, call.state);
            }
        }
    }

    /// Whether every call is made, and none of them begins a module.
    #[inline(always)]
    fn is_usual(&self) -> bool {
        !self.begins && self.fallen == 0
    }

    /// Begins a module before its first stage, if it is to; says whether the call is made.
    #[cold]
    #[inline(never)]
    fn prepare(&self, call: &Call, data: &Data<'_>) -> bool {
        if self.fallen & module_bit(call.order) != 0 {
            return false;
        }
        if let Some(begin) = call.begin
            && let Some(called) = self.wiring.called(call).filter(|called| called.begins)
        {
            data.say_who_takes_over(called.takes_over);
            begin(data, call.configuration, call.state);
        }
        true
    }
}
