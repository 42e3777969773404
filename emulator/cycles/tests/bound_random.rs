//! Bounds of random programs: no run exceeds the bounds of cycles and stack.

mod program;

use std::collections::BTreeSet;

use cycles::bound::{Bound, BoundRequest, Call, Snapshot};
use cycles::instruction::{Arithmetic, Condition, Offset, Operand, Operation, Register, Shift, Width};
use program::{CODE, Program, RAM, arithmetic, number};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

const MAX: u32 = 15;
/// Register that points to eight words of memory.
const BASE: Register = 7;
/// Scratch register within a statement.
const SCRATCH: Register = 3;
/// Loop counters, by nesting depth.
const COUNTERS: [Register; 3] = [4, 5, 6];

#[derive(Debug, Clone)]
enum Statement {
    Compute(Arithmetic, Register, Register, u32),
    Shift(Register, Register, Shift, u8),
    Divide(Register, Register),
    /// Limits a register to a maximum or minimum.
    Limit(Condition, Register, u32),
    /// Loads the word at the index in the low bits of a register.
    Load(Register, Register),
    Store(Register, Register),
    If(Condition, Register, u32, Vec<Statement>, Vec<Statement>),
    /// Repeats a fixed number of times.
    Repeat(u32, Vec<Statement>),
    /// Repeats as often as the low bits of a register, at least once.
    RepeatBy(Register, Vec<Statement>),
    /// Selects one of four by the low bits of a register.
    Choose(Register, [Vec<Statement>; 4]),
}

fn register() -> impl Strategy<Value = Register> {
    0_u8..3
}

fn condition() -> impl Strategy<Value = Condition> {
    select(vec![
        Condition::Equal,
        Condition::NotEqual,
        Condition::CarrySet,
        Condition::CarryClear,
        Condition::Minus,
        Condition::Plus,
        Condition::Higher,
        Condition::LowerOrSame,
        Condition::GreaterOrEqual,
        Condition::Less,
        Condition::Greater,
        Condition::LessOrEqual,
    ])
}

fn simple() -> impl Strategy<Value = Statement> {
    let operator = select(vec![
        Arithmetic::Add,
        Arithmetic::Subtract,
        Arithmetic::ReverseSubtract,
        Arithmetic::And,
        Arithmetic::Or,
        Arithmetic::ExclusiveOr,
        Arithmetic::BitClear,
    ]);
    let shift = select(vec![Shift::Left, Shift::LogicalRight, Shift::ArithmeticRight, Shift::RotateRight]);
    let numbers = prop_oneof![0_u32..20, select(vec![0xFF, 0xFF00, 0xFFFF_FFF0, 0x8000_0000])];
    prop_oneof![
        4 => (operator, register(), register(), numbers).prop_map(|(o, d, n, m)| Statement::Compute(o, d, n, m)),
        1 => (register(), register(), shift, 1_u8..20).prop_map(|(d, n, s, by)| Statement::Shift(d, n, s, by)),
        1 => (register(), register()).prop_map(|(d, n)| Statement::Divide(d, n)),
        2 => (condition(), register(), 0_u32..20).prop_map(|(c, n, m)| Statement::Limit(c, n, m)),
        1 => (register(), register()).prop_map(|(d, n)| Statement::Load(d, n)),
        1 => (register(), register()).prop_map(|(d, n)| Statement::Store(d, n)),
    ]
}

fn statement() -> impl Strategy<Value = Statement> {
    simple().prop_recursive(3, 24, 4, |inner| {
        let block = vec(inner, 0..4);
        prop_oneof![
            3 => (condition(), register(), 0_u32..20, block.clone(), block.clone())
                .prop_map(|(c, n, m, then, other)| Statement::If(c, n, m, then, other)),
            1 => (1_u32..4, block.clone()).prop_map(|(count, body)| Statement::Repeat(count, body)),
            1 => (register(), block.clone()).prop_map(|(n, body)| Statement::RepeatBy(n, body)),
            1 => (register(), [block.clone(), block.clone(), block.clone(), block])
                .prop_map(|(n, ways)| Statement::Choose(n, ways)),
        ]
    })
}

fn masked(n: Register, mask: u32) -> Operation {
    arithmetic(Arithmetic::And, Some(SCRATCH), n, mask)
}

fn write(mut program: Program, statements: &[Statement], depth: usize) -> Program {
    for statement in statements {
        program = write_one(program, statement, depth);
    }
    program
}

