//! `cargo xtask panic-free`: nothing that a tick can reach in the machine code may panic, and all of it is in CCM SRAM
//! where the board has the tick there.
//!
//! From `dimsart_tick` on, and from what brings it packets and takes them from it, every call in the machine code of
//! every image is followed. All of it must be the core's own, its mathematics', plain memory moves or statistics of
//! what was measured, without an instruction that traps: a panic, a formatter, an allocator or floats in software are
//! faults, and so is a call whose target cannot be seen.

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
    // The statistics of images that measure.
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
            let outside = outside_ccm(&image, &reached.addresses);
            if !outside.is_empty() {
                let functions = outside.join("\n    ");
                return Err(format!(
                    "{name}: {root} reaches what is not in CCM SRAM; name it in boards/ccm.x:\n    {functions}"
                ));
            }
            functions.extend(reached.functions);
        }
        println!("{name}: a tick reaches {} functions, none of which can panic", functions.len());
    }
    Ok(())
}

/// Which of these functions flash is waited for in, of an image that has a tick in CCM SRAM.
fn outside_ccm(image: &cycles::image::Image, functions: &BTreeSet<u32>) -> Vec<String> {
    let [start, end] = ["__sccm", "__eccm"].map(|name| image.symbols.get(name).copied().unwrap_or(0));
    let outside = functions.iter().filter(|address| !(start..end).contains(*address));
    if start == end { Vec::new() } else { outside.map(|address| image.place(*address)).collect() }
}

#[cfg(test)]
mod tests {
    use cycles::image::Image;

    use super::{BTreeSet, outside_ccm};

    #[test]
    fn what_is_not_in_the_ccm_sram_is_named_where_there_is_some() {
        let reached = BTreeSet::from([0x1000_0000, 0x1000_0FFE, 0x1000_1000, 0x0800_0100]);
        let mut image = Image::default();
        assert_eq!(outside_ccm(&image, &reached), [""; 0]);
        let marks = [("__sccm", 0x1000_0000), ("__eccm", 0x1000_1000)];
        image.symbols.extend(marks.map(|(name, address)| (name.to_owned(), address)));
        assert_eq!(outside_ccm(&image, &reached), ["0x08000100", "0x10001000"]);
    }
}
