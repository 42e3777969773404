//! Containment: what modules have written is looked at once per tick. A module that wrote what its signal cannot be is
//! cut out, with all that depend on it, until a reset or until another scheme has no place for it.

use heapless::Vec;

use super::Engine;
use crate::command::ModuleRef;
use crate::data_base::DataBase;
use crate::data_type::TypeRef;
use crate::kind::ModuleList;
use crate::limits::{MAX_MODULES, MAX_SLOTS};
use crate::wiring::{Wiring, module_bit};
use crate::word::Format;

/// A module wrote what its signal cannot be: no finite number, or one beyond what its unit
/// [can be](crate::Unit::largest).
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModuleFault {
    /// The module.
    pub module: ModuleRef,
    /// The signal.
    pub signal: TypeRef,
    /// Which of the signal's words, from 0.
    pub word: u16,
    /// The word, an `f32` in bits.
    pub bits: u32,
}

impl ModuleFault {
    /// What was written.
    #[must_use]
    pub const fn value(&self) -> f32 {
        f32::from_bits(self.bits)
    }
}

/// Words of format `f32` that cannot be larger than this.
#[derive(Debug, Clone, Copy)]
struct Span {
    start: u16,
    words: u16,
    /// Largest magnitude, an `f32` in bits.
    largest: u32,
}

impl Span {
    fn range(self) -> core::ops::Range<usize> {
        let start = usize::from(self.start);
        start..start + usize::from(self.words)
    }

    /// How far a word is below the largest, as magnitudes; beyond it, the sign bit is set.
    fn margin(self, word: u32) -> u32 {
        self.largest.wrapping_sub(word & MAGNITUDE)
    }

    /// Whether one of its words is what it cannot be.
    #[inline(always)]
    fn is_wrong(self, words: &[u32]) -> bool {
        let own = words.get(self.range()).unwrap_or_default();
        own.iter().fold(0, |margins, word| margins | self.margin(*word)) > MAGNITUDE
    }

    /// Takes in the words of another one, if they lie right beside its own.
    fn take_in(&mut self, other: Self) -> bool {
        let is_behind = self.range().end == other.range().start;
        let is_beside = is_behind || other.range().end == self.range().start;
        if self.largest != other.largest || !is_beside {
            return false;
        }
        self.start = if is_behind { self.start } else { other.start };
        self.words += other.words;
        true
    }
}

/// Words of a signal that a module writes.
#[derive(Debug, Clone, Copy)]
struct Written {
    span: Span,
    /// Of its module in the plug-in order.
    order: u8,
}

/// Bits of an `f32` without its sign. Of finite numbers they count up with the magnitude, and those of what is not
/// finite are above.
const MAGNITUDE: u32 = 0x7FFF_FFFF;

/// What is looked at in each tick, and which modules are cut out.
#[derive(Debug)]
pub(super) struct Containment {
    /// All that modules write, in as few pieces as there are.
    watched: Vec<Span, MAX_SLOTS>,
    /// Who writes it, in the order of the calls: the first that is wrong is the fault of who wrote it.
    written: Vec<Written, MAX_SLOTS>,
    /// Modules that are cut out, a bit for each place in the plug-in order.
    fallen: u32,
    is_device_lost: bool,
    /// The first one, while modules are cut out.
    fault: Option<ModuleFault>,
}

impl Containment {
    pub(super) const fn new() -> Self {
        Self { watched: Vec::new(), written: Vec::new(), fallen: 0, is_device_lost: false, fault: None }
    }

    pub(super) fn fallen(&self) -> u32 {
        self.fallen
    }

    /// Looks at all words that modules have written: whether one is wrong that was not before.
    #[inline]
    pub(super) fn finds_fault(&self, words: &[u32]) -> bool {
        self.watched.iter().any(|span| span.is_wrong(words)) && self.finds_new_fault(words)
    }

    #[cold]
    #[inline(never)]
    fn finds_new_fault(&self, words: &[u32]) -> bool {
        let mut sound = self.written.iter().filter(|written| !self.has_fallen(written.order));
        sound.any(|written| written.span.is_wrong(words))
    }

    fn has_fallen(&self, order: u8) -> bool {
        self.fallen & module_bit(order) != 0
    }

