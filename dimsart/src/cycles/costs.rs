//! Costs of a tick and of each module kind on an image: lines above the bounds of small schemes around every kind.
//!
//! Every choice of a kind's parameters is bounded with the kind's minimum degrees of freedom, mostly 1, and with one more. The
//! choices with the maximum there, measured or extrapolated by 6, are also bounded with all others. A choice that is worst only
//! with many degrees of freedom would be missed; on nucleo-g474re an exhaustive search gave the same lines.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZero;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use ::cycles::timing::Timing;
use dimsart_core::online::Opcode;
use dimsart_core::{Cost, KindId, ModuleKinds};

use super::law_costs;
use super::scheme_bound::{DOF_LIMIT, SchemeBound, Variant};
use super::{CyclesError, Firmware};

/// Added degrees of freedom for every choice of parameters.
const FEW: Range<u16> = 0..2;
/// Added degrees of freedom for the worst choices.
const MANY: Range<u16> = FEW.end..DOF_LIMIT;
/// P controllers of the largest scheme.
const CONTROLLERS: u8 = 10;

/// Costs of a tick and of each module kind on an image.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImageCosts {
    /// Costs of the tick, of each kind, then of each instruction of laws, as in a [stamp](dimsart_core::stamp).
    pub lines: Vec<Cost>,
    /// Module kinds without a bound, with the reasons.
    pub unknown: Vec<(String, String)>,
}

/// A scheme around a module, or of many modules, with its degrees of freedom.
type Task<'a> = (Option<&'a Variant>, u16);
/// The result; none if the board lacks memory.
type Found<'a> = (Task<'a>, Result<Option<SchemeBound>, CyclesError>);
/// Maximum cycles by degrees of freedom.
type Points = BTreeMap<u16, u64>;

impl ImageCosts {
    /// Computes the costs of an image with these kinds, all in `kinds`, built from the sources of this program.
    ///
    /// # Errors
    /// [`CyclesError`] if a tick without modules has no bound.
    pub fn of(
        firmware: &Firmware,
        timing: Timing,
        ids: &[KindId],
        kinds: ModuleKinds,
    ) -> Result<Self, CyclesError> {
        let bounds = |tasks: &[_]| bounds(firmware, timing, tasks, kinds);
        let variants: Vec<Variant> = ids.iter().flat_map(|id| Variant::of(*id, kinds)).collect();
        let few = tasks(variants.iter().map(Some).chain([None]), FEW);
        let mut found = bounds(&few);
        let worst: BTreeSet<usize> = ids.iter().flat_map(|id| worst(&found, *id)).collect();
        let worst = worst.into_iter().filter_map(|index| few.get(index)).map(|(variant, _)| *variant);
        found.extend(bounds(&tasks(worst.chain([None]), MANY)));
        let mut costs = Self::above(found, ids, kinds)?;
        if runs_laws(ids) {
            costs.lines.extend(instructions(firmware, timing, kinds)?);
        }
        Ok(costs)
    }

