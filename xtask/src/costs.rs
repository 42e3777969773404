//! `cargo xtask costs`: what each kind of module costs, by bounds of every board's image, as a table of the core.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use boards::BOARDS;
use dimsart_core::modules::{COSTS, Standard, TICK};
use dimsart_core::{Cost, ModuleList};

use crate::boards::{SIDES, build, folder};
use crate::example::example;
use crate::shell::{Outcome, top};
use crate::toolchain::Toolchain;

const FILE: &str = "dimsart-core/src/modules/costs.rs";
const TEXT: &str = include_str!("../../dimsart-core/src/modules/costs.rs");
/// Stands in [`HEAD`] for the compiler's version.
const RUSTC: &str = "{RUSTC}";
const HEAD: &str = "\
//! What the modules cost, by the machine code. Written by `cargo xtask costs`.
//!
//! Each is the smallest line above the bounds on all boards' images for 1 to 8 degrees of freedom, with every choice of
//! its parameters; what the engine takes to call it is in it. `cargo xtask long` holds the table to the images. A new
//! kind of module has no line and is refused where a tick may take so long only: run `cargo xtask costs`.
//!
//! Images by rustc {RUSTC}.

use crate::cost::{Cost, Costs};
";
/// As many as a device can have.
const DOFS: [u16; 8] = [1, 2, 3, 4, 5, 6, 7, 8];
/// Of a straight line two points are enough to see whether it still holds; with 8, loops that need not look whether they
/// are done lie below it.
const ENDS: [u16; 2] = [1, 7];
/// How `module_costs` calls a tick beside its modules' calls.
const OF_TICK: &str = "tick";
/// More than the bound of now by so many per cent is too much.
const TOO_MUCH_PERCENT: u64 = 10;
/// A change by more per cent is worth a line.
const WORTH_TELLING_PERCENT: u64 = 5;

/// Most cycles by degrees of freedom.
type Points = BTreeMap<u16, u64>;

/// Works out the table and writes it.
pub(crate) fn write() -> Outcome {
    let toolchain = Toolchain::set_up()?;
    let costs = costs(&measure(toolchain, &DOFS)?)?;
    print!("{}", changes(&costs));
    let file = top().join(FILE);
    std::fs::write(&file, text(&costs, &toolchain.version()?)?)
        .map_err(|error| format!("cannot write {}: {error}", file.display()))
}

/// Whether the table still holds for every board's image, and is not far above what is needed. Another compiler
/// than the table's is not held to it.
pub(crate) fn hold(toolchain: Toolchain) -> Outcome {
    let rustc = toolchain.version()?;
    if !TEXT.contains(&by(&rustc)) {
        println!("{FILE} is not of rustc {rustc}: not held to it");
        return Ok(());
    }
    let costs = costs(&measure(toolchain, &ENDS)?)?;
    print!("{}", changes(&costs));
    let wrong: Vec<String> =
        costs.iter().filter_map(|(name, points)| wrong(name, committed(name), points)).collect();
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n") + "\nrun `cargo xtask costs`") }
}

/// What `module_costs` says of every board's image.
fn measure(toolchain: Toolchain, dofs: &[u16]) -> Result<String, String> {
    let mut rows = String::new();
    for board in BOARDS {
        let image = folder().join(build(toolchain, board, None, SIDES[0])?.name);
        println!("bounds of every kind of module on {}", board.name);
        let mut arguments = vec![image.into_os_string()];
        arguments.extend(dofs.iter().map(|dof| dof.to_string().into()));
        rows.push_str(&example("module_costs", &arguments)?);
    }
    Ok(rows)
}

/// The tick and every kind, with the most cycles of all rows; calls are the kinds' own.
fn costs(rows: &str) -> Result<BTreeMap<String, Points>, String> {
    let rows: BTreeSet<Row<'_>> = rows.lines().map(Row::read).collect::<Result<_, _>>()?;
    let call = call(&rows);
    let mut costs: BTreeMap<String, Points> = BTreeMap::new();
    for Row { name, dof, cycles, calls } in rows {
        let most = costs.entry(name.to_owned()).or_default().entry(dof).or_default();
        let cycles =
            if name == OF_TICK { cycles.saturating_sub(call * calls) } else { cycles + call * calls };
        *most = cycles.max(*most);
    }
    let known = Standard::KINDS.iter().map(|kind| kind.name).chain([OF_TICK]);
    match known.into_iter().find(|name| !costs.contains_key(*name)) {
        None => Ok(costs),
        Some(name) => Err(format!("nothing was said of {name}")),
    }
}

