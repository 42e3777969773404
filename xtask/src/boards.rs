//! The boards: their images, what these may weigh, and how they are built and checked.

use std::path::{Path, PathBuf};

use boards::BOARDS;
use boards::catalogue::{BoardInfo, Size};
use object::elf::FileHeader32;
use object::read::elf::{FileHeader, SectionHeader};
use object::{Endianness, elf};

use crate::shell::{Outcome, command, run, target};
use crate::toolchain::{Toolchain, output};

/// The scheme's sides, each with the feature that chooses it.
pub(crate) const SIDES: [(&str, Option<&str>); 2] = [("master", None), ("slave", Some("slave"))];

/// An image that was built.
pub(crate) struct Image {
    /// As its file is named: `BOARD[-VARIANT]-SIDE`.
    pub(crate) name: String,
    pub(crate) size: Size,
    /// What it may take; none where the chip's whole memory is there for it.
    pub(crate) budget: Option<Size>,
}

/// Where images are collected.
pub(crate) fn folder() -> PathBuf {
    target().join("images")
}

/// Builds every image of every board into [`folder`].
pub(crate) fn build_all(toolchain: Toolchain) -> Result<Vec<Image>, String> {
    let mut images = Vec::new();
    for board in BOARDS {
        for variant in std::iter::once(None).chain(board.tooling.variants.iter().copied().map(Some)) {
            for side in SIDES {
                images.push(build(toolchain, board, variant, side)?);
            }
        }
    }
    Ok(images)
}

/// Holds images to their boards' budgets.
pub(crate) fn hold(images: &[Image]) -> Outcome {
    let over: Vec<String> = images.iter().filter_map(over_budget).collect();
    if over.is_empty() { Ok(()) } else { Err(over.join("\n")) }
}

/// Builds one image.
pub(crate) fn build(
    toolchain: Toolchain,
    board: &'static BoardInfo,
    variant: Option<&str>,
    (side, side_feature): (&str, Option<&str>),
) -> Result<Image, String> {
    let features: Vec<&str> = [Some(board.name), variant, side_feature].into_iter().flatten().collect();
    let arguments = ["--package", "firmware", "--profile", "firmware", "--features", &features.join(",")];
    run(&mut toolchain.cargo("build", &arguments))?;
    let name: Vec<&str> = [Some(board.name), variant, Some(side)].into_iter().flatten().collect();
    let (name, built) = (name.join("-"), output("firmware").join("firmware"));
    let image = folder().join(&name);
    let copied = std::fs::create_dir_all(folder()).and_then(|()| std::fs::copy(&built, &image));
    copied.map_err(|error| format!("cannot copy {} to {}: {error}", built.display(), image.display()))?;
    let size = size(&image)?;
    let budget = board.tooling.budget.filter(|_| variant.is_none());
    Ok(Image { name, size, budget })
}

/// The format of the boards' files: behind a macro, `cargo fmt` does not find them.
pub(crate) fn check_format() -> Outcome {
    let files = BOARDS.iter().map(|board| format!("boards/src/{}.rs", board.name.replace('-', "_")));
    run(command("rustfmt", ["--check", "--edition", "2024"]).args(files))
}

/// Lints of what is compiled for boards alone; what their crates have for a host is linted with the rest.
pub(crate) fn lint(toolchain: Toolchain) -> Outcome {
    for board in BOARDS {
        for features in std::iter::once(board.name.to_owned())
            .chain(board.tooling.variants.iter().map(|variant| format!("{},{variant}", board.name)))
        {
            let arguments = ["--quiet", "--package", "firmware", "--features", &features];
            run(toolchain.cargo("clippy", &arguments).args(["--", "--deny", "warnings"]))?;
        }
    }
    Ok(())
}

/// Documentation of what is compiled for boards alone.
pub(crate) fn document(toolchain: Toolchain) -> Outcome {
    for board in BOARDS {
        let arguments = ["--no-deps", "--quiet", "--package", "boards", "--features", board.name];
        run(toolchain.cargo("doc", &arguments).env("RUSTDOCFLAGS", "--deny warnings"))?;
    }
    Ok(())
}

fn over_budget(image: &Image) -> Option<String> {
    let (size, most) = (image.size, image.budget?);
    let is_over = size.flash > most.flash || size.ram > most.ram;
    is_over.then(|| {
        format!(
            "{} takes {} bytes of flash (at most {}) and {} of RAM (at most {})",
            image.name, size.flash, most.flash, size.ram, most.ram
        )
    })
}

fn size(image: &Path) -> Result<Size, String> {
    let unreadable = |error: &dyn std::fmt::Display| format!("cannot read {}: {error}", image.display());
    let bytes = std::fs::read(image).map_err(|error| unreadable(&error))?;
    size_of(&bytes).map_err(|error| unreadable(&error))
}

fn size_of(bytes: &[u8]) -> object::Result<Size> {
    let header = FileHeader32::<Endianness>::parse(bytes)?;
    let endian = header.endian()?;
    let mut size = Size { flash: 0, ram: 0 };
    for section in header.sections(endian, bytes)?.iter() {
        let (flags, bytes) = (section.sh_flags(endian), u64::from(section.sh_size(endian)));
        if flags & elf::SHF_ALLOC != 0 {
            size.flash += if section.sh_type(endian) == elf::SHT_NOBITS { 0 } else { bytes };
            size.ram += if flags & elf::SHF_WRITE == 0 { 0 } else { bytes };
        }
    }
    Ok(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_board_with_a_chip_has_a_budget() {
        for board in BOARDS {
            assert_eq!(board.tooling.chip.is_some(), board.tooling.budget.is_some(), "{}", board.name);
        }
    }

    #[test]
    fn an_image_over_its_budget_is_named_with_both_sizes() {
        let board = BOARDS.iter().find(|board| board.tooling.budget.is_some()).unwrap();
        let most = board.tooling.budget.unwrap();
        let image = |flash| Image { name: "big".into(), size: Size { flash, ..most }, budget: Some(most) };
        assert_eq!(over_budget(&image(most.flash)), None);
        let message = over_budget(&image(most.flash + 1)).unwrap();
        assert!(message.starts_with(&format!(
            "big takes {} bytes of flash (at most {})",
            most.flash + 1,
            most.flash
        )));
    }

    #[test]
    fn what_is_no_image_has_no_size() {
        assert!(size_of(b"no image").is_err());
    }
}
