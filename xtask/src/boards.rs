//! Board images: builds, checks and size budgets.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use boards::BOARDS;
use boards::catalogue::{BoardInfo, INDIRECT_CALLS};
use cycles::declarations::CallDeclarations;
use object::elf::FileHeader32;
use object::read::elf::{FileHeader, SectionHeader};
use object::{Endianness, elf};
use serde::Deserialize;
use serde_json::Value;

use crate::budget_file::BudgetFile;
use crate::emulator::emulate;
use crate::example::dimsart;
use crate::shell::{Outcome, command, image_folder, run};
use crate::toolchain::{Toolchain, output};

/// Cargo profile of images.
pub(crate) const PROFILE: &str = "firmware";

/// Sides of a scheme.
pub(crate) const SIDES: [&str; 2] = ["master", "slave"];

/// Features for the firmware's other programs, which add only these.
const PROGRAMS: &str = "cycle-table,drive-step,two-engines";

/// Images built for every change: a chip with its drive, the emulated board, authentication. `cargo xtask
/// long` builds all.
const FOR_EVERY_CHANGE: [&str; 6] = [
    "mps2-an386",
    "mps2-an386-timer-tick",
    "mps2-an386-auth-timer-tick",
    "nucleo-g474re",
    "nucleo-g474re-ihm08m1",
    "b-g431b-esc1",
];

/// The board documented for every change.
const DOCUMENTED: &str = "nucleo-g474re";

/// A selection of images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Images {
    /// Images for every change.
    Few,
    /// Every variant of every board.
    All,
}

impl Images {
    /// Returns the selected boards and variants from the catalogue.
    fn list(self) -> impl Iterator<Item = (&'static BoardInfo, Option<&'static str>)> {
        let all = BOARDS.iter().flat_map(|board| {
            let variants = board.tooling.variants.iter().copied().map(Some);
            std::iter::once(None).chain(variants).map(move |variant| (board, variant))
        });
        all.filter(move |(board, variant)| {
            self == Self::All || FOR_EVERY_CHANGE.contains(&image_name(board, *variant).as_str())
        })
    }
}

/// Size of an image, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Size {
    /// Flash: code and data.
    pub(crate) flash: u64,
    /// RAM: variables without the stack.
    pub(crate) ram: u64,
}

/// A built image.
pub(crate) struct Image {
    /// Name of its file: `BOARD[-VARIANT]`.
    pub(crate) name: String,
    pub(crate) board: &'static BoardInfo,
    pub(crate) size: Size,
    /// Size budget; `None` if only the chip's memory limits it.
    pub(crate) budget: Option<Size>,
}

impl Image {
    /// Stamps it for the master.
    pub(crate) fn stamp(&self) -> Outcome {
        let [side, _] = SIDES;
        stamp(&image_folder().join(&self.name), side)
    }

    /// Reads it for an analysis of its machine code.
    pub(crate) fn read(&self) -> Result<cycles::image::Image, String> {
        read_image(&image_folder().join(&self.name))
    }
}

/// Reads a file for an analysis of its machine code.
pub(crate) fn read_image(file: &Path) -> Result<cycles::image::Image, String> {
    let unreadable = |error: &dyn std::fmt::Display| format!("cannot read {}: {error}", file.display());
    let bytes = std::fs::read(file).map_err(|error| unreadable(&error))?;
    cycles::image::Image::read(&bytes).map_err(|error| unreadable(&error))
}

/// Returns the indirect calls, which machine code does not contain.
pub(crate) fn declared() -> Result<CallDeclarations, String> {
    CallDeclarations::read(INDIRECT_CALLS).map_err(|error| format!("boards/calls.txt, {error}"))
}

/// Builds images into [`image_folder`], which is cleared first.
pub(crate) fn build_all(toolchain: Toolchain, images: Images) -> Result<Vec<Image>, String> {
    let folder = image_folder();
    if folder.exists() {
        std::fs::remove_dir_all(&folder)
            .map_err(|error| format!("cannot remove {}: {error}", folder.display()))?;
    }
    images.list().map(|(board, variant)| build(toolchain, board, variant)).collect()
}

/// The same, plus the program with a drive's period, for tests.
pub(crate) fn build_for_tests(toolchain: Toolchain, images: Images) -> Result<Vec<Image>, String> {
    let images = build_all(toolchain, images)?;
    build_drive_step(toolchain)?;
    Ok(images)
}

/// Checks images against their boards' budgets.
pub(crate) fn hold(images: &[Image]) -> Outcome {
    let over: Vec<String> = images.iter().filter_map(over_budget).collect();
    if over.is_empty() { Ok(()) } else { Err(over.join("\n")) }
}

