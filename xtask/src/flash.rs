//! `cargo xtask flash BOARD [master|slave]`: builds, stamps and flashes a board's image and shows its log.

use std::path::Path;

use boards::BOARDS;
use boards::catalogue::BoardInfo;

use crate::boards::{SIDES, build, stamp};
use crate::shell::{Outcome, command, image_folder, run, succeeds};
use crate::toolchain::Toolchain;

/// Builds, flashes and shows the log until Ctrl-C.
pub(crate) fn flash(board: &str, side: &str) -> Outcome {
    let (name, variant) =
        board.split_once(',').map_or((board, None), |(name, variant)| (name, Some(variant)));
    let (board, chip) = flashable(name)?;
    let variants = board.tooling.variants;
    if let Some(variant) = variant.filter(|variant| !variants.contains(variant)) {
        return Err(format!("{name} has no variant {variant}; it has: {}", variants.join(", ")));
    }
    if !SIDES.contains(&side) {
        return Err("unknown side: master or slave".into());
    }
    find_probe_rs()?;
    let image = image_folder().join(build(Toolchain::set_up()?, board, variant)?.name);
    stamp(&image, side)?;
    run_on_chip(chip, &image)
}

/// Flashes an image and shows its log until it ends.
pub(crate) fn run_on_chip(chip: &str, image: &Path) -> Outcome {
    find_probe_rs()?;
    run(command("probe-rs", ["run", "--chip", chip]).arg(image)).map_err(|error| {
        format!("{error}\nIs the board connected? `cargo run --release -- doctor` searches for its probe.")
    })
}

/// Checks for probe-rs before building.
pub(crate) fn find_probe_rs() -> Outcome {
    if succeeds(&mut command("probe-rs", ["--version"])) {
        return Ok(());
    }
    Err("probe-rs not found: cargo install probe-rs-tools --locked".into())
}

pub(crate) fn flashable(name: &str) -> Result<(&'static BoardInfo, &'static str), String> {
    let found = BOARDS.iter().find(|board| board.name == name);
    found.and_then(|board| Some((board, board.tooling.chip?))).ok_or_else(|| {
        let names: Vec<&str> =
            BOARDS.iter().filter(|board| board.tooling.chip.is_some()).map(|board| board.name).collect();
        let why = if found.is_some() { "is emulated and cannot be flashed" } else { "is not a board" };
        format!("{name} {why}; boards to flash: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_flashed_is_refused_with_what_can() {
        for name in ["mps2-an386", "nucleo"] {
            let message = flashable(name).err().unwrap();
            let mut has_chip = BOARDS.iter().filter(|board| board.tooling.chip.is_some());
            let names_all = has_chip.all(|board| message.contains(board.name));
            assert!(message.contains(name) && names_all, "{message}");
        }
        assert_eq!(flashable("b-g431b-esc1").unwrap().1, "STM32G431CBUx");
    }
}
