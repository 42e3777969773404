//! `cargo xtask step panic-free`: proves that machine code of a tick or current loop cannot panic, and is in
//! CCM SRAM if the board places it there.
//!
//! Follows every call in the machine code of every image, from `dimsart_tick` and the functions that deliver
//! and take its packets. Only functions of the core, modules, mathematics, memory copies and measurement
//! statistics are allowed, without trapping instructions. Panics, formatters, allocators, soft-float
//! functions and unresolved calls are errors.

use std::collections::BTreeSet;

use cycles::declarations::NamePattern;
use cycles::image::Image;
use cycles::reachability;

use crate::boards::{self, build_all, declared};
use crate::shell::Outcome;
use crate::toolchain::Toolchain;

/// Functions called by the tick's interrupt in every period.
const ROOTS: [&str; 3] = ["dimsart_deliver", "dimsart_tick", "dimsart_take"];
/// Functions allowed in a tick.
const ALLOWED: [&str; 17] = [
    "dimsart_core::*",
    "<dimsart_core::*",
    "dimsart_modules::*",
    "<dimsart_modules::*",
    // Statistics of images with measurements.
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
    LONG_JUMP,
];
/// Veneers to and from CCM SRAM.
const LONG_JUMP: &str = "__Thumbv7ABSLongThunk_*";

/// A drive's current loop, if the board has one.
const CURRENT_LOOP: &str = "dimsart_current_loop";
/// Functions allowed in the current loop.
const ALLOWED_IN_LOOP: [&str; 5] = [
    "drive::*",
    "boards::current_loop::*",
    "boards::stm32g4::spi_encoder::*",
    "boards::stm32g4::i2c_encoder::*",
    "fmaxf",
];
/// Functions called while no torque is commanded, and their callees: they may run from flash.
const BESIDE_LOOP: [&str; 10] = [
    "boards::current_loop::CurrentLoop::prepare",
    "boards::current_loop::CurrentLoop::begin_identification",
    "boards::current_loop::identifying::*",
    "drive::identification::*",
    "<core::iter::adapters::zip::Zip<*",
    "boards::current_loop::CurrentLoop::forget",
    "__aeabi_*",
    "__*divmod*",
    "compiler_builtins::int::*",
    LONG_JUMP,
];

/// Builds every image and follows every path of its tick.
pub(crate) fn run() -> Outcome {
    hold(&build_all(Toolchain::set_up()?, boards::Images::All)?)
}

/// Follows every path of the images' ticks.
pub(crate) fn hold(images: &[boards::Image]) -> Outcome {
    let allowed = ALLOWED.map(NamePattern::new);
    let declared = declared()?;
    for image in images {
        let (name, image) = (&image.name, image.read()?);
        let mut functions = BTreeSet::new();
        for root in ROOTS {
            let reached = reachability::check_reachable(&image, &declared, root, &allowed);
            let reached = reached.map_err(|error| format!("{name}: forbidden code in a tick: {error}"))?;
            hold_to_ccm(name, &image, root, &reached.addresses, &[])?;
            functions.extend(reached.functions);
        }
        println!("{name}: a tick reaches {} functions, none of which can panic", functions.len());
        if image.function(CURRENT_LOOP).is_some() {
            let allowed = BESIDE_LOOP.map(NamePattern::new);
            let allowed = [&ALLOWED_IN_LOOP.map(NamePattern::new)[..], &allowed].concat();
            let reached = reachability::check_reachable(&image, &declared, CURRENT_LOOP, &allowed);
            let reached =
                reached.map_err(|error| format!("{name}: forbidden code in a current loop: {error}"))?;
            hold_to_ccm(name, &image, CURRENT_LOOP, &reached.addresses, &allowed)?;
            println!(
                "{name}: a current loop reaches {} functions, none of which can panic",
                reached.functions.len()
            );
        }
    }
    Ok(())
}

/// Fails if a root in CCM SRAM reaches functions outside, except the functions named in `allowed`.
fn hold_to_ccm(
    name: &str,
    image: &Image,
    root: &str,
    functions: &BTreeSet<u32>,
    allowed: &[NamePattern],
) -> Outcome {
    let [start, end] = ["__sccm", "__eccm"].map(|name| image.symbols.get(name).copied().unwrap_or(0));
    let is_inside = |address: u32| (start..end).contains(&address);
    if !image.function(root).is_some_and(|root| is_inside(root.address)) {
        return Ok(());
    }
    let is_beside = |address: &u32| {
        image.functions.get(address).is_some_and(|function| allowed.iter().any(|name| name.matches(function)))
    };
    let outside = functions.iter().filter(|address| !is_inside(**address) && !is_beside(address));
    let outside: Vec<String> = outside.map(|address| image.location(*address)).collect();
    if outside.is_empty() {
        return Ok(());
    }
    let functions = outside.join("\n    ");
    Err(format!(
        "{name}: {root} calls functions outside CCM SRAM; add them to boards/ccm*.x:\n    {functions}"
    ))
}

#[cfg(test)]
mod tests {
    use cycles::image::Function;

    use super::{BTreeSet, Image, NamePattern, hold_to_ccm};

    #[test]
    fn what_is_not_in_the_ccm_sram_is_named_where_the_root_is_there() {
        let reached = BTreeSet::from([0x1000_0000, 0x1000_0FFE, 0x1000_1000, 0x0800_0100]);
        let mut image = Image::default();
        let functions = [("tick", 0x1000_0000), ("late", 0x1000_1000), ("cold", 0x0800_0100)];
        image.functions.extend(
            functions.map(|(name, address)| {
                (address, Function { names: vec![name.to_owned()], address, bytes: 2 })
            }),
        );
        let hold =
            |image: &Image, allowed: &[NamePattern]| hold_to_ccm("board", image, "tick", &reached, allowed);
        assert_eq!(hold(&image, &[]), Ok(()));
        let marks = [("__sccm", 0x1000_0000), ("__eccm", 0x1000_1000)];
        image.symbols.extend(marks.map(|(name, address)| (name.to_owned(), address)));
        assert!(hold(&image, &[]).unwrap_err().ends_with("boards/ccm*.x:\n    cold\n    late"));
        assert_eq!(hold(&image, &["cold", "late"].map(NamePattern::new)), Ok(()));
        assert!(hold(&image, &[NamePattern::new("cold")]).is_err());
    }
}
