//! What each group of modules takes of a board's flash, by images that have it alone, and how many of them fit.

use boards::BOARDS;
use boards::catalogue::{BoardInfo, MODULE_GROUPS};

use crate::boards::size_with;
use crate::table::table;
use crate::toolchain::Toolchain;

const HEAD: &str = "
## Groups of modules

What an image grows by with each group beyond one with none, where P and the generator are in every image, because costs are
measured with them; and the largest set that fits, the smallest groups first. On nucleo-g474re what fits is decided by the
32 KiB of CCM SRAM that the tick runs from, on b-g431b-esc1 by its flash. An image has the groups that it ships with, and those
that are named: `cargo board nucleo-g474re,filters`; with `--no-default-features` only those that are named:
`cargo board b-g431b-esc1,control,teleoperation --no-default-features` is what `cargo xtask flash` builds. `dimsart modules` says
which module is of which group.
";

/// A section of `docs/firmware.md`.
pub(crate) fn section(toolchain: Toolchain) -> Result<String, String> {
    let boards = || BOARDS.iter().filter(|board| board.tooling.chip.is_some());
    let columns: Vec<[String; MODULE_GROUPS.len() + 3]> =
        boards().map(|board| column(toolchain, board)).collect::<Result<_, _>>()?;
    let rows = ["none"].into_iter().chain(MODULE_GROUPS).chain(["ships with", "most that fits"]);
    let rows: Vec<[String; 3]> = rows
        .enumerate()
        .map(|(place, name)| {
            let cells = columns.iter().filter_map(|column| column.get(place).cloned());
            let cells: Vec<String> = [name.to_owned()].into_iter().chain(cells).collect();
            cells.try_into().map_err(|_| "two boards with a chip".to_owned())
        })
        .collect::<Result<_, _>>()?;
    let names: Vec<&str> = boards().map(|board| board.name).collect();
    let [one, two] = names.try_into().map_err(|_| "two boards with a chip")?;
    Ok(HEAD.to_owned() + &table(["Flash, bytes", one, two], &rows))
}

/// What an image takes without groups, what it grows by with each, what it ships with, and what fits.
fn column(toolchain: Toolchain, board: &BoardInfo) -> Result<[String; MODULE_GROUPS.len() + 3], String> {
    let flash = |groups: &[&str]| size_with(toolchain, board, groups).map(|size| size.flash);
    let none = flash(&[])?;
    let mut grown: Vec<(&str, u64)> = Vec::new();
    for group in MODULE_GROUPS {
        // One that does not even fit alone.
        grown.push((group, flash(&[group]).map_or(u64::MAX, |flash| flash.saturating_sub(none))));
    }
    let mut smallest_first = grown.clone();
    smallest_first.sort_by_key(|(_, bytes)| *bytes);
    let mut fitting: Vec<&str> = Vec::new();
    for (group, _) in smallest_first {
        let more = [fitting.as_slice(), &[group]].concat();
        // Beyond its memory it does not link.
        if flash(&more).is_ok() {
            fitting = more;
        }
    }
    let bytes = |bytes: &u64| if *bytes == u64::MAX { "does not fit".to_owned() } else { bytes.to_string() };
    let cells = [none.to_string()].into_iter().chain(grown.iter().map(|(_, grown)| bytes(grown)));
    let cells = cells.chain([flash(board.tooling.modules)?.to_string(), fitting.join(", ")]);
    let cells: Vec<String> = cells.collect();
    cells.try_into().map_err(|_| "a row for each group".to_owned())
}
