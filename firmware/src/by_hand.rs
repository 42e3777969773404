//! Table 1 as a single function, exported by name like the [controller](crate::entry_points): the reference
//! for a tick's cost.
#![expect(unsafe_code, reason = "exported names for a host tool, unique in the image")]

use by_hand::{DOF, Master, Packet};

/// Inputs and outputs of a tick.
#[repr(C)]
struct Frames {
    position: [f32; DOF],
    force: [f32; DOF],
    send: Packet,
}

/// Starts before the first tick.
#[unsafe(export_name = "by_hand_start")]
extern "C" fn start(master: &mut Master) {
    *master = Master::new();
}

/// Runs one tick with the received packet, if any.
#[unsafe(export_name = "by_hand_tick")]
extern "C" fn tick(master: &mut Master, frames: &mut Frames, received: Option<&Packet>) -> bool {
    master.tick(&frames.position, received, &mut frames.force, &mut frames.send)
}
