//! Containment: what a module writes is looked at right behind its call. A module that wrote what its signal cannot be is
//! cut out, with all that depend on it, until a reset or until another scheme has no place for it.

use super::Engine;
use crate::command::ModuleRef;
use crate::data_base::DataBase;
use crate::data_type::TypeRef;
use crate::kind::ModuleList;
use crate::wiring::{Wiring, module_bit};

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

/// Which modules are cut out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Containment {
    /// Modules that have failed, a bit for each place in the plug-in order.
    pub(super) failed: u32,
    /// Modules that are cut out: those, and all that depend on them.
    pub(super) fallen: u32,
    is_device_lost: bool,
    /// The first one, while modules are cut out.
    fault: Option<ModuleFault>,
}

impl Containment {
    pub(super) const fn new() -> Self {
        Self { failed: 0, fallen: 0, is_device_lost: false, fault: None }
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

    /// Takes note of modules that have failed in this tick, the first of them in this call.
    #[cold]
    #[inline(never)]
    pub(super) fn note_failed(&mut self, failed: u32, fallen: u32, first_call: usize) {
        let wiring = &self.plans.running().wiring;
        let Containment { failed: all_failed, fallen: all_fallen, is_device_lost, fault } =
            &mut self.containment;
        *all_failed |= failed;
        *all_fallen = fallen;
        *is_device_lost |= failed & wiring.drives_device() != 0;
        *fault = fault.or_else(|| fault_of(wiring, first_call, &self.data_base));
    }

    /// Begins these modules anew, also those that are cut out, with what fell with them.
    pub(super) fn begin_anew(&mut self, is_meant: impl Fn(ModuleRef) -> bool) {
        let modules = (0..).zip(self.plans.running().wiring.modules());
        let meant = modules.filter(|(_, plugged)| is_meant(plugged.module));
        let meant = meant.fold(0, |meant, (order, _)| meant | module_bit(order));
        let Containment { failed, fallen, .. } = self.containment;
        self.clear_fallen();
        self.begin(is_meant);
        self.contain_anew(failed & !meant, fallen);
    }

    /// What modules wrote that are cut out becomes zero, before they are [contained anew](Self::contain_anew): nobody is
    /// to read it.
    pub(super) fn clear_fallen(&mut self) {
        let wiring = &self.plans.running().wiring;
        for (order, plugged) in (0..).zip(wiring.modules()) {
            if self.containment.fallen & module_bit(order) != 0 {
                for port in wiring.ports(plugged).iter().filter(|port| port.is_written()) {
                    self.data_base.overwrite(port.slot, core::iter::repeat(0));
                }
            }
        }
    }

    /// Cuts out those that fall with these modules that have failed, and no other. Those that were cut out before and are
    /// not any more begin. A bit for each place in the plug-in order.
    pub(super) fn contain_anew(&mut self, failed: u32, before: u32) {
        let wiring = &mut self.plans.running_mut().wiring;
        let orders = (0..).take(wiring.modules().len());
        let fall = orders.filter(|order| failed & module_bit(*order) != 0);
        let fallen = fall.fold(0, |fallen, order| fallen | wiring.falls_with(order));
        let back = before & !fallen;
        wiring.begin_places(back);
        self.begins |= back != 0;
        let is_device_lost = failed & wiring.drives_device() != 0;
        let fault = self.containment.fault.filter(|_| fallen != 0);
        self.containment = Containment { failed, fallen, is_device_lost, fault };
    }
}

/// The first word that is wrong behind a call.
fn fault_of<const WORDS: usize>(
    wiring: &Wiring,
    call: usize,
    data_base: &DataBase<WORDS>,
) -> Option<ModuleFault> {
    let before = wiring.calls().iter().take(call).map(|call| usize::from(call.spans)).sum();
    let call = wiring.calls().get(call)?;
    let plugged = wiring.called(call)?;
    let words = data_base.storage().all();
    let mut wrong = wiring.spans().skip(before).take(call.spans.into()).filter_map(|span| {
        let mut own = span.block.range();
        own.find(|place| words.get(*place).is_some_and(|word| span.is_wrong(*word)))
    });
    let place = wrong.next()?;
    let mut ports = wiring.ports(plugged).iter().filter(|port| port.is_written());
    let slot = ports.find(|port| data_base.storage().block(port.slot).range().contains(&place))?.slot;
    let word = place - data_base.storage().block(slot).range().start;
    Some(ModuleFault {
        module: plugged.module,
        signal: data_base.entry(slot)?.signal,
        word: u16::try_from(word).unwrap_or(u16::MAX),
        bits: *words.get(place)?,
    })
}
