//! The tables of `docs/benchmarks.md`.

use std::fmt::Write;

use super::simulator::{RUNS, WANTED};
use super::{Counts, LINUXCNC_CALL, Line, Simulator, USUAL};
use crate::shell::{Outcome, command, top};
use crate::table::table;

const HEAD: &str = "\
# What a tick costs

Written by `cargo xtask bench`: instructions per tick on x86-64, counted by valgrind's callgrind with
optimization, thin LTO and one codegen unit, the difference of two runs of different length. Counted and
not timed, so the numbers do not depend on the machine's speed or load; another compiler version may
move them by a few percent. Only the time that the shipped experiment takes, at the end, is a time.
";

const TABLE1: &str = "
`schemes/bilateral.scheme`, side master, 3 DoF, the whole `Dimsart::tick` with both frames. By hand: the
same arithmetic as one function over plain arrays with constant parameters, the same packets and checks,
and the same bits in every signal and packet over 10 000 ticks (`dimsart-core/by-hand/src/lib.rs`).
";

/// The whole page.
pub(super) fn text(counts: &Counts, links: &str, simulated: &Simulator) -> String {
    let rustc = command("rustc", ["--version"]).output().ok();
    let rustc = rustc.and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let (modules, axes) = USUAL;
    let mut page = format!("{HEAD}\nCompiler: {}\n", rustc.trim());
    let mut section = |title: &str, body: &str| {
        let _ = write!(page, "\n## {title}\n{body}");
    };
    section("Budgets", &budgets(counts));
    section("Table 1", &format!("{TABLE1}{}", table(["", "Engine", "By hand", "Ratio"], &table1(counts))));
    let what = format!(
        "\nA step with modules whose `compute` is empty, among the kinds of the standard library.\n\
         LinuxCNC HAL spends {LINUXCNC_CALL} instructions on calling a function.\n"
    );
    section("The engine alone", &(what + &series("Modules", &counts.empty)));
    let what = format!("\nA step with P controllers, {axes} DoF, 3 ports each.\n");
    section("Over the number of modules", &(what + &series("Modules", &counts.modules)));
    let what = format!("\nA step with {modules} P controllers.\n");
    section("Over the number of axes", &(what + &series("DoF", &counts.axes)));
    let what = format!("\nThe same {modules} P controllers, {axes} DoF.\n");
    let rows: Vec<_> = counts.idle.iter().map(|(what, cost)| [(*what).into(), number(*cost)]).collect();
    section("What does not matter", &(what + &table(["", "Instructions"], &rows)));
    section("A packet on every carrier", &super::frames::text(&counts.frames));
    section("Table 1 over every carrier", &super::links::text(links));
    section("The shipped experiment", &simulator(simulated));
    page
}

/// Writes the page where the repository keeps it.
pub(super) fn write(text: &str) -> Outcome {
    let folder = top().join("docs");
    let file = folder.join("benchmarks.md");
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, text));
    written.map_err(|error| format!("cannot write {}: {error}", file.display()))
}

/// The table of budgets.
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
    let rows = [row("every signal recorded", *recorded_s), row("nothing recorded", *silent_s)];
    let verdict =
        if simulated_s / recorded_s >= WANTED { "reached" } else { "missed on this machine, this time" };
    format!(
        "\n`dimsart run`: {simulated_s:.3} s of both sides with hand, wall, devices and links, on one core, the best of\n\
         {RUNS} runs, from the first tick to the last, without set-up and report. Wanted with every signal recorded:\n\
         {WANTED} times real time; {verdict}. A time depends on the machine and on\n\
         what else it does, so it breaks no budget. Counted: a tick of the whole simulation takes {}\n\
         instructions with nothing recorded.\n{}",
        number(per_tick.round()),
        table(["", "Time (s)", "Times real time"], &rows),
    )
}

fn series(what: &str, points: &[(u8, f64)]) -> String {
    let Line { slope, offset, residual } = Line::fit(points);
    let (slope, offset, residual) = (number(slope), number(offset), number(residual));
    let rows: Vec<_> = points.iter().map(|(n, cost)| [n.to_string(), number(*cost)]).collect();
    let line = format!("\nStraight line: {offset} + {slope} n, largest distance from it {residual}.\n");
    table([what, "Instructions"], &rows) + &line
}

/// At most two decimals, none where there is nothing behind the point.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
