//! `cargo xtask bench`: counts the instructions of a tick against budgets, and times the simulator.
//!
//! Callgrind counts the instructions of a function in an optimized build, so that the same source and
//! compiler give the same number in every run. The time of the shipped experiment is reported without a
//! budget.

mod count;
mod frames;
mod line;
mod links;
mod page;
mod simulator;

use crate::measured;
use crate::shell::Outcome;
use crate::toolchain::Toolchain;
use count::Counter;
use frames::Frame;
use line::Line;
use simulator::Simulator;

/// Maximum instructions of the engine per module call.
const CALL_BUDGET: f64 = 14.0;
/// LinuxCNC HAL's instructions per function call, counted the same way.
const LINUXCNC_CALL: f64 = 29.4;
/// Maximum ratio to the hand-written arithmetic, which does not check its outputs (0.9 of the cost) and keeps
/// integrals of the applied force.
const TABLE1_BUDGET: f64 = 3.6;
/// Maximum residual of a count from the linear fit.
const LINE_BUDGET: f64 = 1.0;

const MODULES: [u8; 5] = [1, 2, 4, 8, 16];
const AXES: [u8; 5] = [1, 2, 3, 5, 7];
/// Modules and axes, while the other one is varied.
const USUAL: (u8, u8) = (8, 3);

/// Cargo profile of the counted programs.
const PROFILE: &str = "counted";

/// All counts, in instructions per tick.
struct Counts {
    /// Steps with 1 to 16 empty modules.
    empty: Vec<(u8, f64)>,
    /// Ticks of Table 1, by the engine and by hand, with a packet in every tick and without packets.
    table1: [(&'static str, f64, f64); 2],
    /// Steps with 1 to 16 P controllers.
    modules: Vec<(u8, f64)>,
    /// Steps with P controllers of 1 to 7 axes.
    axes: Vec<(u8, f64)>,
    /// Steps of the usual size, with parts that must not add cost.
    idle: Vec<(&'static str, f64)>,
    /// A packet on every carrier.
    frames: Vec<Frame>,
}

/// A budget and its result.
struct Budget {
    what: &'static str,
    found: f64,
    most: f64,
}

/// Counts, prints the tables and writes `docs/benchmarks.md`; fails if a budget is exceeded.
pub(crate) fn run() -> Outcome {
    let counts = Counts::count(&Counter::new()?)?;
    let summary = page::summary(&Toolchain::Rustup.version()?, &counts, &Simulator::measure()?);
    let details = page::details(&counts, &links::measure()?);
    println!("{summary}\n{details}");
    measured::write("benchmarks", &summary, &details)?;
    counts.hold()
}

/// Counts and prints the results with budgets; fails if a budget is exceeded.
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
                .into_iter()
                .map(|modules| {
                    Ok((modules, counter.per_tick("counted_step", &["empty", &modules.to_string()])?))
                })
                .collect::<Result<_, String>>()?,
            modules: MODULES
                .into_iter()
                .map(|modules| Ok((modules, p(modules, 0, usual_axes, "few", "small")?)))
                .collect::<Result<_, String>>()?,
            axes: AXES
                .into_iter()
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
            Budget { what: "residual over modules", found: modules.residual, most: LINE_BUDGET },
            Budget { what: "residual over axes", found: axes.residual, most: LINE_BUDGET },
            Budget { what: "effect of inactive parts", found: spread, most: 0.0 },
        ];
        budgets.extend(frames);
        budgets
    }

    fn hold(&self) -> Outcome {
        let broken: Vec<String> = self
            .budgets()
            .iter()
            .filter(|budget| budget.found > budget.most)
            .map(|budget| format!("{}: {:.2} (limit {:.2})", budget.what, budget.found, budget.most))
            .collect();
        if broken.is_empty() { Ok(()) } else { Err(format!("budget exceeded: {}", broken.join("; "))) }
    }
}
