//! Consistency of the timing model: joining paths never makes later instructions faster.

use cycles::instruction::{
    Address, AddressMode, Arithmetic, Condition, FloatArithmetic, FloatConvert, FloatUnary, Instruction,
    Offset, Operand, Operation, Width, decode_all,
};
use cycles::timing::{Access, Caches, Column, Flash, KnownOperands, Outcome, Pipeline, Profile, Row, Timing};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

/// An instruction with its outcome.
type Step = (Instruction, Outcome, KnownOperands);

const FLASH: u32 = 0x0800_0000;
const PREFETCHING: Flash = Flash { wait_states: 5, line_bytes: 16, prefetches: true, ..Flash::STM32G4 };

/// Few registers, so that hazards are frequent.
fn register() -> impl Strategy<Value = u8> {
    select(vec![0_u8, 1, 2, 13])
}

fn float_register() -> impl Strategy<Value = u8> {
    0_u8..4
}

fn address() -> impl Strategy<Value = Address> {
    let offset = prop_oneof![
        (-8_i32..8).prop_map(Offset::Immediate),
        register().prop_map(|register| Offset::Register(register, 2))
    ];
    let mode = select(vec![
        AddressMode::Offset,
        AddressMode::Offset,
        AddressMode::Offset,
        AddressMode::PreIndexed,
        AddressMode::PostIndexed,
    ]);
    let base = prop_oneof![4 => register(), 1 => Just(15_u8)];
    (base, offset, mode).prop_map(|(base, offset, mode)| Address { base, offset, mode })
}

fn core_operation() -> impl Strategy<Value = Operation> {
    let width = select(vec![Width::Byte, Width::Half, Width::Word]);
    let operand = Operand::Immediate { value: 1, carry: None };
    prop_oneof![
        (register(), register()).prop_map(move |(d, n)| Operation::Arithmetic {
            operator: Arithmetic::Add,
            d: Some(d),
            n,
            operand,
            sets_flags: false
        }),
        (register(), register(), register(), any::<bool>())
            .prop_map(|(d, n, m, is_signed)| Operation::Divide { d, n, m, is_signed }),
        (register(), address(), width.clone()).prop_map(|(t, address, width)| Operation::Load {
            t,
            address,
            width,
            is_signed: false
        }),
        (register(), address(), width).prop_map(|(t, address, width)| Operation::Store { t, address, width }),
        (register(), 1_u16..256).prop_map(|(n, registers)| Operation::LoadMultiple {
            n,
            registers,
            writes_back: true,
            down: false
        }),
        (register(), 0_u32..4).prop_map(|(t, offset)| Operation::LoadExclusive {
            t,
            n: t,
            offset,
            width: Width::Word
        }),
        (1_u8..=4).prop_map(|length| Operation::IfThen { length }),
        register().prop_map(|n| Operation::CompareBranch { n, on_nonzero: true, target: FLASH }),
        (register(), register()).prop_map(|(n, m)| Operation::TableBranch { n, m, half: false }),
        select(vec![Operation::Hint, Operation::Barrier, Operation::ClearExclusive]),
        (register(), 0_u8..4).prop_map(|(d, special)| Operation::ReadSpecial { d, special }),
    ]
}

fn float_operation() -> impl Strategy<Value = Operation> {
    use FloatArithmetic::{Vadd, Vdiv, Vfma, Vmla, Vmul};
    let operator = select(vec![Vadd, Vmul, Vmla, Vfma, Vdiv]);
    let registers = || (float_register(), float_register(), float_register());
    prop_oneof![
        (operator, registers()).prop_map(|(operator, (d, n, m))| Operation::Float { operator, d, n, m }),
        (select(vec![FloatUnary::Vmov, FloatUnary::Vsqrt]), registers())
            .prop_map(|(operator, (d, m, _))| Operation::FloatUnary { operator, d, m }),
        registers().prop_map(|(d, m, _)| Operation::FloatConvert { kind: FloatConvert::ToSigned, d, m }),
        registers().prop_map(|(d, m, _)| Operation::FloatCompare { d, m: Some(m), quiet_signals: false }),
        (float_register(), any::<bool>(), register())
            .prop_map(|(d, is_double, base)| { Operation::FloatLoad { d, is_double, base, offset: 4 } }),
        (float_register(), any::<bool>(), register())
            .prop_map(|(d, is_double, base)| { Operation::FloatStore { d, is_double, base, offset: 4 } }),
        (register(), float_register(), 1_u8..5).prop_map(|(n, d, count)| Operation::FloatLoadMultiple {
            n,
            d,
            count,
            writes_back: true,
            down: false
        }),
        (register(), float_register()).prop_map(|(t, m)| Operation::FloatToCore { t, m }),
        register().prop_map(|t| Operation::FloatStatusRead { t }),
    ]
}