/// Builds an image.
pub(crate) fn build(
    toolchain: Toolchain,
    board: &'static BoardInfo,
    variant: Option<&str>,
) -> Result<Image, String> {
    let arguments = ["--package", "firmware", "--profile", PROFILE];
    run(toolchain.cargo("build", &arguments).args(features(board, variant)))?;
    let (name, built) = (image_name(board, variant), output(PROFILE).join("firmware"));
    let image = collect(&built, &name)?;
    let size = size(&image)?;
    let budget = if variant.is_none() { budget(board)? } else { None };
    Ok(Image { name, board, size, budget })
}

fn image_name(board: &BoardInfo, variant: Option<&str>) -> String {
    let parts: Vec<&str> = [Some(board.name), variant].into_iter().flatten().collect();
    parts.join("-").replace(',', "-")
}

/// Returns cargo's arguments for a board, its modules and further features.
pub(crate) fn features(board: &BoardInfo, more: Option<&str>) -> [String; 3] {
    let features = [&[board.name], board.tooling.modules, more.as_slice()].concat();
    ["--no-default-features".to_owned(), "--features".to_owned(), features.join(",")]
}

/// Copies a built program to the folder of images.
pub(crate) fn collect(built: &Path, name: &str) -> Result<PathBuf, String> {
    let image = image_folder().join(name);
    let copied = std::fs::create_dir_all(image_folder()).and_then(|()| std::fs::copy(built, &image));
    copied.map_err(|error| format!("cannot copy {} to {}: {error}", built.display(), image.display()))?;
    Ok(image)
}

/// Builds the program with a drive's period, which tests analyse on the host, and runs it in the emulator.
fn build_drive_step(toolchain: Toolchain) -> Outcome {
    let board = BOARDS.iter().find(|board| board.tooling.chip.is_none()).ok_or("no emulated board")?;
    let name = "drive-step";
    emulate(&collect(&build_program(toolchain, board, name)?, name)?)
}

/// Builds one of the firmware's other programs for a board.
pub(crate) fn build_program(toolchain: Toolchain, board: &BoardInfo, name: &str) -> Result<PathBuf, String> {
    let arguments = ["--package", "firmware", "--bin", name, "--profile", PROFILE];
    run(toolchain.cargo("build", &arguments).args(features(board, Some(name))))?;
    Ok(output(PROFILE).join(name))
}

/// Builds a board's image with only these groups of modules; `None` if it does not fit a memory.
pub(crate) fn build_with(
    toolchain: Toolchain,
    board: &BoardInfo,
    groups: &[&str],
) -> Result<Option<PathBuf>, String> {
    let features = [&[board.name], groups].concat().join(",");
    let arguments = ["--package", "firmware", "--profile", PROFILE, "--no-default-features", "--features"];
    println!("an image with {features}");
    let built = toolchain.cargo("build", &arguments).arg(&features).output();
    let built = built.map_err(|error| format!("cannot start cargo: {error}"))?;
    let said = String::from_utf8_lossy(&built.stderr);
    // Messages of the linker, and of the firmware for a board that is known to be too small.
    let is_too_large = said.contains("will not fit in region") || said.contains("do not fit b-g431b-esc1");
    match built.status.success() {
        true => Ok(Some(output(PROFILE).join("firmware"))),
        false if is_too_large => Ok(None),
        false => Err(format!("build of an image with {features} failed: {said}")),
    }
}

/// What `dimsart stamp` prints for programs.
#[derive(Deserialize)]
struct Stamped {
    image: PathBuf,
    side: String,
    limit_cycles: u32,
    /// Modules without a bound.
    #[serde(rename = "unknown")]
    _unknown: Vec<Value>,
}

/// Stamps an image with its modules' costs and the side of its scheme; checks what the command prints for programs.
pub(crate) fn stamp(image: &Path, side: &str) -> Outcome {
    let mut stamp = command(dimsart()?, ["stamp", "--json", "--side", side]);
    let output = stamp.arg(image).stderr(Stdio::inherit()).output();
    let output = output.map_err(|error| format!("cannot start dimsart: {error}"))?;
    let said = String::from_utf8_lossy(&output.stdout);
    let is_it = |found: &Stamped| found.image == image && found.side == side && found.limit_cycles > 0;
    match serde_json::from_str(&said) {
        Ok(found) if output.status.success() && is_it(&found) => Ok(()),
        _ => Err(format!("`dimsart stamp {}` ended with {}: {said}", image.display(), output.status)),
    }
}

