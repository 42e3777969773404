//! Order of the calls in a tick.

use heapless::Vec;

use crate::limits::{MAX_CALLS, MAX_MODULES, MAX_SLOTS};
use crate::module::Stage;
use crate::scheme::wiring::{Port, Wiring};

/// A call: index of its module in the plug-in order, and stage.
type Entry = (u8, Stage);

/// Orders the modules' calls: early stages in plug-in order, each late stage as soon as all its inputs have
/// been written.
///
/// A late stage does not wait for signals without a writer, which the matching check reports. Late stages
/// that wait for each other come last, in plug-in order; the check reports the delay.
pub(crate) fn schedule(wiring: &Wiring) -> Vec<Entry, MAX_CALLS> {
    let mut scheduler = Scheduler { wiring, unwritten: [0; MAX_SLOTS], calls: Vec::new() };
    for (order, _) in (0..).zip(wiring.modules()) {
        for stage in [Stage::Early, Stage::Late] {
            scheduler.count(order, stage, |count| count.saturating_add(1));
        }
    }
    let mut waiting = Vec::<u8, MAX_MODULES>::new();
    for (order, _) in (0..).zip(wiring.modules()) {
        scheduler.add(order, Stage::Early);
        if scheduler.late_ports(order).next().is_some() {
            let _ = waiting.push(order);
        }
        while let Some(ready) = waiting.iter().position(|&order| scheduler.can_follow(order)) {
            scheduler.add(waiting.remove(ready), Stage::Late);
        }
    }
    for order in waiting {
        scheduler.add(order, Stage::Late);
    }
    scheduler.calls
}

struct Scheduler<'a> {
    wiring: &'a Wiring,
    /// By slot: writes of this tick that are not in `calls` yet.
    unwritten: [u8; MAX_SLOTS],
    calls: Vec<Entry, MAX_CALLS>,
}

impl<'a> Scheduler<'a> {
    fn add(&mut self, order: u8, stage: Stage) {
        self.count(order, stage, |count| count.saturating_sub(1));
        let _ = self.calls.push((order, stage));
    }

    fn count(&mut self, order: u8, stage: Stage, change: impl Fn(u8) -> u8) {
        let is_written = |port: &&Port| port.is_written() && port.stage() == stage;
        for port in self.ports(order).iter().filter(is_written) {
            if let Some(count) = self.unwritten.get_mut(usize::from(port.slot)) {
                *count = change(*count);
            }
        }
    }

    fn can_follow(&self, order: u8) -> bool {
        self.late_ports(order)
            .filter(|port| !port.is_written())
            .all(|port| self.unwritten.get(usize::from(port.slot)).is_none_or(|count| *count == 0))
    }

    fn late_ports(&self, order: u8) -> impl Iterator<Item = &Port> {
        self.ports(order).iter().filter(|port| port.stage() == Stage::Late)
    }

    fn ports(&self, order: u8) -> &'a [Port] {
        self.wiring.modules().get(usize::from(order)).map_or(&[], |plugged| self.wiring.ports(plugged))
    }
}
