//! Bounds of small programs: equal to the known worst case, never below any run, an error if no bound exists.

#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod program;

use std::collections::BTreeSet;

use cycles::AccessError;
use cycles::ExecuteError;
use cycles::bound::{Bound, BoundError, BoundRequest, Call, Input, Reason, Snapshot};
use cycles::instruction::{Arithmetic, Condition, LR, Offset, Operation, PC, SP, Width};
use program::{CODE, Program, RAM, at};

/// Both arguments of every program range from 0 to this value.
const MAX: u32 = 15;

fn bound(program: &Program) -> Result<Bound, BoundError> {
    bound_of(program, 0..=MAX, &[])
}

fn bound_of(
    program: &Program,
    argument: std::ops::RangeInclusive<u32>,
    inputs: &[Input],
) -> Result<Bound, BoundError> {
    let image = program.image();
    let marked = BTreeSet::from_iter(program.functions());
    let call = Call {
        arguments: [argument.clone(), argument, 0..=0, 0..=0],
        inputs: inputs.to_vec(),
        ..Call::new(CODE, [0; 4])
    };
    let question = BoundRequest {
        image: &image,
        timing: &program::timing(),
        memory: &Snapshot::from(&program.machine()),
        stack_top: program::STACK_TOP,
        calls: &[call],
        marked: &marked,
    };
    Bound::for_one_execution(&question).map(|mut bounds| bounds.remove(0))
}

/// Maximum cycles and stack bytes over all arguments.
fn longest_run(program: &Program) -> (u64, u32) {
    let machine = program.machine();
    let arguments = (0..=MAX).flat_map(|a| (0..=MAX).map(move |b| [a, b, 0, 0]));
    let runs = arguments.map(|arguments| {
        let run = machine.clone().call(CODE, arguments).unwrap();
        (run.cycles, run.stack_bytes)
    });
    runs.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1))).unwrap()
}

/// Asserts that the bound equals the longest run.
fn assert_exact(program: &Program) {
    let bound = bound(program).unwrap();
    assert_eq!((bound.cycles, bound.stack_bytes), longest_run(program));
}

fn reason(program: &Program) -> Reason {
    bound(program).unwrap_err().reason
}

fn compare(n: u8, number: u32) -> Operation {
    program::arithmetic(Arithmetic::Subtract, None, n, number)
}

fn add(d: u8, number: u32) -> Operation {
    program::arithmetic(Arithmetic::Add, Some(d), d, number)
}

fn subtract(d: u8, number: u32) -> Operation {
    program::arithmetic(Arithmetic::Subtract, Some(d), d, number)
}

fn divide(d: u8) -> Operation {
    Operation::Divide { d, n: d, m: d, is_signed: false }
}

#[test]
fn the_longer_of_two_paths_counts() {
    let program = Program::new([compare(0, 5)])
        .when(Condition::CarryClear, 4)
        .then([divide(1), Operation::Branch { target: at(5) }, add(1, 1)])
        .returns();
    assert_exact(&program);
    let longer = bound(&program).unwrap().cycles;
    let fixed = bound_of(&program, 0..=4, &[]).unwrap().cycles;
    assert!(fixed < longer, "{fixed} of {longer}");
}

#[test]
fn nested_loops_count_every_iteration() {
    // r2 = 5; do { r3 = 3; do {} while --r3; } while --r2
    let program = Program::new([program::number(2, 5), program::number(3, 3), subtract(3, 1)])
        .when(Condition::NotEqual, 2)
        .then([subtract(2, 1)])
        .when(Condition::NotEqual, 1)
        .returns();
    assert_exact(&program);
    let inner = bound(&program).unwrap().path.iter().filter(|(block, _)| *block == at(2)).count();
    assert!(inner >= 10, "{inner} iterations of the inner loop");
}

#[test]
fn a_data_dependent_loop_counts_its_maximum_iterations() {
    // do { r0 -= 1 } while r0 >= 0, signed
    let program = Program::new([subtract(0, 1)]).when(Condition::Plus, 0).returns();
    assert_exact(&program);
    let fifteen = bound(&program).unwrap();
    let three = bound_of(&program, 0..=3, &[]).unwrap();
    assert!(three.cycles < fifteen.cycles);
}

#[test]
fn a_minimum_bounds_the_loop_after_it() {
    // r0 = min(r0, 3); do {} while --r0 >= 0
    let program = Program::new([compare(0, 3), Operation::IfThen { length: 1 }])
        .in_it(Condition::CarrySet, program::number(0, 3))
        .then([subtract(0, 1)])
        .when(Condition::Plus, 3)
        .returns();
    assert_exact(&program);
    let any = bound_of(&program, 0..=u32::MAX, &[]).unwrap();
    assert_eq!(any.cycles, bound(&program).unwrap().cycles);
}

#[test]
fn an_it_block_is_executed_or_skipped() {
    let it = |condition| {
        Program::new([compare(0, 20), Operation::IfThen { length: 2 }])
            .in_it(condition, divide(1))
            .in_it(condition, add(1, 1))
            .returns()
    };
    // Never executed for arguments up to 15, and always executed.
    assert_exact(&it(Condition::Higher));
    assert_exact(&it(Condition::LowerOrSame));
    let [never, always] =
        [Condition::Higher, Condition::LowerOrSame].map(|condition| bound(&it(condition)).unwrap());
    assert!(never.cycles < always.cycles);
}

