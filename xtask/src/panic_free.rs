//! `cargo xtask panic-free`: nothing that a tick can reach in the machine code may panic.
//!
//! From `dimsart_tick` on, and from what brings it packets and takes them from it, every call in the machine code of
//! every image is followed. All of it must be the core's own, its mathematics', plain memory moves or tallies of what was
//! measured, without an instruction that traps: a panic, a formatter, an allocator or floats in software are faults, and
//! so is a call whose target cannot be seen.

use std::collections::BTreeSet;

use cycles::declared::Name;
use cycles::reach;

use crate::boards::{Image, build_all, declared};
use crate::shell::Outcome;
use crate::toolchain::Toolchain;

/// What the tick's interrupt asks of a controller in every period.
const ROOTS: [&str; 3] = ["dimsart_deliver", "dimsart_tick", "dimsart_take"];
/// What a tick may be made of.
const ALLOWED: [&str; 14] = [
    "dimsart_core::*",
    "<dimsart_core::*",
    // The tallies of images that measure.
    "firmware::measure::*",
    "<firmware::measure::*",
    "micromath::*",
    "<micromath::*",
    "fmaxf",
    "fminf",
    "memcpy",
    "memmove",
    "memset",
    "memcmp",
    "__aeabi_mem*",
    "compiler_builtins::mem::*",
];

/// Builds every image and follows every path of its tick.
pub(crate) fn run() -> Outcome {
    hold(&build_all(Toolchain::set_up()?)?)
}

/// Follows every path of the images' ticks.
pub(crate) fn hold(images: &[Image]) -> Outcome {
    let allowed = ALLOWED.map(Name::new);
    let declared = declared()?;
    for image in images {
        let (name, image) = (&image.name, image.read()?);
        let mut functions = BTreeSet::new();
        for root in ROOTS {
            let reached = reach::only(&image, &declared, root, &allowed);
            let reached =
                reached.map_err(|error| format!("{name}: a tick does what it must not: {error}"))?;
            functions.extend(reached.functions);
        }
        println!("{name}: a tick reaches {} functions, none of which can panic", functions.len());
    }
    Ok(())
}