    /// The lowest lines above bounds.
    fn above(found: Vec<Found<'_>>, ids: &[KindId], kinds: ModuleKinds) -> Result<Self, CyclesError> {
        let mut bounds: Vec<(Task<'_>, SchemeBound)> = Vec::new();
        let mut failed: BTreeMap<KindId, String> = BTreeMap::new();
        for (task, bound) in found {
            match (task.0, bound) {
                (_, Ok(bound)) => bounds.extend(bound.map(|bound| (task, bound))),
                (Some(variant), Err(error @ (CyclesError::Unbounded { .. } | CyclesError::Scheme(_)))) => {
                    failed.entry(variant.kind()).or_insert_with(|| error.to_string());
                }
                (_, Err(error)) => return Err(error),
            }
        }
        let call = call(&bounds);
        let tick =
            bounds.iter().map(|((_, dof), bound)| (*dof, bound.rest.saturating_sub(call * bound.calls)));
        let tick = line(&most(tick)).ok_or(CyclesError::NoTick)?;
        let (mut lines, mut unknown) = (vec![tick], Vec::new());
        for kind in ids {
            let own =
                bounds.iter().filter(|((variant, _), _)| variant.is_some_and(|own| own.kind() == *kind));
            let points = own
                .map(|((_, dof), SchemeBound { module: (cycles, calls), .. })| (*dof, cycles + call * calls));
            let cost = match failed.remove(kind) {
                Some(reason) => Err(reason),
                None => line(&most(points)).ok_or_else(|| {
                    "the image lacks modules that the test scheme needs, or memory for these modules"
                        .to_owned()
                }),
            };
            lines.push(cost.unwrap_or_else(|reason| {
                unknown.push((name_of(*kind, kinds), reason));
                Cost::UNKNOWN
            }));
        }
        Ok(Self { lines, unknown })
    }
}

/// Whether a kind runs laws; then cost lines of instructions follow.
pub(crate) fn runs_laws(ids: &[KindId]) -> bool {
    ids.contains(&law_costs::MODULE.kind)
}

/// The name of a kind, or its id if unknown.
pub(crate) fn name_of(id: KindId, kinds: ModuleKinds) -> String {
    kinds.kind(id).map_or_else(|| id.to_string(), |kind| kind.name.to_owned())
}

/// Cost of each instruction of a law, per axis.
fn instructions(firmware: &Firmware, timing: Timing, kinds: ModuleKinds) -> Result<Vec<Cost>, CyclesError> {
    let laws = [law_costs::plain()].into_iter().chain(Opcode::ALL.iter().copied().map(law_costs::with));
    let variants: Vec<Variant> = laws.map(|law| Variant::new(law_costs::MODULE, law, kinds)).collect();
    let tasks = tasks(variants.iter().map(Some), 1..2);
    let dof = tasks.first().map_or(1, |(_, dof)| *dof);
    let found = bounds(firmware, timing, &tasks, kinds);
    let cycles = |bound: Option<SchemeBound>| bound.map(|bound| bound.module.0);
    let found: Vec<_> = found.into_iter().map(|(_, bound)| bound.map(cycles)).collect::<Result<_, _>>()?;
    let (plain, with) = found.split_first().ok_or(CyclesError::NoTick)?;
    Ok(law_costs::lines(*plain, with, dof))
}

/// Every scheme with its minimum degrees of freedom plus `more`.
fn tasks<'a>(schemes: impl Iterator<Item = Option<&'a Variant>>, more: Range<u16>) -> Vec<Task<'a>> {
    let tasks = schemes.flat_map(|scheme| {
        let least = scheme.map_or(1, Variant::min_dof);
        more.clone().map(move |more| (scheme, least + more))
    });
    tasks.filter(|(_, dof)| *dof <= DOF_LIMIT).collect()
}

/// Indices of the worst schemes around a kind, with few degrees of freedom or extrapolated to more.
fn worst(found: &[Found<'_>], kind: KindId) -> Vec<usize> {
    let cycles = |(task, bound): &Found<'_>| match (task.0, bound) {
        (Some(variant), Ok(Some(bound))) if variant.kind() == kind => Some(bound.module.0),
        _ => None,
    };
    let (pairs, _) = found.as_chunks::<2>();
    let own = (0..).step_by(2).zip(pairs).filter_map(|(place, [one, two])| {
        let (one, two) = (cycles(one)?, cycles(two)?);
        Some((place, [one, two, two + 6 * two.saturating_sub(one)]))
    });
    let own: Vec<(usize, [u64; 3])> = own.collect();
    let most = |of: fn(&[u64; 3]) -> u64| own.iter().max_by_key(|(_, all)| of(all)).map(|(place, _)| *place);
    [most(|[one, ..]| *one), most(|[_, two, _]| *two), most(|[.., eight]| *eight)]
        .into_iter()
        .flatten()
        .collect()
}

/// Computes bounds with a thread per processor, in the order of tasks.
fn bounds<'a>(firmware: &Firmware, timing: Timing, tasks: &[Task<'a>], kinds: ModuleKinds) -> Vec<Found<'a>> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        let mut place = next.fetch_add(1, Ordering::Relaxed);
        while let Some(task @ (variant, dof)) = tasks.get(place) {
            let bound = match variant {
                Some(variant) => SchemeBound::around(variant, firmware, timing, usize::from(*dof)),
                None => SchemeBound::of_many(CONTROLLERS, kinds, firmware, timing, usize::from(*dof)),
            };
            found.push((place, (*task, bound)));
            place = next.fetch_add(1, Ordering::Relaxed);
        }
        found
    };
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    let mut found: Vec<(usize, Found<'a>)> = thread::scope(|scope| {
        let started: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        started.into_iter().flat_map(|worker| worker.join().unwrap_or_default()).collect()
    });
    found.sort_by_key(|(place, _)| *place);
    found.into_iter().map(|(_, found)| found).collect()
}

