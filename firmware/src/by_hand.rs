//! Table 1 as one function, by name as the [controller](crate::entry_points)'s are: what a tick is measured by.
#![expect(unsafe_code, reason = "the names are for a host tool; nothing else of the image has them")]

use by_hand::{DOF, Master, Packet};

/// What a tick takes from the device, and gives to it and to the link.
#[repr(C)]
struct Frames {
    position: [f32; DOF],
    force: [f32; DOF],
    send: Packet,
}

/// Before the first tick.
#[unsafe(export_name = "by_hand_start")]
extern "C" fn start(master: &mut Master) {
    *master = Master::new();
}

/// One tick, with the packet that came in, if any.
#[unsafe(export_name = "by_hand_tick")]
extern "C" fn tick(master: &mut Master, frames: &mut Frames, received: Option<&Packet>) -> bool {
    master.tick(&frames.position, received, &mut frames.force, &mut frames.send)
}
