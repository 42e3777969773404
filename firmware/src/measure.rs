//! Execution times of module calls and ticks, by the board's counter (feature `measure`).

use core::sync::atomic::{Ordering::SeqCst, compiler_fence};

use boards::{Board as _, Selected};
use dimsart_core::{Dimsart, Observer, TickResult, Word};
use dimsart_link::protocol::{self, CyclesReport, DeviceInfo, Refusal, Request, Response};

use crate::tick_handover::Answer;

/// Two calls per module.
const MAX_CALLS: usize = 2 * Selected::SIZES.modules;

/// Measurements since the last scheme change. Initially all zero.
pub(crate) struct Measurements {
    tick: Statistics,
    calls: [Statistics; MAX_CALLS],
    /// Calls in this tick.
    made: usize,
}

#[derive(Clone, Copy)]
struct Statistics {
    runs: u32,
    least: u32,
    greatest: u32,
    sum: u64,
}

impl Measurements {
    pub(crate) const fn new() -> Self {
        Self { tick: Statistics::new(), calls: [Statistics::new(); MAX_CALLS], made: 0 }
    }

    /// Runs and measures one tick. Ticks without module calls are not counted.
    pub(crate) fn tick(
        &mut self,
        dimsart: &mut Dimsart,
        measured: &[Word],
        commanded: &mut [Word],
    ) -> TickResult {
        self.made = 0;
        let counter = Selected::counter();
        let start = counter.now();
        let tick = dimsart.tick_observed(measured, commanded, self);
        let counts = counter.elapsed_since(start);
        if self.made > 0 {
            self.tick.add(counts);
        }
        tick
    }

    fn clear(&mut self) {
        self.tick = Statistics::new();
        self.calls.fill(Statistics::new());
    }

    /// Answers requests about the measurements; passes other requests to the controller.
    pub(crate) fn serve(
        &mut self,
        id: u16,
        request: &Request,
        dimsart: &mut Dimsart,
        info: &mut DeviceInfo,
    ) -> Answer {
        let Request::Cycles { place, clears } = *request else {
            if matches!(request, Request::Command(_)) {
                self.clear();
            }
            return protocol::serve(id, request, dimsart, info);
        };
        let place = usize::from(place);
        let statistics = core::iter::once(&self.tick).chain(&self.calls);
        let found = statistics.take(1 + dimsart.engine().steps().count()).nth(place).map(Statistics::report);
        if clears {
            self.clear();
        }
        found.map_or(Response::Refused(Refusal::NotFound), Response::Cycles)
    }
}

impl Observer for Measurements {
    fn call(&mut self, place: usize, call: impl FnOnce()) {
        let counts = timed(call);
        if let Some(statistics) = self.calls.get_mut(place) {
            statistics.add(counts);
        }
        self.made += 1;
    }
}

impl Statistics {
    const fn new() -> Self {
        Self { runs: 0, least: 0, greatest: 0, sum: 0 }
    }

    fn add(&mut self, counts: u32) {
        self.least = if self.runs == 0 { counts } else { self.least.min(counts) };
        self.greatest = self.greatest.max(counts);
        self.sum += u64::from(counts);
        self.runs = self.runs.saturating_add(1);
    }

    fn report(&self) -> CyclesReport {
        let Self { runs, least, greatest, sum } = *self;
        let mean = u32::try_from(sum / u64::from(runs.max(1))).unwrap_or(u32::MAX);
        let per_1024_instructions = Selected::counts_per_1024_instructions();
        CyclesReport { runs, min: least, mean, max: greatest, per_1024_instructions }
    }
}

/// Never inlined: `dimsart cycles` bounds it by name.
#[inline(never)]
fn timed(call: impl FnOnce()) -> u32 {
    let counter = Selected::counter();
    let start = counter.now();
    compiler_fence(SeqCst);
    call();
    compiler_fence(SeqCst);
    counter.elapsed_since(start)
}
