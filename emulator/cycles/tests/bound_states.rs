//! Bounds of repeated calls: programs with a state machine in memory and an input, compared with all states
//! that they can reach.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod program;

use std::collections::BTreeSet;

use cycles::bound::{Bound, BoundRequest, Call, Input, Snapshot};
use cycles::instruction::{Arithmetic, Condition, Offset, Operation, Register, Width};
use cycles::machine::Machine;
use program::{CODE, Program, RAM, arithmetic};
use proptest::collection::vec;
use proptest::prelude::*;

const BASE: Register = 2;
const SCRATCH: Register = 1;
/// Words of memory that form a state; the next word is the input.
const WORDS: u32 = 3;
/// Each word is less than this.
const VALUES: u32 = 3;

type State = [u32; WORDS as usize];

/// The program of a call, as a decision tree over its state.
#[derive(Debug, Clone)]
enum Tree {
    /// Tests whether a word equals a number.
    Test { word: u32, number: u32, yes: Box<Self>, no: Box<Self> },
    /// Assigns words and takes some time.
    Leaf { assigned: Vec<(u32, Source)>, work: u32 },
}

/// The new value of a word.
#[derive(Debug, Clone, Copy)]
enum Source {
    Number(u32),
    /// The value of another word.
    Word(u32),
}

fn tree() -> impl Strategy<Value = Tree> {
    let source = prop_oneof![(0..VALUES).prop_map(Source::Number), (0..=WORDS).prop_map(Source::Word)];
    let leaf = (vec((0..WORDS, source), 0..4), 0..6_u32);
    let leaf = leaf.prop_map(|(assigned, work)| Tree::Leaf { assigned, work });
    leaf.prop_recursive(5, 32, 2, |inner| {
        (0..=WORDS, 0..VALUES, inner.clone(), inner).prop_map(|(word, number, yes, no)| Tree::Test {
            word,
            number,
            yes: Box::new(yes),
            no: Box::new(no),
        })
    })
}

fn write(mut program: Program, tree: &Tree) -> Program {
    let address = |word: u32| program::address(BASE, Offset::Immediate(4 * word.cast_signed()));
    let load =
        |word| Operation::Load { t: SCRATCH, address: address(word), width: Width::Word, is_signed: false };
    match tree {
        Tree::Test { word, number, yes, no } => {
            program = program.then([load(*word), arithmetic(Arithmetic::Subtract, None, SCRATCH, *number)]);
            let branch = program.here();
            program = write(program.when(Condition::NotEqual, 0), yes);
            program.set_target(branch, program.here());
            write(program, no)
        }
        Tree::Leaf { assigned, work } => {
            for (word, source) in assigned {
                let value = match source {
                    Source::Number(number) => program::number(SCRATCH, *number),
                    Source::Word(word) => load(*word),
                };
                let store = Operation::Store { t: SCRATCH, address: address(*word), width: Width::Word };
                program = program.then([value, store]);
            }
            let work = (0..*work).map(|_| arithmetic(Arithmetic::Add, Some(SCRATCH), SCRATCH, 1));
            program.then(work).returns()
        }
    }
}

/// The bound, and the maximum cycles of a call in any reachable state.
fn bound_and_max(tree: &Tree) -> (u64, u64) {
    let program = write(Program::new([program::number(BASE, RAM)]), tree);
    let machine = program.machine();
    let (image, timing, memory) = (program.image(), program::timing(), Snapshot::from(&machine));
    let input = RAM + 4 * WORDS;
    let any = Input { addresses: input..input + 4, width: Width::Word, values: 0..=VALUES - 1 };
    let question = BoundRequest {
        image: &image,
        timing: &timing,
        memory: &memory,
        stack_top: program::STACK_TOP,
        calls: &[Call { inputs: vec![any], ..Call::new(CODE, [0; 4]) }],
        marked: &BTreeSet::new(),
    };
    let bound = Bound::for_repeated_execution(&question).unwrap().remove(0).cycles;
    let (mut found, mut waiting) = (BTreeSet::from([State::default()]), vec![State::default()]);
    let mut most = 0;
    while let Some(state) = waiting.pop() {
        for given in 0..VALUES {
            let (cycles, next) = call(machine.clone(), state, given);
            most = most.max(cycles);
            if found.insert(next) {
                waiting.push(next);
            }
        }
    }
    (bound, most)
}

/// Cycles of a call and the state after it.
fn call(mut machine: Machine, state: State, given: u32) -> (u64, State) {
    let words = state.into_iter().chain([given]);
    let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
    machine.write(RAM, &bytes).unwrap();
    let cycles = machine.call(CODE, [0; 4]).unwrap().cycles;
    let next = [0, 1, 2].map(|word| {
        let mut bytes = [0; 4];
        machine.read(RAM + 4 * word, &mut bytes).unwrap();
        u32::from_le_bytes(bytes)
    });
    (cycles, next)
}

fn test(word: u32, number: u32, yes: Tree, no: Tree) -> Tree {
    Tree::Test { word, number, yes: Box::new(yes), no: Box::new(no) }
}

fn leaf(assigned: &[(u32, u32)], work: u32) -> Tree {
    let assigned = assigned.iter().map(|(word, number)| (*word, Source::Number(*number)));
    Tree::Leaf { assigned: assigned.collect(), work }
}

#[test]
fn words_that_changed_together_once_can_change_separately() {
    // (0, 0), then (1, 2), then (0, 2), where the longest path is.
    let tree = test(0, 0, test(1, 0, leaf(&[(0, 1), (1, 2)], 0), leaf(&[], 50)), leaf(&[(0, 0)], 0));
    let (bound, most) = bound_and_max(&tree);
    assert!(most > 50 && bound >= most, "{most} cycles, bound {bound}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    #[test]
    fn no_state_takes_longer_than_the_bound(tree in tree()) {
        let (bound, most) = bound_and_max(&tree);
        prop_assert!(most <= bound, "{most} cycles exceed the bound of {bound}");
    }
}
