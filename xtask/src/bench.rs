//! `cargo xtask bench`: what a tick costs, counted and held to its budgets; the simulator, timed.
//!
//! Counted, not timed: callgrind runs an optimized build and counts every instruction of one function,
//! so the same source and compiler give the same number on every run. The time that the shipped experiment
//! takes is measured too, and shown; a busy machine breaks no budget.

mod count;
mod frames;
mod line;
mod links;
mod page;
mod simulator;

use crate::shell::Outcome;
use count::Counter;
use frames::Frame;
use line::Line;
use simulator::Simulator;

/// Most instructions the engine may spend on calling a module.
const CALL_BUDGET: f64 = 25.0;
/// What LinuxCNC HAL spends on calling a function, counted the same way.
const LINUXCNC_CALL: f64 = 29.4;
/// Most times as many instructions as the same arithmetic by hand, which does not look at what it has written: that is
/// 0.9 of it, and keeps integrals on the force that was applied.
const TABLE1_BUDGET: f64 = 3.7;
/// Largest distance of a count from its straight line.
const LINE_BUDGET: f64 = 1.0;

const MODULES: std::ops::RangeInclusive<u8> = 1..=16;
const AXES: std::ops::RangeInclusive<u8> = 1..=7;
/// Modules and axes while the other one is varied.
const USUAL: (u8, u8) = (8, 3);

/// Cargo's profile of what is counted.
const PROFILE: &str = "counted";

/// All that was counted, in instructions per tick.
struct Counts {
    /// A step with 1 to 16 modules that do nothing.
    empty: Vec<(u8, f64)>,
    /// A tick of Table 1: engine and by hand, with a packet every tick and without any.
    table1: [(&'static str, f64, f64); 2],
    /// A step with 1 to 16 P controllers.
    modules: Vec<(u8, f64)>,
    /// A step with P controllers of 1 to 7 axes.
    axes: Vec<(u8, f64)>,
    /// A step of the usual size, next to what must not matter.
    idle: Vec<(&'static str, f64)>,
    /// A packet on every carrier.
    frames: Vec<Frame>,
}

/// One demand on the results.
struct Budget {
    what: &'static str,
    found: f64,
    most: f64,
}

/// Counts, prints the tables, writes `docs/benchmarks.md`; fails when a budget is broken.
pub(crate) fn run() -> Outcome {
    let counts = Counts::count(&Counter::new()?)?;
    let text = page::text(&counts, &links::measure()?, &Simulator::measure()?);
    println!("{text}");
    page::write(&text)?;
    counts.hold()
}

/// Counts and prints what is held to a budget; fails when one is broken.
pub(crate) fn hold() -> Outcome {
    let counts = Counts::count(&Counter::new()?)?;
    println!("{}", page::budgets(&counts));
    counts.hold()
}

impl Counts {
    fn count(counter: &Counter) -> Result<Self, String> {
        let (usual_modules, usual_axes) = USUAL;
        let p = |active: u8, inactive: u8, axes: u8, types: &str, data_base: &str| {
            let numbers = [active, inactive, axes].map(|number| number.to_string());
            let [active, inactive, axes] = numbers.each_ref().map(String::as_str);
            counter.per_tick("counted_step", &["p", active, inactive, axes, types, data_base])
        };
        let table1 = |name, scheme: &str| {
            let engine = counter.per_tick("counted_table1", &[scheme])?;
            let by_hand = counter.per_tick("Master*tick", &[scheme])?;
            Ok::<_, String>((name, engine, by_hand))
        };
        Ok(Self {
            frames: frames::count()?,
            table1: [table1("a packet every tick", "table1")?, table1("no packet ever", "table1-silent")?],
            empty: MODULES
                .map(|modules| {
                    Ok((modules, counter.per_tick("counted_step", &["empty", &modules.to_string()])?))
                })
                .collect::<Result<_, String>>()?,
            modules: MODULES
                .map(|modules| Ok((modules, p(modules, 0, usual_axes, "few", "small")?)))
                .collect::<Result<_, String>>()?,
            axes: AXES
                .map(|axes| Ok((axes, p(usual_modules, 0, axes, "few", "small")?)))
                .collect::<Result<_, String>>()?,
            idle: vec![
                ("alone", p(usual_modules, 0, usual_axes, "few", "small")?),
                ("with 8 inactive modules", p(usual_modules, 8, usual_axes, "few", "small")?),
                ("with 6 more types in more slots", p(usual_modules, 0, usual_axes, "many", "small")?),
                ("in a Data Base 16 times as large", p(usual_modules, 0, usual_axes, "few", "large")?),
            ],
        })
    }

    fn budgets(&self) -> Vec<Budget> {
        let [(_, engine, by_hand), _] = self.table1;
        let costs = self.idle.iter().map(|(_, cost)| *cost);
        let spread = costs.clone().fold(0.0, f64::max) - costs.fold(f64::INFINITY, f64::min);
        let (modules, axes) = (Line::fit(&self.modules), Line::fit(&self.axes));
        let frames = frames::budgets(&self.frames).map(|(what, found, most)| Budget { what, found, most });
        let mut budgets = vec![
            Budget { what: "engine per module call", found: Line::fit(&self.empty).slope, most: CALL_BUDGET },
            Budget { what: "Table 1 against by hand", found: engine / by_hand, most: TABLE1_BUDGET },
            Budget { what: "off the line over modules", found: modules.residual, most: LINE_BUDGET },
            Budget { what: "off the line over axes", found: axes.residual, most: LINE_BUDGET },
            Budget { what: "effect of what is not active", found: spread, most: 0.0 },
        ];
        budgets.extend(frames);
        budgets
    }

    fn hold(&self) -> Outcome {
        let broken: Vec<String> = self
            .budgets()
            .iter()
            .filter(|budget| budget.found > budget.most)
            .map(|budget| format!("{}: {:.2}, at most {:.2}", budget.what, budget.found, budget.most))
            .collect();
        if broken.is_empty() { Ok(()) } else { Err(format!("over budget: {}", broken.join("; "))) }
    }
}
