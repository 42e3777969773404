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
`cargo board nucleo-g474re,control --no-default-features`. b-g431b-esc1 has no room for `signals` beside its drive:
`cargo board b-g431b-esc1,control,teleoperation --no-default-features`, which is what `cargo xtask flash` builds.
";

/// A section of `docs/firmware.md`.
pub(crate) fn section(toolchain: Toolchain) -> Result<String, String> {
    let mut rows = Vec::new();
    for board in BOARDS.iter().filter(|board| board.tooling.chip.is_some()) {
        let flash =
            |groups: &[&str]| size_with(toolchain, board, groups).map(|size| size.flash.cast_signed());
        let has = board.tooling.modules;
        let all = flash(has)?;
        let mut row = vec![board.name.to_owned(), all.to_string()];
        for group in MODULE_GROUPS {
            let others: Vec<&str> = has.iter().copied().filter(|other| *other != group).collect();
            row.push(if has.contains(&group) { (all - flash(&others)?).to_string() } else { "-".to_owned() });
        }
        row.push(flash(&[])?.to_string());
        rows.push(row.try_into().map_err(|_| "a column for each group")?);
    }
    let [one, two, three] = MODULE_GROUPS.map(|group| format!("`{group}`"));
    Ok(HEAD.to_owned() + &table(["Flash, bytes", "As shipped", &one, &two, &three, "None"], &rows))
}