    /// Notes where all words are that modules write.
    fn watch<const WORDS: usize>(&mut self, wiring: &Wiring, data_base: &DataBase<WORDS>) {
        self.watched.clear();
        self.written.clear();
        for call in wiring.calls() {
            let Some(plugged) = wiring.called(call) else { continue };
            let ports = wiring.ports(plugged).iter();
            for port in ports.filter(|port| port.is_written() && port.stage() == call.stage) {
                let Some(entry) = data_base.entry(port.slot) else { continue };
                let block = data_base.storage().block(port.slot);
                let largest = entry.data_type.unit.largest().to_bits();
                if entry.data_type.format == Format::F32 {
                    // There is room: a slot that is written twice does not run.
                    let span = Span { start: block.offset, words: block.words, largest };
                    let _ = self.written.push(Written { span, order: call.order });
                    if !self.watched.iter_mut().any(|watched| watched.take_in(span)) {
                        let _ = self.watched.push(span);
                    }
                }
            }
        }
    }
}

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    /// The first module that failed, while modules are cut out for that; until a reset, or until a change of the scheme
    /// leaves it out. Whatever does not depend on it runs on.
    #[must_use]
    pub fn module_fault(&self) -> Option<ModuleFault> {
        self.containment.fault
    }

    /// Modules that are cut out: those that failed, and all that depend on them.
    pub fn fallen_modules(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        let modules = (0..).zip(self.plans.running().wiring.modules());
        let fallen = modules.filter(|(order, _)| self.containment.fallen & module_bit(*order) != 0);
        fallen.map(|(_, plugged)| plugged.module)
    }

    /// The module that failed, when an input of the device depends on it.
    #[inline]
    pub(crate) fn lost_device(&self) -> Option<ModuleFault> {
        if self.containment.is_device_lost { self.containment.fault } else { None }
    }

    /// Cuts out every module that has failed: one that has written what is wrong, and does not fall with another.
    #[cold]
    #[inline(never)]
    pub(super) fn contain(&mut self) {
        let Self { containment, plans, data_base, .. } = self;
        let Containment { written, fallen, is_device_lost, fault, .. } = containment;
        let before = *fallen;
        let wiring = &mut plans.running_mut().wiring;
        for written in written.iter().filter(|written| written.span.is_wrong(data_base.storage().all())) {
            if let Some(plugged) = wiring.at_mut(written.order.into())
                && *fallen & module_bit(written.order) == 0
            {
                plugged.has_failed = true;
                *fallen |= plugged.falls_with;
                *is_device_lost |= plugged.drives_device;
                *fault = fault.or_else(|| fault_in(written.span, plugged.module, data_base));
            }
        }
        // What they have left to be sent in this tick is wrong, too.
        for (order, plugged) in (0..).zip(wiring.modules()) {
            if let Some(end) = plugged.link_end.filter(|end| end.is_sending)
                && *fallen & !before & module_bit(order) != 0
                && let Some(port) = data_base.links().get(usize::from(end.link))
            {
                port.outgoing.clear();
            }
        }
    }

    /// Begins these modules anew, also those that are cut out, with what fell with them.
    pub(super) fn begin_anew(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        let out = self.clear_fallen();
        self.plans.running_mut().wiring.forgive(&is_meant);
        self.begin(is_meant);
        self.contain_anew(&out);
    }

    /// Modules that are cut out now, before they are [contained anew](Self::contain_anew). What they wrote becomes zero:
    /// nobody is to read it.
    pub(super) fn clear_fallen(&mut self) -> Vec<ModuleRef, MAX_MODULES> {
        let mut out = Vec::new();
        let wiring = &self.plans.running().wiring;
        for (order, plugged) in (0..).zip(wiring.modules()) {
            if self.containment.has_fallen(order) {
                let _ = out.push(plugged.module);
                for port in wiring.ports(plugged).iter().filter(|port| port.is_written()) {
                    self.data_base.overwrite(port.slot, core::iter::repeat(0));
                }
            }
        }
        out
    }

    /// Notes anew who is cut out and where all written words are: modules have come, gone, moved or been reset. `out`
    /// were cut out before; those of them that are not any more begin.
    pub(super) fn contain_anew(&mut self, out: &[ModuleRef]) {
        let Self { containment, plans, .. } = self;
        let wiring = &mut plans.running_mut().wiring;
        let failed = wiring.modules().iter().filter(|plugged| plugged.has_failed);
        containment.fallen = failed.clone().fold(0, |fallen, plugged| fallen | plugged.falls_with);
        containment.is_device_lost = failed.fold(false, |is_lost, plugged| is_lost | plugged.drives_device);
        containment.fault = containment.fault.filter(|_| containment.fallen != 0);
        let fallen = containment.fallen;
        let back = (0..).zip(wiring.modules()).filter(|(_, plugged)| out.contains(&plugged.module));
        let back = back.fold(0, |back, (order, _)| back | module_bit(order)) & !fallen;
        wiring.begin_places(back);
        self.begins |= back != 0;
        self.watch_writes();
    }

    /// Notes where all words are that modules write.
    pub(super) fn watch_writes(&mut self) {
        self.containment.watch(&self.plans.running().wiring, &self.data_base);
    }
}

/// Which of the words is wrong, and of which signal.
fn fault_in<const WORDS: usize>(
    written: Span,
    module: ModuleRef,
    data_base: &DataBase<WORDS>,
) -> Option<ModuleFault> {
    let words = data_base.storage().all().get(written.range())?;
    let (word, bits) = (0..).zip(words).find(|(_, word)| written.margin(**word) > MAGNITUDE)?;
    let mut signals = data_base.signals();
    let (_, entry) = signals.find(|(slot, _)| data_base.storage().block(*slot).range() == written.range())?;
    Some(ModuleFault { module, signal: entry.signal, word, bits: *bits })
}
