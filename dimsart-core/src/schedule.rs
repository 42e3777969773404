//! The order of the calls in a tick.

use heapless::Vec;

use crate::engine::{Call, Instance};
use crate::limits::{MAX_MODULES, MAX_SLOTS};
use crate::module::ModuleList;
use crate::port::Stage;

/// Most calls in a tick: each module early and late.
pub(crate) const MAX_CALLS: usize = 2 * MAX_MODULES;

/// Puts the modules' calls in order: early stages in plug-in order, each late stage as soon as
/// everything it reads has been written.
///
/// A late stage that waits for something nobody writes comes at the end; the matching check reports
/// what it waits for.
pub(crate) fn schedule<M: ModuleList>(
    instances: &[Instance<M>],
    plug_in_order: &[u8],
) -> Vec<Call<M>, MAX_CALLS> {
    let mut plan = Plan { instances, unwritten: [0; MAX_SLOTS], calls: Vec::new() };
    for &instance in plug_in_order {
        for stage in [Stage::Early, Stage::Late] {
            plan.count(instance, stage, |count| count.saturating_add(1));
        }
    }
    let mut waiting = Vec::<u8, MAX_MODULES>::new();
    for &instance in plug_in_order {
        plan.add(instance, Stage::Early);
        if plan.has_late_stage(instance) {
            let _ = waiting.push(instance);
        }
        while let Some(ready) = waiting.iter().position(|&instance| plan.can_follow(instance)) {
            plan.add(waiting.remove(ready), Stage::Late);
        }
    }
    for instance in waiting {
        plan.add(instance, Stage::Late);
    }
    plan.calls
}

struct Plan<'a, M> {
    instances: &'a [Instance<M>],
    /// By slot: writes of this tick that are not in `calls` yet.
    unwritten: [u8; MAX_SLOTS],
    calls: Vec<Call<M>, MAX_CALLS>,
}

impl<M: ModuleList> Plan<'_, M> {
    fn add(&mut self, instance: u8, stage: Stage) {
        self.count(instance, stage, |count| count.saturating_sub(1));
        if let Some(call) = Call::new(instance, stage, self.instances) {
            let _ = self.calls.push(call);
        }
    }

    fn count(&mut self, instance: u8, stage: Stage, change: impl Fn(u8) -> u8) {
        let Some(instance) = self.instances.get(usize::from(instance)) else { return };
        let is_written = |port: &&crate::engine::Port| port.is_written && port.stage == stage;
        for port in instance.ports.iter().filter(is_written) {
            if let Some(count) = self.unwritten.get_mut(usize::from(port.slot)) {
                *count = change(*count);
            }
        }
    }

    fn has_late_stage(&self, instance: u8) -> bool {
        self.late_ports(instance).next().is_some()
    }

    fn can_follow(&self, instance: u8) -> bool {
        self.late_ports(instance)
            .filter(|port| !port.is_written)
            .all(|port| self.unwritten.get(usize::from(port.slot)).is_none_or(|count| *count == 0))
    }

    fn late_ports(&self, instance: u8) -> impl Iterator<Item = &crate::engine::Port> {
        let ports = self.instances.get(usize::from(instance)).map(|instance| instance.ports.iter());
        ports.into_iter().flatten().filter(|port| port.stage == Stage::Late)
    }
}
