//! What kinds of modules cost on an image, by bounds of small schemes around each: rows for `cargo xtask costs`.
//!
//! `cargo run --release -p hil-sim --example module_costs IMAGE DOF... [KIND...]`; every kind and `tick` if none is given.
//!
//! With the fewest and the most degrees of freedom a module is looked at with every choice of its parameters, in between
//! with those that were worst there.
//!
//! ```text
//! PDCTRL_MOD 3 398 1        kind, degrees of freedom, most cycles of its calls in a tick, number of these
//! tick 3 1123 2             degrees of freedom, cycles of a tick beside its modules' calls, number of these
//! ```

use std::error::Error;
use std::num::NonZero;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use cycles::timing::{Column, Timing};
use hil_sim::cycles::{CyclesError, Firmware, SchemeBound, Variant};

/// P controllers of the largest scheme.
const MANY: u8 = 10;

/// A scheme, around a module or of many, for so many degrees of freedom.
type Task<'a> = (Option<&'a Variant>, usize);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let image = arguments.next().ok_or("give the path of an image, then degrees of freedom")?;
    let (dofs, kinds): (Vec<String>, Vec<String>) = arguments.partition(|word| word.parse::<usize>().is_ok());
    let mut dofs: Vec<usize> = dofs.iter().map(|dof| dof.parse()).collect::<Result<_, _>>()?;
    dofs.sort_unstable();
    let firmware = Firmware::find(Some(Path::new(&image)), None)?;
    let variants = Variant::all();
    let is_wanted = |name: &str| kinds.is_empty() || kinds.iter().any(|kind| kind == name);
    let around = variants.iter().filter(|variant| is_wanted(variant.name)).map(Some);
    let schemes: Vec<Option<&Variant>> = around.chain(is_wanted("tick").then_some(None)).collect();
    let (ends, between): (Vec<usize>, Vec<usize>) =
        dofs.iter().partition(|dof| Some(*dof) == dofs.first() || Some(*dof) == dofs.last());
    let at_ends = bounds(&firmware, &all(&schemes, &ends))?;
    let worst: Vec<Option<&Variant>> = schemes
        .iter()
        .copied()
        .filter(|scheme| scheme.is_none_or(|variant| is_worst(variant, &at_ends)))
        .collect();
    for ((variant, dof), bound) in at_ends.iter().chain(&bounds(&firmware, &all(&worst, &between))?) {
        println!("tick {dof} {} {}", bound.rest, bound.calls);
        if let (Some(variant), (cycles, calls)) = (variant, bound.module) {
            println!("{} {dof} {cycles} {calls}", variant.name);
        }
    }
    Ok(())
}

fn all<'a>(schemes: &[Option<&'a Variant>], dofs: &[usize]) -> Vec<Task<'a>> {
    schemes.iter().flat_map(|scheme| dofs.iter().map(|dof| (*scheme, *dof))).collect()
}

/// Whether no other variant of the kind takes more, for some number of degrees of freedom.
fn is_worst(variant: &Variant, bounds: &[(Task<'_>, SchemeBound)]) -> bool {
    let mut own = bounds.iter().filter(|((scheme, _), _)| *scheme == Some(variant));
    let alike = |dof: usize| {
        let alike = bounds.iter().filter(move |((scheme, other_dof), _)| {
            *other_dof == dof && scheme.is_some_and(|other| other.name == variant.name)
        });
        alike.map(|(_, bound)| bound.module.0)
    };
    own.any(|((_, dof), bound)| alike(*dof).max() == Some(bound.module.0))
}

/// What there is a bound of, by as many threads as there are processors.
fn bounds<'a>(
    firmware: &Firmware,
    tasks: &[Task<'a>],
) -> Result<Vec<(Task<'a>, SchemeBound)>, Box<dyn Error>> {
    let timing = Timing::new(firmware.memory().profile(), Column::Upper);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        while let Some((variant, dof)) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
            let bound = match variant {
                Some(variant) => SchemeBound::around(variant, firmware, timing, *dof)?,
                None => SchemeBound::of_many(MANY, firmware, timing, *dof)?,
            };
            found.extend(bound.map(|bound| ((*variant, *dof), bound)));
        }
        Ok::<_, CyclesError>(found)
    };
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    let found = thread::scope(|scope| {
        let started: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let ended = started.into_iter().map(|worker| worker.join().map_err(|_| "a worker panicked"));
        ended.collect::<Result<Vec<_>, _>>()
    })?;
    Ok(found.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}