/// One line of `module_costs`.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Row<'a> {
    name: &'a str,
    dof: u16,
    cycles: u64,
    calls: u64,
}

impl<'a> Row<'a> {
    fn read(line: &'a str) -> Result<Self, String> {
        let read = || {
            let mut words = line.split(' ');
            let (name, dof) = (words.next()?, words.next()?.parse().ok()?);
            Some(Self { name, dof, cycles: words.next()?.parse().ok()?, calls: words.next()?.parse().ok()? })
        };
        read().ok_or_else(|| format!("'{line}' is no row of module_costs"))
    }
}

/// What one more call costs the engine: from the fewest calls to the most, so that what is peculiar to a scheme stays
/// with the tick.
fn call(rows: &BTreeSet<Row<'_>>) -> u64 {
    let ticks = |dof: u16| rows.iter().filter(move |row| row.name == OF_TICK && row.dof == dof);
    let slope = |dof: u16| {
        let few = ticks(dof).min_by_key(|row| (row.calls, row.cycles))?;
        let many = ticks(dof).max_by_key(|row| (row.calls, row.cycles))?;
        let calls = many.calls.checked_sub(few.calls).filter(|calls| *calls > 0)?;
        Some(many.cycles.saturating_sub(few.cycles).div_ceil(calls))
    };
    rows.iter().filter_map(|row| slope(row.dof)).max().unwrap_or_default()
}

/// The lowest line that is nowhere below the points: offset and slope.
fn line(points: &Points) -> (u64, u64) {
    let most = points.values().copied().max().unwrap_or_default();
    let offset = |slope: u64| {
        let offsets = points.iter().map(|(dof, cycles)| cycles.saturating_sub(slope * u64::from(*dof)));
        offsets.max().unwrap_or_default()
    };
    let sum = |slope: u64| points.keys().map(|dof| offset(slope) + slope * u64::from(*dof)).sum::<u64>();
    let slope = (0..=most).min_by_key(|slope| sum(*slope)).unwrap_or_default();
    (offset(slope), slope)
}

/// What the table says of the compiler.
fn by(rustc: &str) -> String {
    format!("Images by rustc {rustc}.")
}

/// The table as the core has it.
fn text(costs: &BTreeMap<String, Points>, rustc: &str) -> Result<String, String> {
    let cost = |name: &str| {
        let (offset, slope) = costs.get(name).map(line).unwrap_or_default();
        match (u16::try_from(offset), u16::try_from(slope)) {
            (Ok(offset), Ok(slope)) => Ok(format!("Cost::new({offset}, {slope})")),
            _ => Err(format!("{name} takes {offset} + {slope} x DoF cycles, more than the table can hold")),
        }
    };
    let mut text = format!(
        "{}\n/// A tick without modules: the device's signals in and out, and the engine.\n\
         pub const TICK: Cost = {};\n\n/// What each kind of module adds.\npub const COSTS: &Costs = &[\n",
        HEAD.replace(&by(RUSTC), &by(rustc)),
        cost(OF_TICK)?
    );
    for kind in Standard::KINDS {
        let _ = writeln!(text, "    (\"{}\", {}),", kind.name, cost(kind.name)?);
    }
    Ok(text + "];\n")
}

/// What the core says now.
fn committed(name: &str) -> Option<Cost> {
    let known = COSTS.iter().find(|(known, _)| *known == name).map(|(_, cost)| *cost);
    known.or((name == OF_TICK).then_some(TICK))
}

/// Why a cost does not hold.
fn wrong(name: &str, cost: Option<Cost>, points: &Points) -> Option<String> {
    let Some(cost) = cost else { return Some(format!("{name} has no line in {FILE}")) };
    let (offset, slope) = line(points);
    points.iter().find_map(|(dof, cycles)| {
        let committed = u64::from(cost.cycles(usize::from(*dof)));
        let needed = offset + slope * u64::from(*dof);
        if committed < *cycles {
            Some(format!("{name} takes up to {cycles} cycles at {dof} DoF, {FILE} says {committed}"))
        } else if 100 * committed > (100 + TOO_MUCH_PERCENT) * needed {
            Some(format!(
                "{name} takes up to {needed} cycles at {dof} DoF, {FILE} says as many as {committed}"
            ))
        } else {
            None
        }
    })
}

