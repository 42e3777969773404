//! `cargo xtask module-costs`: what each kind of module costs on a board, by stamps of images that have it, kept in
//! `boards/module-costs.txt` and held to that.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use boards::BOARDS;
use boards::catalogue::{BoardInfo, MODULE_COSTS};

use crate::boards::{SIDES, build, build_with, collect, folder, stamp};
use crate::shell::{Outcome, top};
use crate::toolchain::Toolchain;

/// Before the compiler's version.
const RUSTC: &str = "rustc ";
const BOARD: &str = "nucleo-g474re";
const FILE: &str = "boards/module-costs.txt";

/// Groups of the images beside the plain one, so many in each as its CCM SRAM has room for. What modules of `energy` read
/// comes over links.
const GROUPS: [&[&str]; 2] = [
    &["energy", "filters", "limits", "teleoperation", "trajectories"],
    &["joint-control", "logic", "online", "robots"],
];

const HEAD: &str = "\
# What each kind of module adds to a tick at most on nucleo-g474re, cycles: without axes, for each axis, and why there is
# no bound. By `cargo xtask module-costs`, from stamps of images. `cargo xtask test` fails where the plain image differs by
# over 5 %, `cargo xtask long` where another one does.
";
/// How a stamp begins to say of a kind that the image does not have it.
const ABSENT: &str = "the image was built without it";

/// Builds and stamps images with every kind, and writes the file.
pub(crate) fn write() -> Outcome {
    let toolchain = Toolchain::set_up()?;
    let plain = folder().join(build(toolchain, board()?, None)?.name);
    master(&plain)?;
    let images = [plain].into_iter().chain(with_other_groups(toolchain)?);
    let found: Vec<Kind> = images.map(|image| read(&image)).collect::<Result<Vec<_>, _>>()?.concat();
    let mut text = format!("{HEAD}{RUSTC}{}\n", toolchain.version()?);
    for (place, kind) in found.iter().enumerate() {
        let is_same = |other: &&Kind| other.name == kind.name;
        if found.iter().position(|other| is_same(&other)) == Some(place) {
            let best = found.iter().filter(is_same).find(|kind| !kind.is_absent()).unwrap_or(kind);
            let Kind { name, cycles, per_axis, reason } = best;
            let _ = writeln!(text, "{}", format!("{name} {cycles} {per_axis} {reason}").trim_end());
        }
    }
    std::fs::write(top().join(FILE), text).map_err(|error| format!("cannot write {FILE}: {error}"))
}

/// Holds the plain image, which is stamped, to the file.
pub(crate) fn hold_plain(toolchain: Toolchain) -> Outcome {
    hold(toolchain, &[folder().join(BOARD)])
}

/// Holds images with all other groups to it.
pub(crate) fn hold_others(toolchain: Toolchain) -> Outcome {
    hold(toolchain, &with_other_groups(toolchain)?)
}

fn with_other_groups(toolchain: Toolchain) -> Result<Vec<PathBuf>, String> {
    let images = GROUPS.iter().map(|groups| {
        let too_large = || format!("{BOARD} has no memory for {} at once", groups.join(", "));
        let built = build_with(toolchain, board()?, groups)?.ok_or_else(too_large)?;
        let image = collect(&built, &format!("{BOARD}-{}", groups.join("-")))?;
        master(&image)?;
        Ok(image)
    });
    images.collect()
}

fn master(image: &Path) -> Outcome {
    let [side, _] = SIDES;
    stamp(image, side)
}

fn hold(toolchain: Toolchain, images: &[PathBuf]) -> Outcome {
    let rustc = MODULE_COSTS.lines().find_map(|line| line.strip_prefix(RUSTC)).unwrap_or_default();
    if rustc != toolchain.version()? {
        println!("{FILE} is of rustc {rustc}: images of another one are not held to it");
        return Ok(());
    }
    let known: Vec<Kind> = kinds(MODULE_COSTS).collect();
    let mut wrong = Vec::new();
    for image in images {
        let is_wrong = |found: &Kind| !found.is_absent() && !known.iter().any(|known| known.is_close(found));
        wrong.extend(read(image)?.into_iter().filter(is_wrong).map(|kind| kind.name));
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => {
            Err(format!("{} cost other than in {FILE}: run `cargo xtask module-costs`", wrong.join(", ")))
        }
    }
}

/// What a kind of module costs.
#[derive(Debug, Clone)]
struct Kind {
    name: String,
    cycles: u64,
    per_axis: u64,
    /// Why this is not known; empty where it is.
    reason: String,
}

impl Kind {
    fn is_absent(&self) -> bool {
        self.reason.starts_with(ABSENT)
    }

    /// Whether it is the same kind, within 5 % for one axis and for all that there can be.
    fn is_close(&self, found: &Self) -> bool {
        let is_close = |axes: u64| {
            let [known, cycles] = [self, found].map(|kind| kind.cycles + axes * kind.per_axis);
            20 * known.abs_diff(cycles) <= known
        };
        self.name == found.name && self.reason == found.reason && [1, 8].into_iter().all(is_close)
    }
}

/// What `dimsart stamp` has left beside an image.
fn read(image: &Path) -> Result<Vec<Kind>, String> {
    let file = image.with_added_extension("costs");
    let text = std::fs::read_to_string(&file);
    text.map(|text| kinds(&text).collect())
        .map_err(|error| format!("cannot read {}: {error}", file.display()))
}

/// Of lines; others are of the tick and of laws.
fn kinds(text: &str) -> impl Iterator<Item = Kind> {
    text.lines().filter_map(|line| {
        let mut words = line.splitn(4, ' ');
        let name = words.next().filter(|name| name.ends_with("MOD"))?.to_owned();
        let (cycles, per_axis) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        Some(Kind { name, cycles, per_axis, reason: words.next().unwrap_or_default().to_owned() })
    })
}

fn board() -> Result<&'static BoardInfo, String> {
    BOARDS.iter().find(|board| board.name == BOARD).ok_or_else(|| format!("{BOARD} is no board"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_held_to_5_percent_and_to_its_reason() {
        let [known] = kinds("tick 9 9\nPCTRL_MOD 280 20\nAdd 1 1\n").collect::<Vec<_>>().try_into().unwrap();
        let is_close = |line| kinds(line).all(|found| known.is_close(&found));
        assert!(is_close("PCTRL_MOD 290 25 ") && is_close("PCTRL_MOD 265 20"));
        for other in
            ["PCTRL_MOD 295 21", "PCTRL_MOD 260 24", "VWALL_MOD 280 20", "PCTRL_MOD 280 20 no bound: why"]
        {
            assert!(!is_close(other), "{other}");
        }
    }

    #[test]
    fn every_group_is_in_an_image() {
        let plain = board().unwrap().tooling.modules;
        let all = [plain, &GROUPS.concat()].concat();
        assert!(boards::catalogue::MODULE_GROUPS.iter().all(|group| all.contains(group)));
    }

    #[test]
    fn every_kind_of_the_file_has_a_cost_or_a_reason() {
        for kind in kinds(MODULE_COSTS) {
            assert!(!kind.is_absent() && (kind.cycles > 0) == kind.reason.is_empty(), "{kind:?}");
        }
    }
}
