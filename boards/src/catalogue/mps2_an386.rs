//! Data of the emulated MPS2+ AN386.

use dimsart_core::limits::Capacities;

use super::{BILATERAL, CodeMemory, DEFAULT_GROUPS, ToolData};

/// See [`ToolData`].
pub(crate) const TOOLING: ToolData = ToolData {
    clock_hz: 25_000_000,
    tick_hz: 1_000,
    axes: 3,
    sizes: Capacities {
        modules: 32,
        wires: 240,
        bindings: 64,
        slots: 64,
        links: 2,
        programs: 4,
        words: 32_768,
    },
    memory: CodeMemory::ZeroWaitStates,
    chip: None,
    modules: &DEFAULT_GROUPS,
    variants: &["timer-tick", "timer-tick,measure", "auth", "auth,timer-tick"],
    pins: &[],
    interrupts: INTERRUPTS,
    motor: None,
    drive: None,
    scheme: BILATERAL,
};

const INTERRUPTS: &[(&str, i16)] = &[
    ("boards::mps2_an386::unexpected", 0),
    ("boards::mps2_an386::clock::timer_interrupt", 0x20),
    ("boards::mps2_an386::run_tick", 0x40),
    ("boards::mps2_an386::run_background", 0x80),
    ("boards::mps2_an386::uart::received", 0x80),
    ("boards::mps2_an386::uart::sent", 0x80),
];
