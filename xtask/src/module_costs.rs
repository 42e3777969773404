//! `cargo xtask write module-costs`: measures the cost of each module kind on a board from stamped images,
//! stores it in `boards/module-costs.txt` and checks images against it.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use boards::BOARDS;
use boards::catalogue::{BoardInfo, MODULE_COSTS, ModuleCost, module_costs};

use crate::boards::{SIDES, build, build_with, collect, stamp};
use crate::shell::{Outcome, image_folder, top};
use crate::toolchain::Toolchain;

/// Precedes the compiler's version.
const RUSTC: &str = "rustc ";
const BOARD: &str = "nucleo-g474re";
const FILE: &str = "boards/module-costs.txt";

/// Groups of the images in addition to the default one, limited by the CCM SRAM. Modules of `energy` need
/// links.
const GROUPS: [&[&str]; 3] = [
    &["energy", "limits", "teleoperation"],
    &["filters", "trajectories"],
    &["joint-control", "logic", "online", "robots"],
];

const HEAD: &str = "\
# Upper bounds of each module kind's cost in a tick on nucleo-g474re, cycles: without axes, per axis, and the reason if there is
# no bound. Written by `cargo xtask write module-costs` from image stamps. `cargo xtask test` fails if the default image differs by
# more than 5 %; `cargo xtask long` checks the other images.
";
/// Start of the reason if the image has no module to compare with.
const ABSENT: &str = "the image lacks modules";

/// Builds and stamps images with every kind, and writes the file.
pub(crate) fn write() -> Outcome {
    let toolchain = Toolchain::set_up()?;
    let plain = image_folder().join(build(toolchain, board()?, None)?.name);
    master(&plain)?;
    let images = [plain].into_iter().chain(with_other_groups(toolchain)?);
    let texts: Vec<String> = images.map(|image| read(&image)).collect::<Result<_, _>>()?;
    let found: Vec<ModuleCost<'_>> = texts.iter().flat_map(|text| module_costs(text)).collect();
    let mut text = format!("{HEAD}{RUSTC}{}\n", toolchain.version()?);
    for (place, kind) in found.iter().enumerate() {
        let is_same = |other: &&ModuleCost<'_>| other.name == kind.name;
        if found.iter().position(|other| is_same(&other)) == Some(place) {
            let best = found.iter().filter(is_same).find(|kind| !is_absent(kind)).unwrap_or(kind);
            let ModuleCost { name, cycles, per_axis, reason } = best;
            let _ = writeln!(text, "{}", format!("{name} {cycles} {per_axis} {reason}").trim_end());
        }
    }
    std::fs::write(top().join(FILE), text).map_err(|error| format!("cannot write {FILE}: {error}"))
}

/// Stamps the built default image and checks it.
pub(crate) fn hold_plain(toolchain: Toolchain) -> Outcome {
    let image = image_folder().join(BOARD);
    master(&image)?;
    hold(toolchain, &[image])
}

/// Checks images with all other groups.
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
        println!("{FILE} is for rustc {rustc}: not enforced for another compiler");
        return Ok(());
    }
    let is_known = |found: &ModuleCost<'_>| module_costs(MODULE_COSTS).any(|known| is_close(&known, found));
    let mut wrong = Vec::new();
    for image in images {
        let text = read(image)?;
        let unknown = module_costs(&text).filter(|found| !is_absent(found) && !is_known(found));
        wrong.extend(unknown.map(|kind| kind.name.to_owned()));
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "costs of {} differ from {FILE}: run `cargo xtask write module-costs`",
            wrong.join(", ")
        )),
    }
}

fn is_absent(kind: &ModuleCost<'_>) -> bool {
    kind.reason.starts_with(ABSENT)
}

/// Returns whether they are of the same kind and within 5 % for one axis.
fn is_close(known: &ModuleCost<'_>, found: &ModuleCost<'_>) -> bool {
    let [known_cycles, cycles] = [known, found].map(|kind| u32::from(kind.cycles) + u32::from(kind.per_axis));
    let is_same = known.name == found.name && known.reason == found.reason;
    is_same && 20 * known_cycles.abs_diff(cycles) <= known_cycles
}

/// Reads the costs that `dimsart stamp` wrote next to an image.
fn read(image: &Path) -> Result<String, String> {
    let file = image.with_added_extension("costs");
    std::fs::read_to_string(&file).map_err(|error| format!("cannot read {}: {error}", file.display()))
}

fn board() -> Result<&'static BoardInfo, String> {
    BOARDS.iter().find(|board| board.name == BOARD).ok_or_else(|| format!("unknown board {BOARD}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_held_to_5_percent_and_to_its_reason() {
        let lines = "tick 9 9\nPCTRL_MOD 280 20\nAdd 1 1\n";
        let [known] = module_costs(lines).collect::<Vec<_>>().try_into().unwrap();
        let is_close = |line| module_costs(line).all(|found| is_close(&known, &found));
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
        for kind in module_costs(MODULE_COSTS) {
            assert!(!is_absent(&kind) && (kind.cycles > 0) == kind.reason.is_empty(), "{kind:?}");
        }
    }
}
