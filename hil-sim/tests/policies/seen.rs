//! Observation of a side after a tick.

use crate::faulty_pair::Pair;
use dimsart_core::{
    DriveState, ModuleFault, ModuleRef, ReasonCounts, SafetyReason, Scalar as _, TickResult, types,
};
use dimsart_link::{Event, EventLog};

/// Of one side.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) ticks: u64,
    pub(crate) came: TickResult,
    pub(crate) reason: SafetyReason,
    pub(crate) state: DriveState,
    /// Forces commanded by the scheme and applied to the device, N.
    pub(crate) commanded_n: Vec<f32>,
    pub(crate) given_n: Vec<f32>,
    pub(crate) counts: ReasonCounts,
    pub(crate) refused_ticks: u32,
    pub(crate) called: Vec<ModuleRef>,
    /// Modules that are cut out.
    pub(crate) fallen: Vec<ModuleRef>,
    pub(crate) module_fault: Option<ModuleFault>,
    pub(crate) has_sent: bool,
    pub(crate) is_running: bool,
    pub(crate) holder: u8,
    pub(crate) last_event: u32,
    /// Those since the tick before.
    pub(crate) events: Vec<Event>,
    /// Waves of all axes that leave for the line and come from it, sqrt(W).
    pub(crate) waves: [Vec<f32>; 2],
}

impl Seen {
    /// A side as it is now; `before_event` is the last one that was known.
    pub(crate) fn of(pair: &mut Pair, side: usize, log: &EventLog, before_event: u32) -> Self {
        let given_n = pair.force_n()[side].to_vec();
        let has_sent = pair.has_sent()[side];
        let [controller, _] = pair.of(side);
        let (dimsart, heartbeat) = (controller.dimsart(), controller.info().heartbeat(0));
        let values = |signal| dimsart.signals(&[signal]).map(f32::from_word).collect::<Vec<_>>();
        let news = log.last().wrapping_sub(before_event).min(u8::MAX.into());
        let events = (0..news).rev().filter_map(|back| log.get(u8::try_from(back).unwrap()));
        Self {
            ticks: heartbeat.ticks,
            came: controller.last_tick(),
            reason: dimsart.safety().reason(),
            state: dimsart.safety().state(),
            commanded_n: values(types::DES_FORCE.first()),
            given_n,
            counts: *dimsart.safety().counts(),
            refused_ticks: dimsart.refused_ticks(),
            called: controller.called().collect(),
            fallen: dimsart.engine().isolated_modules().collect(),
            module_fault: dimsart.engine().module_fault(),
            has_sent,
            is_running: dimsart.engine().is_running(),
            holder: heartbeat.lease.holder,
            last_event: heartbeat.events,
            events: events.collect(),
            waves: [values(types::CH1_WAVES.first()), values(types::CH2_WAVES.first())],
        }
    }

    /// How often a module was called.
    pub(crate) fn calls_of(&self, module: ModuleRef) -> usize {
        self.called.iter().filter(|called| **called == module).count()
    }

    pub(crate) fn is_held_back(&self) -> bool {
        self.came != TickResult::Ran
    }
}
