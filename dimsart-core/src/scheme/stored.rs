//! Storage of the running and the pending scheme.

use core::fmt;

use crate::data_base::{Block, List, Storage, bit};
use crate::module::{Binding, ModuleBindings, ModuleRef};
use crate::scheme::wiring::{ActiveModule, Wiring};

/// A module instance, plugged in or not. Its parameters and state are in words of the Data Base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instance {
    pub(crate) reference: ModuleRef,
    /// Period of the module in ticks.
    pub(crate) every_ticks: u8,
    /// Handles, settings and gains. Both schemes share the block until one of them changes it.
    pub(crate) configuration: Block,
    /// Both schemes share the block, so that a module in both keeps its state.
    pub(crate) state: Block,
}

impl Instance {
    /// Placeholder for a missing instance.
    const NONE: Self =
        Self { reference: ModuleRef::NONE, every_ticks: 1, configuration: Block::FREE, state: Block::FREE };

    pub(crate) fn blocks(&self) -> [Block; 2] {
        [self.configuration, self.state]
    }

    /// Adjusts the offsets after a block at the end was freed.
    fn close_gap(&mut self, gone: Block) {
        for block in [&mut self.configuration, &mut self.state] {
            if block.offset < gone.offset {
                block.offset += gone.words;
            }
        }
    }
}

/// Module instances, the bindings of their ports, and the wiring of those that are plugged in.
#[derive(Debug)]
pub(crate) struct Scheme {
    pub(crate) instances: List<Instance>,
    pub(crate) bindings: List<Binding>,
    pub(crate) wiring: Wiring,
    pub(crate) place_before: Option<ModuleRef>,
}

impl Scheme {
    pub(crate) fn new(instances: List<Instance>, bindings: List<Binding>, wiring: Wiring) -> Self {
        Self { instances, bindings, wiring, place_before: None }
    }

    /// Copies another scheme, in place.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.instances.clear();
        self.bindings.clear();
        let _ = self.instances.extend_from_slice(other.instances);
        let _ = self.bindings.extend_from_slice(other.bindings);
        self.wiring.copy_from(&other.wiring);
        self.place_before = other.place_before;
    }

    pub(crate) fn instance(&self, module: ModuleRef) -> Option<&Instance> {
        self.instances.iter().find(|instance| instance.reference == module)
    }

    pub(crate) fn instance_mut(&mut self, module: ModuleRef) -> Option<&mut Instance> {
        self.instances.iter_mut().find(|instance| instance.reference == module)
    }

    /// Returns the instance of a module that is plugged in.
    pub(crate) fn instance_of(&self, plugged: &ActiveModule) -> Option<&Instance> {
        self.instances.get(usize::from(plugged.instance))
    }

    pub(crate) fn is_plugged_in(&self, module: ModuleRef) -> bool {
        self.wiring.find(module).is_some()
    }

    pub(crate) fn bound(&self, module: ModuleRef) -> ModuleBindings<'_> {
        ModuleBindings { module, bindings: self.bindings }
    }

    /// Returns whether a module has this block.
    fn has(&self, module: ModuleRef, block: Block) -> bool {
        self.instance(module).is_some_and(|instance| instance.blocks().contains(&block))
    }

    /// Returns whether a module that is plugged in here continues from another scheme: with the same state,
    /// memories and ports.
    pub(crate) fn continues(&self, plugged: &ActiveModule, before: &Self, there: &ActiveModule) -> bool {
        let state = |scheme: &Self, plugged| scheme.instance_of(plugged).map(|instance| instance.state);
        let memories = |scheme: &Self, plugged: &ActiveModule| {
            let ports = scheme.wiring.ports(plugged).iter().filter(|port| port.is_memory());
            ports.fold(0, |slots, port| slots | bit(port.slot))
        };
        plugged.is_alike
            && state(self, plugged) == state(before, there)
            && memories(self, plugged) == memories(before, there)
    }

    /// Updates the handles and calls of the modules that are plugged in to the current location of all words.
    pub(crate) fn connect(&mut self, storage: &mut Storage) {
        let Self { instances, wiring, .. } = self;
        wiring.connect(storage, |instance| {
            instances.get(usize::from(instance)).unwrap_or(&Instance::NONE).blocks()
        });
    }
}

/// The running and the pending scheme.
pub(crate) struct Schemes {
    pair: [Scheme; 2],
    runs_second: bool,
}

impl fmt::Debug for Schemes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Schemes").field("running", self.running()).field("pending", self.pending()).finish()
    }
}

impl Schemes {
    pub(crate) fn new(pair: [Scheme; 2]) -> Self {
        Self { pair, runs_second: false }
    }

    #[inline(always)]
    pub(crate) fn running(&self) -> &Scheme {
        let [first, second] = &self.pair;
        if self.runs_second { second } else { first }
    }

    #[inline(always)]
    pub(crate) fn running_mut(&mut self) -> &mut Scheme {
        let [first, second] = &mut self.pair;
        if self.runs_second { second } else { first }
    }

    pub(crate) fn pending(&self) -> &Scheme {
        let [first, second] = &self.pair;
        if self.runs_second { first } else { second }
    }

    pub(crate) fn pending_mut(&mut self) -> &mut Scheme {
        self.split_mut().1
    }

    /// Returns the running scheme, and the pending scheme to change.
    pub(crate) fn split_mut(&mut self) -> (&mut Scheme, &mut Scheme) {
        let [first, second] = &mut self.pair;
        if self.runs_second { (second, first) } else { (first, second) }
    }

    /// Swaps the running and the pending scheme.
    pub(crate) fn switch(&mut self) {
        self.runs_second = !self.runs_second;
    }

    /// Returns whether both schemes use this block of a module.
    pub(crate) fn share(&self, module: ModuleRef, block: Block) -> bool {
        self.pair.iter().all(|scheme| scheme.has(module, block))
    }

    /// Returns whether either scheme uses this block of a module.
    pub(crate) fn have(&self, module: ModuleRef, block: Block) -> bool {
        self.pair.iter().any(|scheme| scheme.has(module, block))
    }

    /// Adjusts the modules' blocks after a block at the end was freed.
    pub(crate) fn close_gap(&mut self, gone: Block) {
        for instance in self.pair.iter_mut().flat_map(|scheme| scheme.instances.iter_mut()) {
            instance.close_gap(gone);
        }
    }
}