fn write_one(program: Program, statement: &Statement, depth: usize) -> Program {
    let branch = Operation::Branch { target: CODE };
    match statement {
        Statement::Compute(operator, d, n, m) => program.then([arithmetic(*operator, Some(*d), *n, *m)]),
        Statement::Shift(d, n, shift, amount) => {
            let operand = Operand::Register { register: *n, shift: *shift, amount: *amount };
            program.then([Operation::Move { d: *d, operand, inverted: false, sets_flags: true }])
        }
        Statement::Divide(d, n) => {
            program.then([Operation::Divide { d: *d, n: *d, m: *n, is_signed: false }])
        }
        Statement::Limit(condition, n, m) => program
            .then([arithmetic(Arithmetic::Subtract, None, *n, *m), Operation::IfThen { length: 1 }])
            .in_it(*condition, number(*n, *m)),
        Statement::Load(d, n) => {
            let address = program::address(BASE, Offset::Register(SCRATCH, 2));
            program.then([
                masked(*n, 7),
                Operation::Load { t: *d, address, width: Width::Word, is_signed: false },
            ])
        }
        Statement::Store(d, n) => {
            let address = program::address(BASE, Offset::Register(SCRATCH, 2));
            program.then([masked(*n, 7), Operation::Store { t: *d, address, width: Width::Word }])
        }
        Statement::If(condition, n, m, then, otherwise) => {
            let program = program.then([arithmetic(Arithmetic::Subtract, None, *n, *m)]);
            let to_then = program.here();
            let program = write(program.when(*condition, 0), otherwise, depth);
            let to_end = program.here();
            let mut program = program.then([branch]);
            program.set_target(to_then, program.here());
            let mut program = write(program, then, depth);
            program.set_target(to_end, program.here());
            program
        }
        Statement::Repeat(count, body) => match COUNTERS.get(depth) {
            Some(counter) => repeat(program.then([number(*counter, *count)]), *counter, body, depth),
            None => program,
        },
        Statement::RepeatBy(n, body) => match COUNTERS.get(depth) {
            Some(counter) => {
                let start = arithmetic(Arithmetic::And, Some(*counter), *n, 3);
                repeat(program.then([start]), *counter, body, depth)
            }
            None => program,
        },
        Statement::Choose(n, ways) => {
            let mut program = program.then([masked(*n, 3)]).table(SCRATCH, [0; 4]);
            let table = program.here() - 1;
            let (mut begins, mut ends) = ([0; 4], Vec::new());
            for (begin, way) in begins.iter_mut().zip(ways) {
                *begin = program.here();
                program = write(program, way, depth);
                ends.push(program.here());
                program = program.then([branch]);
            }
            for end in ends {
                program.set_target(end, program.here());
            }
            // Skips branches that are too far away for a table.
            if begins.iter().all(|begin| 2 * (begin - table) < 256) {
                program.set_table(table, begins);
            } else {
                program.set_table(table, [table + 1; 4]);
            }
            program
        }
    }
}

fn repeat(program: Program, counter: Register, body: &[Statement], depth: usize) -> Program {
    let begin = program.here();
    write(program, body, depth + 1)
        .then([arithmetic(Arithmetic::Subtract, Some(counter), counter, 1)])
        .when(Condition::Greater, begin)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_run_takes_longer_than_the_bound(statements in vec(statement(), 1..6)) {
        let save = Operation::StoreMultiple { n: 13, registers: 0x00F0, writes_back: true, down: true };
        let load = Operation::LoadMultiple { n: 13, registers: 0x00F0, writes_back: true, down: false };
        let program = Program::new([save, number(BASE, RAM), number(2, 0)]);
        let program = write(program, &statements, 0).then([load]).returns();
        let first = program.machine();
        let mut machine = first.clone();
        let (image, timing, memory) = (program.image(), program::timing(), Snapshot::from(&machine));
        let arguments = [0..=MAX, 0..=MAX, 0..=0, 0..=0];
        let question = BoundRequest {
            image: &image,
            timing: &timing,
            memory: &memory,
            stack_top: program::STACK_TOP,
            calls: &[Call { arguments, ..Call::new(CODE, [0; 4]) }],
            marked: &BTreeSet::new(),
        };
        let once = Bound::for_one_execution(&question).unwrap().remove(0);
        let every = Bound::for_repeated_execution(&question).unwrap().remove(0);
        for a in 0..=MAX {
            for b in 0..=MAX {
                let run = first.clone().call(CODE, [a, b, 0, 0]).unwrap();
                prop_assert!(
                    run.cycles <= once.cycles,
                    "{} cycles exceed the bound of {} with {a} and {b}",
                    run.cycles,
                    once.cycles
                );
                prop_assert_eq!(run.stack_bytes, once.stack_bytes);
                // A further call, with the memory that earlier calls left.
                let run = machine.call(CODE, [a, b, 0, 0]).unwrap();
                prop_assert!(
                    run.cycles <= every.cycles,
                    "{} cycles exceed the bound of {} in repeated calls",
                    run.cycles,
                    every.cycles
                );
            }
        }
    }
}
