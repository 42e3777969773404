//! Who looks on while an engine steps, such as to measure what its modules take.

use crate::data::Data;
use crate::engine::Calls;
use crate::module::ModuleList;

/// Makes the calls of a step. The core reads no clock: whoever has one can read it around each call.
///
/// `()` looks at nothing and costs nothing.
pub trait Observer: Sized {
    /// Makes one call of a module, once.
    fn call(&mut self, call: impl FnOnce());

    /// Makes all calls of a step.
    fn look_on<M: ModuleList>(&mut self, calls: Calls<'_, M>, data: &Data<'_>) {
        calls.run_observed(data, self);
    }
}

impl Observer for () {
    #[inline(always)]
    fn call(&mut self, call: impl FnOnce()) {
        call();
    }

    #[inline(always)]
    fn look_on<M: ModuleList>(&mut self, calls: Calls<'_, M>, data: &Data<'_>) {
        M::step(calls, data);
    }
}