fn step() -> impl Strategy<Value = Step> {
    let operation = prop_oneof![core_operation(), float_operation()];
    let outcome = select(vec![Outcome::Done, Outcome::Done, Outcome::Done, Outcome::Taken, Outcome::Skipped]);
    let access = prop_oneof![
        Just(None),
        (0_u32..64).prop_map(|offset| Some(Access::at_address(FLASH + offset))),
        (0_u32..64).prop_map(|offset| Some(Access::at_address(0x2000_0000 + offset))),
        (0_u32..64).prop_map(|offset| Some(Access {
            min_address: FLASH,
            max_address: 0x2000_0000 + offset,
            alignment: 4
        })),
    ];
    let division = prop_oneof![Just(None), (any::<u32>(), any::<u32>()).prop_map(Some)];
    let place = (0_u32..64, any::<bool>());
    (operation, outcome, access, division, place).prop_map(
        |(operation, outcome, access, division, (place, wide))| {
            let bytes = if wide { 4 } else { 2 };
            let address = FLASH + 2 * place;
            let instruction =
                Instruction { address, bytes, condition: Condition::Always, in_it_block: false, operation };
            (instruction, outcome, KnownOperands { division, access })
        },
    )
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    // Some steps follow each other, as in a program; the others are jump targets.
    vec((step(), 0_u8..4), 0..12).prop_map(|steps| {
        let mut next = FLASH;
        let place = |(mut step, jumps): (Step, u8)| {
            if jumps > 0 {
                step.0.address = next;
            }
            next = step.0.next();
            step
        };
        steps.into_iter().map(place).collect()
    })
}

fn timings() -> impl Strategy<Value = Timing> {
    let profile =
        select(vec![Profile::ZeroWait, Profile::Flash(Flash::STM32G4), Profile::Flash(PREFETCHING)]);
    (profile, select(vec![Column::Likely, Column::Upper]))
        .prop_map(|(profile, column)| Timing::new(profile, column))
}

/// Cycles up to and including each step.
fn run(timing: &Timing, pipeline: &mut Pipeline, steps: &[Step]) -> Vec<u32> {
    let mut total = 0;
    let cycles = |(instruction, outcome, known): &Step| {
        total += timing.cycles(pipeline, instruction, *outcome, *known);
        total
    };
    steps.iter().map(cycles).collect()
}