/// Cost of one more call in the engine: the slope from the fewest to the most calls, so that fixed costs stay with the tick.
fn call(bounds: &[(Task<'_>, SchemeBound)]) -> u64 {
    let slope = |dof: u16| {
        let ticks = || {
            bounds.iter().filter(|((_, other), _)| *other == dof).map(|(_, bound)| (bound.calls, bound.rest))
        };
        let (few, many) = (ticks().min()?, ticks().max()?);
        let calls = many.0.checked_sub(few.0).filter(|calls| *calls > 0)?;
        Some(many.1.saturating_sub(few.1).div_ceil(calls))
    };
    (1..=DOF_LIMIT).filter_map(slope).max().unwrap_or_default()
}

fn most(points: impl Iterator<Item = (u16, u64)>) -> Points {
    points.fold(Points::new(), |mut all, (dof, cycles)| {
        let most = all.entry(dof).or_default();
        *most = cycles.max(*most);
        all
    })
}

/// The lowest line above all points; none without points or out of range.
fn line(points: &Points) -> Option<Cost> {
    let most = points.values().copied().max()?;
    let offset = |slope: u64| {
        let offsets = points.iter().map(|(dof, cycles)| cycles.saturating_sub(slope * u64::from(*dof)));
        offsets.max().unwrap_or_default()
    };
    let sum = |slope: u64| points.keys().map(|dof| offset(slope) + slope * u64::from(*dof)).sum::<u64>();
    let slope = (0..=most).min_by_key(|slope| sum(*slope))?;
    Some(Cost::new(u16::try_from(offset(slope)).ok()?, u16::try_from(slope).ok()?))
}

#[cfg(test)]
mod tests {
    use dimsart_modules::ALL;

    use super::*;

    fn points(points: &[(u16, u64)]) -> Points {
        points.iter().copied().collect()
    }

    #[test]
    fn a_line_lies_on_points_in_a_row_and_above_all_others() {
        assert_eq!(line(&points(&[(1, 110), (2, 120), (7, 170)])), Some(Cost::new(100, 10)));
        assert_eq!(line(&points(&[(1, 50), (7, 50)])), Some(Cost::new(50, 0)));
        let bent = points(&[(1, 100), (2, 180), (3, 200), (4, 300), (5, 310), (6, 390), (7, 410)]);
        let cost = line(&bent).unwrap();
        let above = bent.iter().map(|(dof, cycles)| u64::from(cost.cycles(usize::from(*dof))) - cycles);
        assert!(above.filter(|above| *above <= 1).count() >= 2, "no lower line");
        assert_eq!((line(&points(&[])), line(&points(&[(1, 100_000)]))), (None, None));
    }

    #[test]
    fn calls_belong_to_modules() {
        let ids: Vec<KindId> = ALL.list().iter().map(|kind| kind.id).collect();
        let variants: Vec<Variant> = ids.iter().flat_map(|id| Variant::of(*id, ALL)).collect();
        let bound = |rest, calls, module| Ok(Some(SchemeBound { rest, calls, module }));
        let kinds = ids.iter().filter_map(|kind| variants.iter().find(|one| one.kind() == *kind));
        let mut found: Vec<Found<'_>> =
            kinds.map(|kind| ((Some(kind), 1), bound(500, 2, (100, 2)))).collect();
        found.push(((None, 1), bound(950, 12, (0, 0))));
        let costs = ImageCosts::above(found, &ids, ALL).unwrap();
        // (950 - 500) / 10.
        let expected = [Cost::new(500 - 2 * 45, 0)].into_iter();
        let expected = expected.chain(ALL.list().iter().map(|_| Cost::new(100 + 2 * 45, 0)));
        assert_eq!(costs, ImageCosts { lines: expected.collect(), unknown: Vec::new() });
    }

    #[test]
    fn a_kind_without_bound_or_memory_is_named_and_the_others_are_known() {
        let ids = ["PCTRL_MOD", "SIGGEN_MOD", "OTHER"].map(KindId::from_name);
        let variants: Vec<Variant> = ids.into_iter().flat_map(|id| Variant::of(id, ALL)).collect();
        let refused = Err(CyclesError::Scheme(dimsart_core::CommandError::TooManyPorts));
        let first = variants.first().unwrap();
        let tick = Ok(Some(SchemeBound { rest: 500, calls: 10, module: (0, 0) }));
        let costs =
            ImageCosts::above(vec![((Some(first), 1), refused), ((None, 1), tick)], &ids, ALL).unwrap();
        let names: Vec<&str> = costs.unknown.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["PCTRL_MOD", "SIGGEN_MOD", &KindId::from_name("OTHER").to_string()]);
        assert!(costs.unknown[0].1.contains("does not run"), "{:?}", costs.unknown[0]);
        assert!(costs.unknown[1].1.contains("or memory"), "{:?}", costs.unknown[1]);
        assert!(ImageCosts::above(Vec::new(), &[], ALL).is_err());
    }
}
