//! `cargo xtask module-groups`: what each group of modules takes of a board's flash, by images that have it alone, and how
//! many of them fit, in `docs/firmware.md`.

use boards::BOARDS;
use boards::catalogue::{BoardInfo, MODULE_GROUPS};

use crate::boards::{build_with, size, size_where};
use crate::shell::{Outcome, top};
use crate::table::table;
use crate::toolchain::Toolchain;

/// The one whose tick runs in CCM SRAM first.
const BOARDS_WITH_A_CHIP: [&str; 2] = ["nucleo-g474re", "b-g431b-esc1"];

const TITLE: &str = "\n## Groups of modules\n";
const NEXT_TITLE: &str = "\n## Stack\n";

const TEXT: &str = "
By `cargo xtask module-groups`: bytes that an image grows by with each group, beyond one with none. P and the generator
are in every image, because costs are measured with them. Of the bytes in flash, those in CCM SRAM are what the tick
runs, which is copied there at start.

What fits is decided on nucleo-g474re by the 32 KiB of CCM SRAM, long before its 256 KiB of flash, and on b-g431b-esc1,
whose tick runs in flash, by the 124 KiB of flash. The most that fits is as many groups as were linked together, from the
smallest on. Too large for b-g431b-esc1 are `online` for its RAM, and `robots` for its flash.

`cargo board nucleo-g474re,filters` builds the groups that are shipped and `filters`; with `--no-default-features`, only
the groups that are named are built: `cargo board b-g431b-esc1,control,teleoperation --no-default-features` is what
`cargo xtask flash b-g431b-esc1` builds. `dimsart modules` says which module is of which group.
";

/// Builds the images and writes the section anew.
pub(crate) fn write() -> Outcome {
    let section = section(Toolchain::set_up()?)?;
    println!("{section}");
    let file = top().join("docs/firmware.md");
    let page =
        std::fs::read_to_string(&file).map_err(|error| format!("cannot read {}: {error}", file.display()))?;
    let places =
        page.find(TITLE).zip(page.find(NEXT_TITLE)).ok_or("docs/firmware.md has no section for it")?;
    let (before, _) = page.split_at(places.0);
    let (_, behind) = page.split_at(places.1);
    let page = [before, &section, behind].concat();
    std::fs::write(&file, page).map_err(|error| format!("cannot write {}: {error}", file.display()))
}

/// A section of `docs/firmware.md`.
pub(crate) fn section(toolchain: Toolchain) -> Result<String, String> {
    let [large, small] = BOARDS_WITH_A_CHIP.map(|name| {
        let board = BOARDS.iter().find(|board| board.name == name).ok_or(format!("{name} is no board"))?;
        Groups::measure(toolchain, board)
    });
    let (large, small) = (large?, small?);
    let rows = large.rows.iter().zip(&small.rows).map(|((name, large), (_, small))| {
        let cell =
            |bytes: Option<u64>| bytes.map_or_else(|| "too large".to_owned(), |bytes| bytes.to_string());
        [
            name.clone(),
            cell(large.map(|bytes| bytes.flash)),
            cell(large.map(|bytes| bytes.ccm)),
            cell(small.map(|bytes| bytes.flash)),
        ]
    });
    let rows: Vec<[String; 4]> = rows.collect();
    let [one, two] = BOARDS_WITH_A_CHIP;
    let head = ["Bytes", &format!("{one}, flash"), "of them CCM SRAM", &format!("{two}, flash")];
    let fits = |board: &str, groups: &Groups| {
        format!("\nThe most that fits on {board}: {}.\n", groups.most.join(", "))
    };
    Ok([TITLE, TEXT, &table(head, &rows), &fits(one, &large), &fits(two, &small)].concat())
}

/// What images of a board take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Bytes {
    /// First, as it is short first where the tick runs from it.
    ccm: u64,
    flash: u64,
}

/// What the groups take on a board.
struct Groups {
    /// An image without groups, what it grows by with each, and one as it is shipped; none where a memory is too small.
    rows: Vec<(String, Option<Bytes>)>,
    /// The largest set that was found to fit.
    most: Vec<&'static str>,
}

impl Groups {
    fn measure(toolchain: Toolchain, board: &BoardInfo) -> Result<Self, String> {
        let bytes = |groups: &[&str]| {
            let Some(image) = build_with(toolchain, board, groups)? else { return Ok::<_, String>(None) };
            let ccm = size_where(&image, |section| section == b".ccm")?.flash;
            Ok(Some(Bytes { ccm, flash: size(&image)?.flash }))
        };
        let none = bytes(&[])?.ok_or_else(|| format!("{} has no memory for an image", board.name))?;
        let mut rows = vec![("none".to_owned(), Some(none))];
        let mut smallest_first = Vec::new();
        for group in MODULE_GROUPS {
            let grown = bytes(&[group])?.map(|with| Bytes {
                ccm: with.ccm.saturating_sub(none.ccm),
                flash: with.flash.saturating_sub(none.flash),
            });
            rows.push((format!("`{group}`"), grown));
            smallest_first.extend(grown.map(|grown| (grown, group)));
        }
        smallest_first.sort_unstable();
        rows.push(("shipped".to_owned(), bytes(board.tooling.modules)?));
        let groups: Vec<&str> = smallest_first.into_iter().map(|(_, group)| group).collect();
        // So many of the smallest fit, so many do not.
        let (mut most, mut beyond) = (0, groups.len() + 1);
        while beyond - most > 1 {
            let count = usize::midpoint(most, beyond);
            match bytes(groups.get(..count).unwrap_or_default())? {
                Some(_) => most = count,
                None => beyond = count,
            }
        }
        let most = groups.into_iter().take(most).collect();
        Ok(Self { rows, most })
    }
}
