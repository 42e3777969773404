//! Upper bounds of ticks for all inputs, from the machine code.

use std::collections::BTreeSet;

use ::cycles::bound::{Bound, BoundError, BoundRequest, Call, CallBound, Snapshot};
use ::cycles::timing::Timing;
use dimsart_core::limits::MAX_LINKS;

use super::controller::Lengths;
use super::{Controller, CyclesError, Firmware};

/// Upper bounds of cycles and stack.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Most {
    pub(super) cycles: u64,
    pub(super) stack_bytes: u32,
}

impl Most {
    /// Either of two.
    pub(super) fn or(self, other: Self) -> Self {
        let (cycles, stack_bytes) = (self.cycles.max(other.cycles), self.stack_bytes.max(other.stack_bytes));
        Self { cycles, stack_bytes }
    }

    /// Both in sequence.
    pub(super) fn then(self, other: Self) -> Self {
        Self { cycles: self.cycles.saturating_add(other.cycles), ..self.or(other) }
    }
}

impl From<&Bound> for Most {
    fn from(bound: &Bound) -> Self {
        Self { cycles: bound.cycles, stack_bytes: bound.stack_bytes }
    }
}

impl From<&CallBound> for Most {
    fn from(bound: &CallBound) -> Self {
        Self { cycles: bound.cycles, stack_bytes: bound.stack_bytes }
    }
}

/// Worst cases of a scheme.
#[derive(Debug, Clone, Default)]
pub(super) struct Worst {
    pub(super) tick: Most,
    /// Calls of modules, in order.
    pub(super) calls: Vec<Most>,
    pub(super) deliver: Most,
    pub(super) take: Most,
    /// Addresses of all instructions that a tick can execute.
    pub(super) visited: BTreeSet<u32>,
}

/// Calls of the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Deliver,
    Tick,
    Take,
}

impl Worst {
    /// Bounds every tick from now on. Before each tick, any packet or none arrives over each link with a channel, on this
    /// channel.
    pub(super) fn of_ticks(
        firmware: &Firmware,
        timing: &Timing,
        controller: &Controller,
        channels: [Option<u16>; MAX_LINKS],
        lengths: Lengths,
    ) -> Result<Self, CyclesError> {
        let links = (0_u32..).take(MAX_LINKS);
        let mut steps = Vec::new();
        let mut controller = controller.clone();
        for (link, channel) in links.clone().zip(channels) {
            let Some(channel) = channel else { continue };
            let any = controller.calls_of_any_delivery(link, channel, lengths)?;
            // Each call follows each other call, also the first.
            let any = any.iter().chain(any.first());
            steps.extend(any.map(|call| (Step::Deliver, Call { is_optional: true, ..call.clone() })));
        }
        steps.push((Step::Tick, controller.call_of_tick()));
        steps.extend(links.map(|link| (Step::Take, controller.call_of_take(link))));
        let (steps, calls): (Vec<Step>, Vec<Call>) = steps.into_iter().unzip();
        let bounds =
            bounds(Bound::for_repeated_execution, firmware, timing, &controller, &calls, &firmware.compute)?;
        let mut worst = Self::default();
        for (step, bound) in steps.into_iter().zip(&bounds) {
            let place = match step {
                Step::Deliver => &mut worst.deliver,
                Step::Tick => {
                    worst.calls = bound.calls.iter().map(Most::from).collect();
                    worst.visited.clone_from(&bound.visited);
                    &mut worst.tick
                }
                Step::Take => &mut worst.take,
            };
            *place = place.or(bound.into());
        }
        Ok(worst)
    }

    /// Bounds the reading of any bytes, which is independent of the controller.
    pub(super) fn of_read(
        firmware: &Firmware,
        timing: &Timing,
        controller: &Controller,
    ) -> Result<Most, CyclesError> {
        let calls = controller.calls_of_any_read();
        let bounds =
            bounds(Bound::for_one_execution, firmware, timing, controller, &calls, &BTreeSet::new())?;
        Ok(bounds.iter().fold(Most::default(), |most, bound| most.or(bound.into())))
    }

    /// Bounds each command of a scheme while the scheme is loaded.
    pub(super) fn of_commands(
        firmware: &Firmware,
        timing: &Timing,
        controller: &Controller,
        scheme: &[u8],
    ) -> Result<Vec<Most>, CyclesError> {
        let mut controller = controller.clone();
        let calls = [controller.call_of_load(scheme)?];
        let marked = BTreeSet::from([firmware.command]);
        let bounds = bounds(Bound::for_one_execution, firmware, timing, &controller, &calls, &marked)?;
        Ok(bounds.iter().flat_map(|bound| &bound.calls).map(Most::from).collect())
    }
}

/// Bounds calls made once or repeatedly, starting from the controller's memory.
fn bounds(
    of: fn(&BoundRequest<'_>) -> Result<Vec<Bound>, BoundError>,
    firmware: &Firmware,
    timing: &Timing,
    controller: &Controller,
    calls: &[Call],
    marked: &BTreeSet<u32>,
) -> Result<Vec<Bound>, CyclesError> {
    let (memory, stack_top) = (Snapshot::from(controller.machine()), firmware.stack_top);
    let question = BoundRequest { image: &firmware.image, timing, memory: &memory, stack_top, calls, marked };
    of(&question).map_err(|source| CyclesError::Unbounded { source })
}
