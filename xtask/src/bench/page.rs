//! The tables of `docs/benchmarks.md` and of its details in the book.

use std::fmt::Write;

use super::simulator::RUNS;
use super::{Counts, LINUXCNC_CALL, Line, Simulator, USUAL};
use crate::table::table;

const HEAD: &str = "\
# Benchmarks

Instructions per tick on x86-64. `cargo xtask bench` counts them with valgrind's callgrind in an optimized build (thin LTO, one
codegen unit), as the difference of two runs of different length. Counts do not depend on the machine's speed or load; another
compiler version may change them by a few percent. Only the shipped experiment is timed. The book has a page with all tables.
";

const TABLE1: &str = "
`schemes/bilateral.scheme`, side master, 3 DoF: the whole `Dimsart::tick` with both frames. By hand: the same arithmetic
as one function over plain arrays with constant parameters, with the same packets and checks. All signals and packets are
equal bit by bit over 10 000 ticks (`dimsart-core/by-hand/src/lib.rs`).
";

/// Returns the page's summary.
pub(super) fn summary(rustc: &str, counts: &Counts, simulated: &Simulator) -> String {
    let mut page = format!("{HEAD}\nCompiler: rustc {rustc}\n");
    section(&mut page, "Budgets", &budgets(counts));
    section(
        &mut page,
        "Table 1",
        &format!("{TABLE1}{}", table(["", "Engine", "By hand", "Ratio"], &table1(counts))),
    );
    section(&mut page, "The shipped experiment", &simulator(simulated));
    page
}

/// Returns the other tables.
pub(super) fn details(counts: &Counts, links: &str) -> String {
    let (modules, axes) = USUAL;
    let mut page = "# Benchmarks in detail\n".to_owned();
    let what = format!(
        "\nA step with modules whose `compute` is empty; the image contains all kinds of the standard library.\n\
         LinuxCNC HAL takes {LINUXCNC_CALL} instructions to call a function.\n"
    );
    section(&mut page, "The engine alone", &(what + &series("Modules", &counts.empty)));
    let what = format!("\nA step with P controllers, {axes} DoF, 3 ports each.\n");
    section(&mut page, "Cost by number of modules", &(what + &series("Modules", &counts.modules)));
    let what = format!("\nA step with {modules} P controllers.\n");
    section(&mut page, "Cost by number of axes", &(what + &series("DoF", &counts.axes)));
    let what = format!("\nThe same {modules} P controllers, {axes} DoF.\n");
    let rows: Vec<_> = counts.idle.iter().map(|(what, cost)| [(*what).into(), number(*cost)]).collect();
    section(&mut page, "Factors without effect", &(what + &table(["", "Instructions"], &rows)));
    section(&mut page, "A packet on every carrier", &super::frames::text(&counts.frames));
    section(&mut page, "Table 1 over every carrier", &super::links::text(links));
    page
}

fn section(page: &mut String, title: &str, body: &str) {
    let _ = write!(page, "\n## {title}\n{body}");
}

/// Returns the table of budgets.
pub(super) fn budgets(counts: &Counts) -> String {
    let rows = counts.budgets().into_iter();
    let rows: Vec<[String; 3]> =
        rows.map(|budget| [budget.what.into(), number(budget.found), number(budget.most)]).collect();
    table(["Budget", "Counted", "At most"], &rows)
}

fn table1(counts: &Counts) -> Vec<[String; 4]> {
    let rows = counts.table1.iter();
    rows.map(|(what, engine, by_hand)| {
        [(*what).into(), number(*engine), number(*by_hand), number(engine / by_hand)]
    })
    .collect()
}

fn simulator(found: &Simulator) -> String {
    let Simulator { simulated_s, recorded_s, silent_s, per_tick } = found;
    let row = |what: &str, time_s: f64| {
        [what.into(), format!("{time_s:.4}"), format!("{:.0}", simulated_s / time_s)]
    };
    let rows = [
        row("all signals recorded, with the report and its plots", *recorded_s),
        row("nothing recorded", *silent_s),
    ];
    format!(
        "\n`dimsart run`: {simulated_s:.3} s of both sides with hand, wall, devices and links, on one core. The time is that of\n\
         the whole command by its own clock, the best of {RUNS} runs. The time depends on the machine and its load and has no\n\
         budget. With nothing recorded, a tick of the whole simulation takes {} instructions.\n{}",
        number(per_tick.round()),
        table(["", "Time (s)", "Times real time"], &rows),
    )
}

fn series(what: &str, points: &[(u8, f64)]) -> String {
    let Line { slope, offset, residual } = Line::fit(points);
    let (slope, offset, residual) = (number(slope), number(offset), number(residual));
    // The fit shows the rest.
    let ends = points.iter().take(1).chain(points.iter().skip(1).last());
    let rows: Vec<_> = ends.map(|(n, cost)| [n.to_string(), number(*cost)]).collect();
    let line = format!("\nLinear fit: {offset} + {slope} n, maximum residual {residual}.\n");
    table([what, "Instructions"], &rows) + &line
}

/// Formats with at most two decimals; none for integers.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