fn at_least(slow: &[u32], fast: &[u32]) -> bool {
    slow.iter().zip(fast).all(|(slow, fast)| slow >= fast)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]

    /// When two paths merge, the later time and the joined pipeline bound both, for any following
    /// instructions.
    #[test]
    fn instructions_after_joined_paths_are_at_least_as_late_as_after_either(
        timing in timings(), a in steps(), b in steps(), then in steps()
    ) {
        let (mut after_a, mut after_b) = (Pipeline::default(), Pipeline::default());
        run(&timing, &mut after_a, &a);
        run(&timing, &mut after_b, &b);
        let joined = run(&timing, &mut after_a.join(after_b), &then);
        prop_assert_eq!(after_a.join(after_b), after_b.join(after_a));
        prop_assert_eq!(after_a.join(after_a), after_a);
        prop_assert!(at_least(&joined, &run(&timing, &mut after_a.clone(), &then)));
        prop_assert!(at_least(&joined, &run(&timing, &mut after_b.clone(), &then)));
    }

    #[test]
    fn no_path_is_slower_than_an_unknown_path(timing in timings(), a in steps(), then in steps()) {
        let mut after_a = Pipeline::default();
        run(&timing, &mut after_a, &a);
        let worst = run(&timing, &mut Pipeline::worst(), &then);
        prop_assert!(at_least(&worst, &run(&timing, &mut after_a, &then)));
    }

    #[test]
    fn less_knowledge_never_takes_fewer_cycles(timing in timings(), steps in steps()) {
        let unknown: Vec<Step> = steps.iter().map(|(i, outcome, _)| (*i, *outcome, KnownOperands::default())).collect();
        let of = |steps: &[Step]| run(&timing, &mut Pipeline::default(), steps);
        // The model itself derives accesses relative to SP or PC; wrong data for these accesses is excluded.
        let by_itself = |step: &&Step| matches!(step.0.operation,
            Operation::Load { address: Address { base: 13 | 15, .. }, .. }
            | Operation::Store { address: Address { base: 13 | 15, .. }, .. }
            | Operation::LoadMultiple { n: 13, .. } | Operation::FloatLoadMultiple { n: 13, .. }
            | Operation::FloatLoad { base: 13, .. });
        if !steps.iter().any(|step| by_itself(&step)) {
            prop_assert!(at_least(&of(&unknown), &of(&steps)));
        }
    }

    #[test]
    fn the_upper_column_is_the_greater(steps in steps()) {
        let of = |column| run(&Timing::new(Profile::ZeroWait, column), &mut Pipeline::default(), &steps);
        prop_assert!(at_least(&of(Column::Upper), &of(Column::Likely)));
    }

    #[test]
    fn caches_never_make_a_run_longer(
        prefetches in any::<bool>(), column in select(vec![Column::Likely, Column::Upper]), steps in steps()
    ) {
        let flash = Flash { prefetches, instruction_lines: 4, data_lines: 2, ..Flash::STM32G4 };
        let timing = Timing::new(Profile::Flash(flash), column);
        let (mut pipeline, mut caches, mut total) = (Pipeline::default(), Caches::default(), 0);
        let cached: Vec<u32> = steps
            .iter()
            .map(|(instruction, outcome, known)| {
                total += timing.cached_cycles(&mut pipeline, &mut caches, instruction, *outcome, *known);
                total
            })
            .collect();
        prop_assert!(at_least(&run(&timing, &mut Pipeline::default(), &steps), &cached));
    }
}

/// Regression test, found with many more cases than above: a stall of a joined path during the wait for a
/// float result must not prevent a later stall.
#[test]
fn a_stall_is_not_hidden_behind_a_float_result() {
    let decode = |halfwords: &[u16]| -> Vec<Step> {
        let bytes: Vec<u8> = halfwords.iter().flat_map(|halfword| halfword.to_le_bytes()).collect();
        let step = |instruction| (instruction, Outcome::Done, KnownOperands::default());
        decode_all(FLASH + 2, &bytes).flatten().map(step).collect()
    };
    let timing = Timing::new(Profile::ZeroWait, Column::Likely);
    // All are misaligned four-byte instructions: ADD.W before, then VMLA, VMOV and ADD.W; the third of a run
    // stalls.
    let mut before = Pipeline::default();
    run(&timing, &mut before, &decode(&[0xF101, 0x0C01]));
    let then = decode(&[0xEE00, 0x0A00, 0xEEB0, 0x0A40, 0xF101, 0x0C01]);
    let joined = run(&timing, &mut Pipeline::default().join(before), &then);
    assert_eq!(then.len(), 3);
    assert!(at_least(&joined, &run(&timing, &mut Pipeline::default(), &then)));
}

#[test]
fn every_row_names_its_source() {
    for row in Row::ALL {
        let cost = row.cost();
        assert!(
            ["TRM ", "GCC: ", "seen", "Arm "].iter().any(|source| cost.source.starts_with(source)),
            "{row:?}"
        );
    }
}