/// A line for each cost that is another one than the core's by much, with before and after.
fn changes(costs: &BTreeMap<String, Points>) -> String {
    let mut lines = String::new();
    for (name, points) in costs {
        let Some(((dof, after), cost)) = points.last_key_value().zip(committed(name)) else { continue };
        let before = u64::from(cost.cycles(usize::from(*dof)));
        if 100 * after.abs_diff(before) > WORTH_TELLING_PERCENT * before {
            let _ = writeln!(lines, "{name} at {dof} DoF: {before} cycles before, {after} after");
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(points: &[(u16, u64)]) -> Points {
        points.iter().copied().collect()
    }

    #[test]
    fn a_line_lies_on_points_in_a_row_and_above_all_others() {
        assert_eq!(line(&points(&[(1, 110), (2, 120), (7, 170)])), (100, 10));
        assert_eq!(line(&points(&[(1, 50), (7, 50)])), (50, 0));
        let bent = points(&[(1, 100), (2, 180), (3, 200), (4, 300), (5, 310), (6, 390), (7, 410)]);
        let (offset, slope) = line(&bent);
        let above: Vec<u64> = bent
            .iter()
            .map(|(dof, cycles)| (offset + slope * u64::from(*dof)).checked_sub(*cycles).unwrap())
            .collect();
        assert!(above.iter().filter(|above| **above <= 1).count() >= 2, "no lower line: {above:?}");
    }

    #[test]
    fn calls_belong_to_modules() {
        let kinds: String = Standard::KINDS.iter().map(|kind| format!("{} 3 100 2\n", kind.name)).collect();
        let rows = format!("{kinds}PCTRL_MOD 3 90 1\ntick 3 500 2\ntick 3 560 3\ntick 3 950 12\n");
        let costs = costs(&rows).unwrap();
        // (950 - 500) / 10.
        assert_eq!(costs["PCTRL_MOD"], points(&[(3, 100 + 2 * 45)]));
        assert_eq!(costs["tick"], points(&[(3, 560 - 3 * 45)]));
        assert!(super::costs(&kinds).unwrap_err().contains("tick"));
        assert!(super::costs("PCTRL_MOD 3 much 1").unwrap_err().contains("'PCTRL_MOD 3 much 1'"));
    }

    #[test]
    fn a_cost_below_the_bound_or_far_above_it_is_told_with_both_numbers() {
        let bounds = points(&[(1, 110), (7, 170)]);
        let wrong = |cost| wrong("PCTRL_MOD", cost, &bounds);
        assert_eq!(wrong(Some(Cost::new(100, 10))), None);
        assert_eq!(wrong(Some(Cost::new(109, 10))), None);
        let below = wrong(Some(Cost::new(99, 10))).unwrap();
        assert!(below.contains("up to 110 cycles at 1 DoF") && below.contains("says 109"), "{below}");
        let above = wrong(Some(Cost::new(125, 10))).unwrap();
        assert!(above.contains("110 cycles at 1 DoF") && above.contains("135"), "{above}");
        assert!(wrong(None).unwrap().contains("has no line"));
    }

    #[test]
    fn a_change_is_told_from_five_per_cent_on() {
        let before = u64::from(committed("PDCTRL_MOD").unwrap().cycles(7));
        let of = |cycles| changes(&BTreeMap::from([("PDCTRL_MOD".to_owned(), points(&[(7, cycles)]))]));
        assert_eq!(of(before + before / 25), "");
        let told = of(before + before / 10);
        assert!(told.starts_with("PDCTRL_MOD at 7 DoF: ") && told.contains(&before.to_string()), "{told}");
    }

    #[test]
    fn the_table_has_every_kind() {
        let kinds: String = Standard::KINDS.iter().map(|kind| format!("{} 3 100 2\n", kind.name)).collect();
        let text = text(&costs(&format!("{kinds}tick 3 500 2\n")).unwrap(), "1.95.0").unwrap();
        assert!(text.contains("Images by rustc 1.95.0.") && TEXT.contains("Images by rustc "), "{text}");
        assert_eq!(text.matches("Cost::new(100, 0)").count(), Standard::KINDS.len());
        assert!(text.contains("pub const TICK: Cost = Cost::new(500, 0);"), "{text}");
    }
}
