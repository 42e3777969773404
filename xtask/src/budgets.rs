//! `cargo xtask write budgets`: measures cycles and stack of the shipped scheme per board, tick and module,
//! stores them in `boards/budgets` and checks images against them.

mod changes;

use boards::BOARDS;
use boards::catalogue::BoardInfo;
use changes::Changes;

use crate::boards::{SIDES, build};
use crate::budget_file::{self, BudgetFile, Part, Parts};
use crate::example::example;
use crate::shell::{Outcome, image_folder, top};
use crate::toolchain::Toolchain;

/// Builds every board's default image, rewrites its file and prints the changes.
pub(crate) fn write() -> Outcome {
    let toolchain = Toolchain::set_up()?;
    for board in BOARDS {
        build(toolchain, board, None)?;
    }
    let found = measure()?;
    print!("{}", changes(&found)?);
    let rustc = toolchain.version()?;
    for board in BOARDS {
        let sides = SIDES.map(|side| (side, of(&found, board, side)));
        let name = budget_file::name(board);
        let file = top().join(&name);
        let text = std::fs::read_to_string(&file).map_err(|error| format!("cannot read {name}: {error}"))?;
        let written = std::fs::write(&file, budget_file::with_parts(&text, &rustc, &sides));
        written.map_err(|error| format!("cannot write {name}: {error}"))?;
    }
    Ok(())
}

/// Checks every board's built default image against its file. With another compiler the figures differ:
/// increases are reported, but are no errors.
pub(crate) fn hold(toolchain: Toolchain) -> Outcome {
    let changes = changes(&measure()?)?;
    if !changes.gained.is_empty() {
        println!("{}\nrun `cargo xtask write budgets` to lower the budgets", changes.gained.join("\n"));
    }
    if changes.wrong.is_empty() {
        return Ok(());
    }
    let wrong = changes.wrong.join("\n");
    let rustc = toolchain.version()?;
    let is_same = |board: &BoardInfo| {
        BudgetFile::of(board).map(|file| file.rustc.is_some_and(|known| known.version == rustc))
    };
    if BOARDS.iter().map(is_same).collect::<Result<Vec<_>, _>>()?.contains(&false) {
        println!(
            "{wrong}\nnot enforced: boards/budgets was written with another compiler than rustc {rustc}"
        );
        return Ok(());
    }
    Err(wrong
        + "\nreduce the cost; if the increase is intended or the scheme changed, run `cargo xtask write budgets` and commit the \
           files with the reason")
}

/// Compares all boards with their files.
fn changes(found: &[Row]) -> Result<Changes, String> {
    let mut changes = Changes::default();
    for board in BOARDS {
        let file = BudgetFile::of(board)?;
        for side in SIDES {
            changes.add(board, side, file.side(side), &of(found, board, side));
        }
    }
    Ok(changes)
}

/// Returns the bounds of the built images.
fn measure() -> Result<Vec<Row>, String> {
    println!("bounds of the shipped scheme on every board");
    let mut arguments = vec![image_folder().into_os_string()];
    arguments.extend(BOARDS.iter().map(|board| board.name.into()));
    rows(&example("scheme_budgets", "dev", &arguments)?)
}

/// Parses the output of `scheme_budgets`; every side must have a row.
fn rows(text: &str) -> Result<Vec<Row>, String> {
    let rows: Vec<Row> = text.lines().map(Row::read).collect::<Result<_, _>>()?;
    let mut sides = BOARDS.iter().flat_map(|board| SIDES.map(|side| (board, side)));
    match sides.find(|(board, side)| of(&rows, board, side).is_empty()) {
        None => Ok(rows),
        Some((board, side)) => Err(format!("scheme_budgets printed no row of {}'s {side}", board.name)),
    }
}

fn of(rows: &[Row], board: &BoardInfo, side: &str) -> Parts {
    let own = rows.iter().filter(|row| row.board == board.name && row.side == side);
    own.map(|row| (row.name.clone(), row.part)).collect()
}

/// A row of `scheme_budgets`.
struct Row {
    board: String,
    side: String,
    name: String,
    part: Part,
}

impl Row {
    fn read(line: &str) -> Result<Self, String> {
        let read = || {
            let words: Vec<&str> = line.split(' ').collect();
            let [board, side, name, cycles, stack_bytes] = words.as_slice() else { return None };
            let part = Part { cycles: cycles.parse().ok()?, stack_bytes: stack_bytes.parse().ok()? };
            let [board, side, name] = [board, side, name].map(|word| (*word).to_owned());
            Some(Self { board, side, name, part })
        };
        read().ok_or_else(|| format!("invalid row of scheme_budgets: '{line}'"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_of_which_nothing_is_said_is_told() {
        let all = |side| BOARDS.iter().map(move |board| format!("{} {side} tick 3162 224\n", board.name));
        let (masters, slaves): (String, String) = (all("master").collect(), all("slave").collect());
        let read = rows(&format!("{masters}{slaves}")).unwrap();
        for board in BOARDS {
            assert_eq!(
                of(&read, board, "slave"),
                [("tick".to_owned(), Part { cycles: 3162, stack_bytes: 224 })]
            );
        }
        let refused = |text: &str| rows(text).err().unwrap();
        assert!(refused(&masters).ends_with("'s slave"), "{}", refused(&masters));
        assert_eq!(refused("a master tick 1"), "invalid row of scheme_budgets: 'a master tick 1'");
        assert_eq!(refused("a master tick 1 -2"), "invalid row of scheme_budgets: 'a master tick 1 -2'");
    }

    #[test]
    fn every_file_has_both_sides() {
        for board in BOARDS {
            let file = BudgetFile::of(board).unwrap();
            for side in SIDES {
                assert!(file.side(side).contains_key("tick"), "{} {side}", board.name);
            }
        }
    }
}
