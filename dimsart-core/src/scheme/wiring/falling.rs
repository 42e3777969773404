//! Words to check after each call, and dependencies between modules: a failed module is isolated together
//! with its dependents.

use super::{ActiveModule, Call, IndexRange, Wiring};
use crate::data_base::{CheckedWords, Storage, bit};
use crate::limits::{MAX_MODULES, MAX_SLOTS};

/// Returns whether any element matches. Iterates from the end, which saves an instruction per element.
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

/// Returns a module's place in the plug-in order as one of 32 bits.
pub(crate) fn module_bit(order: u8) -> u32 {
    const { assert!(MAX_MODULES <= 32, "a set of modules is 32 bits") };
    1_u32.checked_shl(u32::from(order)).unwrap_or(0)
}

impl Wiring {
    /// Returns the words to check after a call.
    #[inline(always)]
    pub(crate) fn checked_words(&self, call: &Call) -> Option<&[CheckedWords]> {
        self.checked_words.get(call.checked_words.range())
    }

    /// Returns the modules that the device's inputs depend on, one bit per place in the plug-in order.
    pub(crate) fn drives_device(&self) -> u32 {
        self.drives_device
    }

    /// Returns the modules that are isolated if these have failed: the modules themselves and their
    /// dependents. One bit per place in the plug-in order.
    pub(crate) fn fall_with(&self, failed: u32) -> u32 {
        let fall = (0..).zip(self.modules.iter()).filter(|(_, plugged)| plugged.needs & failed != 0);
        fall.fold(0, |fallen, (order, _)| fallen | module_bit(order))
    }

    /// Computes which modules each module depends on: all that write its inputs, in this tick or the previous
    /// tick. `of_device` is the set of slots of the device's inputs, one bit each.
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
        // Transitive closure (Warshall).
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

    /// Collects the words to check after each call, and their location.
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
                    // Does not overflow: a scheme with a slot that is written twice does not run.
                    let _ = checked_words.push(span);
                }
            }
            let count = u8::try_from(checked_words.len() - start).unwrap_or(0);
            call.checked_words = IndexRange { start: u8::try_from(start).unwrap_or(0), count };
        }
    }
}
