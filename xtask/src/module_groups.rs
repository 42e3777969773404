//! What each group of modules takes of a board's flash, by images that are built without it.

use boards::BOARDS;
use boards::catalogue::MODULE_GROUPS;

use crate::boards::size_with;
use crate::table::table;
use crate::toolchain::Toolchain;

const HEAD: &str = "
## Groups of modules

What an image grows by with each group, and what it takes with none: P and the generator are in every image, because
costs are measured with them. An image is built with all of them, or with those that are named:
`cargo board nucleo-g474re,control --no-default-features`.
";

/// A section of `docs/firmware.md`.
pub(crate) fn section(toolchain: Toolchain) -> Result<String, String> {
    let mut rows = Vec::new();
    for board in BOARDS.iter().filter(|board| board.tooling.chip.is_some()) {
        let flash =
            |groups: &[&str]| size_with(toolchain, board, groups).map(|size| size.flash.cast_signed());
        let all = flash(&MODULE_GROUPS)?;
        let mut row = vec![board.name.to_owned(), all.to_string()];
        for group in MODULE_GROUPS {
            let others: Vec<&str> = MODULE_GROUPS.into_iter().filter(|other| *other != group).collect();
            row.push((all - flash(&others)?).to_string());
        }
        row.push(flash(&[])?.to_string());
        rows.push(row.try_into().map_err(|_| "a column for each group")?);
    }
    let [one, two, three] = MODULE_GROUPS.map(|group| format!("`{group}`"));
    Ok(HEAD.to_owned() + &table(["Flash, bytes", "All", &one, &two, &three, "None"], &rows))
}