#[test]
fn a_table_branch_takes_every_possible_entry() {
    let table = |mask| {
        Program::new([program::arithmetic(Arithmetic::And, Some(0), 0, mask)])
            .table(0, [4, 5, 6, 7])
            .then([Operation::Hint, add(1, 1), divide(1), add(1, 1)])
            .returns()
    };
    assert_exact(&table(3));
    assert_exact(&table(1));
    let [all, two] = [3, 1].map(|mask| bound(&table(mask)).unwrap());
    assert!(all.visited.contains(&at(4)) && all.visited.is_superset(&two.visited));
}

#[test]
fn calls_and_tail_calls_return_to_their_callers() {
    // `main` saves LR and calls the first function, which tail-calls the second function.
    let save = Operation::StoreMultiple { n: SP, registers: 1 << LR | 1 << 4, writes_back: true, down: true };
    let load = Operation::LoadMultiple { n: SP, registers: 1 << PC | 1 << 4, writes_back: true, down: false };
    // The first instruction absorbs the unknown pipeline state before the call.
    let calls = [5, 7].map(|number| Operation::BranchLink { target: at(number) });
    let program = Program::new([Operation::Hint, save])
        .then(calls)
        .then([load])
        .function()
        .then([divide(1), Operation::Branch { target: at(7) }])
        .function()
        .then([subtract(SP, 16), add(SP, 16)])
        .returns();
    assert_exact(&program);
    let bound = bound(&program).unwrap();
    let functions: Vec<u32> = bound.calls.iter().map(|call| call.function).collect();
    assert_eq!(functions, [at(5), at(7), at(7)]);
    let [first, second, third] = bound.calls.as_slice() else { panic!("three calls") };
    assert!(first.cycles > second.cycles && second.stack_bytes == 16 && third.stack_bytes == 16);
    assert_eq!(bound.stack_bytes, 24);
}

#[test]
fn state_left_by_one_call_affects_the_bound_of_the_next() {
    // A counter in memory counts from 0 to 9 and restarts; each call runs as many loop iterations as the
    // counter.
    let store =
        Operation::Store { t: 1, address: program::address(2, Offset::Immediate(0)), width: Width::Word };
    let load = Operation::Load {
        t: 1,
        address: program::address(2, Offset::Immediate(0)),
        width: Width::Word,
        is_signed: false,
    };
    let program = Program::new([
        program::number(2, RAM),
        load,
        add(1, 1),
        compare(1, 10),
        Operation::IfThen { length: 1 },
    ])
    .in_it(Condition::CarrySet, program::number(1, 0))
    .then([store, add(1, 1), subtract(1, 1)])
    .when(Condition::NotEqual, 8)
    .returns();
    let image = program.image();
    let mut machine = program.machine();
    let snapshot = Snapshot::from(&machine);
    let question = BoundRequest {
        image: &image,
        timing: &program::timing(),
        memory: &snapshot,
        stack_top: program::STACK_TOP,
        calls: &[Call::new(CODE, [0; 4])],
        marked: &BTreeSet::new(),
    };
    let once = Bound::for_one_execution(&question).unwrap().remove(0);
    let every = Bound::for_repeated_execution(&question).unwrap().remove(0);
    let runs: Vec<u64> = (0..30).map(|_| machine.call(CODE, [0; 4]).unwrap().cycles).collect();
    assert_eq!(once.cycles, runs[0]);
    assert_eq!(Some(&every.cycles), runs.iter().max());
    assert_eq!(every.unknown, [(RAM, 0, 9)]);
}

#[test]
fn an_undecidable_program_is_an_error_with_the_location() {
    let endless = Program::new([Operation::Hint, Operation::Branch { target: at(1) }]);
    assert!(matches!(reason(&endless), Reason::Unbounded { .. }));
    assert!(bound(&endless).unwrap_err().place.contains("main"));

    let recursion = Program::new([Operation::BranchLink { target: CODE }]).returns();
    assert!(matches!(reason(&recursion), Reason::Recursion { function: CODE }));

    let load = Operation::Load {
        t: 3,
        address: program::address(2, Offset::Immediate(0)),
        width: Width::Word,
        is_signed: false,
    };
    let call = Operation::BranchLinkRegister { m: 3 };
    let somewhere = Program::new([program::number(2, RAM), load, call]).returns();
    let error = bound_of(&somewhere, 0..=0, &[Input::words(RAM..RAM + 4)]).unwrap_err();
    assert!(matches!(error.reason, Reason::UnknownTarget { .. }), "{error}");

    let store =
        Operation::Store { t: 0, address: program::address(0, Offset::Immediate(0)), width: Width::Word };
    let anywhere = bound_of(&Program::new([store]).returns(), 0..=u32::MAX, &[]).unwrap_err().reason;
    assert!(
        matches!(anywhere, Reason::Execute(ExecuteError::Access(AccessError::Unknown { .. }))),
        "{anywhere}"
    );

    let trap =
        Program::new([compare(0, 3)]).when(Condition::Equal, 3).returns().then([Operation::Undefined(0)]);
    assert_eq!(reason(&trap), Reason::Trap);
    let no_code = Program::new([Operation::Branch { target: CODE + 0x1000 }]);
    assert_eq!(reason(&no_code), Reason::NoCode);
}