/// Checks the format of the boards' files, which `cargo fmt` does not find behind a macro.
pub(crate) fn check_format() -> Outcome {
    let files = BOARDS.iter().map(|board| format!("boards/src/{}.rs", board.name.replace('-', "_")));
    run(command("rustfmt", ["--check", "--edition", "2024"]).args(files))
}

/// Lints board-only code; host code is linted with the rest. For every change, each board once with all
/// features of its images.
pub(crate) fn lint(toolchain: Toolchain, images: Images) -> Outcome {
    // A board without variants adds little to another board's lints.
    let has_variant = |board: &BoardInfo| {
        Images::Few.list().any(|(of, variant)| of.name == board.name && variant.is_some())
    };
    let boards = BOARDS.iter().filter(|board| images == Images::All || has_variant(board));
    let together = boards.map(|board| (board, Some(together(board))));
    let apart = images.list().filter(|_| images == Images::All);
    for (board, more) in together.chain(apart.map(|(board, more)| (board, more.map(str::to_owned)))) {
        // With the profile that host code is built with.
        let mut clippy =
            toolchain.cargo("clippy", &["--quiet", "--profile", PROFILE, "--package", "firmware"]);
        run(clippy.args(features(board, more.as_deref())).args(["--", "--deny", "warnings"]))?;
    }
    Ok(())
}

/// Further features of a board's images for every change and of its programs.
fn together(board: &BoardInfo) -> String {
    let of_board = Images::Few.list().filter(|(of, _)| of.name == board.name);
    of_board.filter_map(|(_, variant)| variant).chain([PROGRAMS]).collect::<Vec<_>>().join(",")
}

/// Documents the firmware: for one board for every change, for every board in `long`.
pub(crate) fn document(toolchain: Toolchain, images: Images) -> Outcome {
    for board in BOARDS.iter().filter(|board| images == Images::All || board.name == DOCUMENTED) {
        // With the application and features already built for the lints.
        let packages = ["--no-deps", "--quiet", "--lib", "--package", "boards", "--package", "firmware"];
        let [no_others, option, features] = features(board, Some(&together(board)));
        let features = features.split(',').map(|feature| format!("firmware/{feature}")).collect::<Vec<_>>();
        let mut document = toolchain.cargo("doc", &[&packages[..], &["--profile", PROFILE]].concat());
        document.args([no_others, option, features.join(",")]);
        run(document.env("RUSTDOCFLAGS", "--deny warnings"))?;
    }
    Ok(())
}

/// Returns the size budget of a board's default image, if any.
fn budget(board: &BoardInfo) -> Result<Option<Size>, String> {
    let BudgetFile { flash_bytes, ram_bytes, .. } = BudgetFile::of(board)?;
    Ok(flash_bytes.zip(ram_bytes).map(|(flash, ram)| Size { flash, ram }))
}

fn over_budget(image: &Image) -> Option<String> {
    let (size, most) = (image.size, image.budget?);
    let is_over = size.flash > most.flash || size.ram > most.ram;
    is_over.then(|| {
        format!(
            "{} takes {} bytes of flash (limit {}) and {} of RAM (limit {})",
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
    let sections = header.sections(endian, bytes)?;
    let mut size = Size { flash: 0, ram: 0 };
    for section in sections.iter() {
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
            assert_eq!(board.tooling.chip.is_some(), budget(board).unwrap().is_some(), "{}", board.name);
        }
    }

    #[test]
    fn the_images_for_every_change_exist_and_are_of_every_board() {
        let few: Vec<String> =
            Images::Few.list().map(|(board, variant)| image_name(board, variant)).collect();
        assert_eq!(few.len(), FOR_EVERY_CHANGE.len());
        assert!(BOARDS.iter().all(|board| few.iter().any(|name| name == board.name)));
    }

    #[test]
    fn an_image_over_its_budget_is_named_with_both_sizes() {
        let (board, most) =
            BOARDS.iter().find_map(|board| budget(board).unwrap().map(|most| (board, most))).unwrap();
        let size = |flash| Size { flash, ..most };
        let image = |flash| Image { name: "big".into(), board, size: size(flash), budget: Some(most) };
        assert_eq!(over_budget(&image(most.flash)), None);
        let message = over_budget(&image(most.flash + 1)).unwrap();
        assert!(message.starts_with(&format!(
            "big takes {} bytes of flash (limit {})",
            most.flash + 1,
            most.flash
        )));
    }

    #[test]
    fn what_is_no_image_has_no_size() {
        assert!(size_of(b"no image").is_err());
    }
}
