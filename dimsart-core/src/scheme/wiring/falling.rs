//! Which words are looked at behind which call, and which modules need which: they fall with those that wrote what is wrong.

use super::{ActiveModule, Call, IndexRange, Wiring};
use crate::data_base::{CheckedWords, Storage, bit};
use crate::limits::{MAX_MODULES, MAX_SLOTS};

/// Whether one of a list is meant, from its end: counting down takes an instruction less than an iterator.
#[inline(always)]
pub(crate) fn any<T>(mut list: &[T], mut is_meant: impl FnMut(&T) -> bool) -> bool {
    while let [rest @ .., last] = list {
        if is_meant(last) {
            return true;
        }
        list = rest;
    }
    false
}

/// A module's place in the plug-in order as one of 32 bits.
pub(crate) fn module_bit(order: u8) -> u32 {
    const { assert!(MAX_MODULES <= 32, "a set of modules is 32 bits") };
    1_u32.checked_shl(u32::from(order)).unwrap_or(0)
}

impl Wiring {
    /// What is checked after a call.
    #[inline(always)]
    pub(crate) fn checked_words(&self, call: &Call) -> Option<&[CheckedWords]> {
        self.checked_words.get(call.checked_words.range())
    }

    /// Modules that the device gets nothing without, a bit for each place in the plug-in order.
    pub(crate) fn drives_device(&self) -> u32 {
        self.drives_device
    }

    /// Modules that are cut out when these have failed: themselves, and all that depend on them. Sets of a bit for each
    /// place in the plug-in order.
    pub(crate) fn fall_with(&self, failed: u32) -> u32 {
        let fall = (0..).zip(self.modules.iter()).filter(|(_, plugged)| plugged.needs & failed != 0);
        fall.fold(0, |fallen, (order, _)| fallen | module_bit(order))
    }

    /// Finds out which modules need which: all that write what one of them reads, in this tick or in the one before.
    /// `of_device` are the slots of the device's inputs, a bit each.
    pub(crate) fn find_needs(&mut self, of_device: u64) {
        let Self { modules, ports, .. } = self;
        let mut writers = [0; MAX_SLOTS];
        for (order, plugged) in (0..).zip(modules.iter()) {
            for port in plugged.ports.of(ports).iter().filter(|port| port.is_written()) {
                if let Some(writers) = writers.get_mut(usize::from(port.slot)) {
                    *writers |= module_bit(order);
                }
            }
        }
        for (order, plugged) in (0..).zip(modules.iter_mut()) {
            let read = plugged.ports.of(ports).iter().filter(|port| !port.is_written() && !port.is_memory());
            let writers = read.filter_map(|port| writers.get(usize::from(port.slot)));
            plugged.needs = writers.fold(module_bit(order), |needs, writers| needs | writers);
        }
        // Warshall: what those need that it needs.
        for (order, at) in (0..).zip(0..modules.len()) {
            let further = modules.get(at).map_or(0, |plugged| plugged.needs);
            if further != module_bit(order) {
                let those = modules.iter_mut().filter(|plugged| plugged.needs & module_bit(order) != 0);
                those.for_each(|plugged| plugged.needs |= further);
            }
        }
        let drive = |plugged: &&ActiveModule| {
            let mut written = plugged.ports.of(ports).iter().filter(|port| port.is_written());
            written.any(|port| bit(port.slot) & of_device != 0)
        };
        self.drives_device = modules.iter().filter(drive).fold(0, |needed, plugged| needed | plugged.needs);
    }

    /// Finds out what is looked at behind which call, and where it lies.
    pub(super) fn find_checked_words(&mut self, storage: &Storage) {
        let Self { modules, ports, calls, checked_words, .. } = self;
        checked_words.clear();
        for call in calls.iter_mut() {
            let Some(plugged) = modules.get(usize::from(call.order)) else { continue };
            let start = checked_words.len();
            let written = plugged.ports.of(ports).iter().filter(|port| port.is_written());
            for port in written.filter(|port| port.stage() == call.stage) {
                let Some(largest) = port.largest() else { continue };
                let span = CheckedWords::new(storage.block(port.slot), largest);
                let last = checked_words.get_mut(start..).and_then(<[CheckedWords]>::last_mut);
                if !last.is_some_and(|last| last.take_in(span)) {
                    // There is room: a slot that is written twice does not run.
                    let _ = checked_words.push(span);
                }
            }
            let count = u8::try_from(checked_words.len() - start).unwrap_or(0);
            call.checked_words = IndexRange { start: u8::try_from(start).unwrap_or(0), count };
        }
    }
}
