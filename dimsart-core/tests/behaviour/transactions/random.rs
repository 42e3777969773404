//! Random commands, in transactions and outside, against a simple model: results, errors, and every value of
//! every tick.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "numbers of a test, small by construction"
)]

mod model;

use dimsart_core::{
    Command, CommandError, Context, Declarations, Input, Memory, Module, ModuleKinds, ModuleRef, Output,
    TickResult, TypeRef, Unit, Value, types, words,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::Bench;
use model::Model;

const MAX_INPUTS: usize = 2;
const MAX_OUTPUTS: usize = 2;
const INPUT_NAMES: [&str; MAX_INPUTS] = ["IN_0", "IN_1"];
const OUTPUT_NAMES: [&str; MAX_OUTPUTS] = ["OUT_0", "OUT_1"];
/// Instances that commands name.
const NODES: u8 = 8;
/// Signals without a fixed writer, numbered from 1.
const SIGNALS: u8 = 6;

words! {
    parameters Settings {
        /// Signals that it reads.
        inputs: u32 = structural_count("INPUTS", Unit::One, 0..=2, 0),
        /// Signals that it writes.
        outputs: u32 = structural_count("OUTPUTS", Unit::One, 0..=2, 0),
        /// Words of memory.
        memory_words: u32 = structural_count("MEMORY", Unit::One, 0..=9, 0),
        /// Constant that it adds.
        gain: u32 = count("GAIN", Unit::One, 0..=1000, 0),
    }
    struct State { ticks: u32, position: u32 }
    ports Ports { in_0: Input, in_1: Input, out_0: Output, out_1: Output, memory: Memory }
}

/// Adds its inputs, its run time, and its inputs of some ticks ago.
#[derive(Debug)]
struct Node;

impl Module for Node {
    const NAME: &'static str = "NODE_MOD";
    const SUMMARY: &'static str = "Any number of ports, state and memory.";

    type Settings = Settings;
    type Gains = ();
    type State = State;
    type AxisState = ();
    type Ports = Ports;

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::default();
        for (place, name) in (0..settings.inputs).zip(INPUT_NAMES) {
            let input = declare.any_unit().input(name, types::SIGNAL);
            *[&mut ports.in_0, &mut ports.in_1][place as usize] = input;
        }
        for (place, name) in (0..settings.outputs).zip(OUTPUT_NAMES) {
            let output = declare.any_unit().output(name, types::SIGNAL_OUT);
            *[&mut ports.out_0, &mut ports.out_1][place as usize] = output;
        }
        ports.memory = declare.memory("MEMORY", settings.memory_words as usize);
        ports
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { in_0, in_1, out_0, out_1, memory } = context.ports();
        let Settings { gain, .. } = context.settings();
        let State { ticks, position } = context.state();
        let read = context.axis(in_0, 0) as u32 + context.axis(in_1, 0) as u32;
        let cell = context.memory(memory).get(position as usize);
        let old = cell.map_or(0, |cell| cell.replace(read));
        let sum = |place: u32| ((gain + read + old + ticks + place) % 65_536) as f32;
        context.set_axis(out_0, 0, sum(0));
        context.set_axis(out_1, 0, sum(1));
        let next = if cell.is_some() { (position + 1) % context.memory(memory).len() as u32 } else { 0 };
        context.set_state(State { ticks: ticks + 1, position: next });
    }
}

const KINDS: ModuleKinds = dimsart_core::kinds![Node];

fn node(number: u8) -> ModuleRef {
    ModuleRef::new(Node::NAME, number)
}

fn below(random: &mut Pcg32, bound: u32) -> u32 {
    random.next_u32() % bound
}

fn any_signal(random: &mut Pcg32) -> TypeRef {
    match below(random, 10) {
        0..4 => types::POSITION.first(),
        4..6 => types::DES_FORCE.first(),
        _ => TypeRef { number: 1 + below(random, SIGNALS.into()) as u8, ..types::SIGNAL.first() },
    }
}

fn any_command(random: &mut Pcg32) -> Command {
    let module = node(1 + below(random, NODES.into()) as u8);
    match below(random, 40) {
        0..7 => Command::PlugIn(module),
        7..11 => Command::Unplug(module),
        11..13 => Command::CloseModule(module),
        13..15 => Command::PlaceBefore(module),
        15 => Command::InitModule(module),
        16..23 => {
            let parameter = below(random, 4) as u8;
            let bound = [3, 3, 10, 1000][usize::from(parameter)];
            Command::set(module, parameter, Value::Count(below(random, bound)))
        }
        23..30 => Command::bind(module, below(random, 5) as u8, any_signal(random)),
        30 => Command::Check,
        31 => Command::ResetModule(module),
        32 => {
            if below(random, 20) > 0 {
                Command::Check
            } else {
                Command::Stop
            }
        }
        33 => {
            if below(random, 20) > 0 {
                Command::Begin
            } else {
                Command::Close
            }
        }
        34 => {
            if below(random, 4) > 0 {
                Command::Begin
            } else {
                Command::Reset
            }
        }
        35..37 => Command::Begin,
        37 => {
            if below(random, 4) > 0 {
                Command::Commit
            } else {
                Command::Abort
            }
        }
        _ => Command::Commit,
    }
}

/// A change that leaves a valid scheme: a node that drives the device replaces all others that do.
fn exchange(random: &mut Pcg32, model: &Model) -> Vec<Command> {
    let mut commands = vec![Command::Begin];
    let driver = node(1 + below(random, NODES.into()) as u8);
    let drives = |number: &&u8| {
        let writes = model.running.instances[*number].writes();
        **number == driver.number || writes.contains(&types::DES_FORCE.first())
    };
    commands.extend(model.running.order.iter().filter(drives).map(|number| Command::Unplug(node(*number))));
    commands.extend(
        [(0, below(random, 3)), (1, 1)]
            .map(|(parameter, value)| Command::set(driver, parameter, Value::Count(value))),
    );
    let inputs = match commands[commands.len() - 2] {
        Command::Set { value: Value::Count(inputs), .. } => inputs as u8,
        _ => 0,
    };
    commands.extend((0..inputs).map(|port| Command::bind(driver, port, types::POSITION.first())));
    commands.push(Command::bind(driver, inputs, types::DES_FORCE.first()));
    commands.extend([Command::PlugIn(driver), Command::Check, Command::Commit]);
    commands
}

#[derive(Debug, Default)]
struct Counts {
    taken: u64,
    refused: u64,
    commits: u64,
    refused_commits: u64,
    ticks: u64,
}

fn compare_with_model(transactions: u64, seed: u64) -> Counts {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut bench = Bench::with_kinds(KINDS, 1, &[types::POSITION], &[types::DES_FORCE]);
    let empty = bench.dimsart.engine().usage();
    let mut model = Model::default();
    let mut counts = Counts::default();
    let mut planned = Vec::new();
    while counts.commits + counts.refused_commits < transactions {
        let command = match planned.pop() {
            Some(command) => command,
            None if below(&mut random, 12) == 0 => {
                planned = exchange(&mut random, &model);
                planned.reverse();
                continue;
            }
            None => any_command(&mut random),
        };
        let expected = model.command(command);
        let found = bench.dimsart.command(command);
        match (expected, found) {
            (Err(CommandError::HasFaults { .. }), Err(CommandError::BreaksScheme(_)))
                if !bench.dimsart.engine().is_in_transaction() => {}
            _ => assert_eq!(found, expected, "{command:?} {model:?}"),
        }
        *if found.is_ok() { &mut counts.taken } else { &mut counts.refused } += 1;
        if command == Command::Commit {
            *if found.is_ok() { &mut counts.commits } else { &mut counts.refused_commits } += 1;
        }
        let engine = bench.dimsart.engine();
        assert_eq!(engine.is_running(), model.is_running);
        let order: Vec<u8> = engine.steps().map(|step| step.module.number).collect();
        assert_eq!(order, model.running.order);
        if below(&mut random, 3) == 0 {
            let measured = below(&mut random, 1000);
            let (tick, commanded) = bench.try_tick(&crate::common::words(&[measured as f32]));
            counts.ticks += 1;
            if !model.is_running {
                assert_eq!(tick, TickResult::Idle);
                continue;
            }
            let signals = model.tick(measured);
            assert_eq!(tick, TickResult::Ran);
            let data_base = bench.dimsart.engine().data_base();
            for ((id, number), value) in &signals {
                let slot = data_base.slot(TypeRef { id: *id, number: *number }).unwrap();
                assert_eq!(data_base.words(slot), [(*value as f32).to_bits()], "{id} {number} {command:?}");
            }
            let force = signals[&(types::DES_FORCE.id, 1)];
            assert_eq!(commanded[0].0, (force as f32).to_bits());
        }
    }
    let _ = bench.dimsart.command(Command::Abort);
    bench.dimsart.command(Command::Close).unwrap();
    assert_eq!(bench.dimsart.engine().usage(), empty, "memory leak");
    counts
}

#[test]
fn a_million_random_transactions_do_what_a_plain_model_says() {
    let counts = compare_with_model(1_000_000, 1);
    assert!(
        counts.commits > 300_000 && counts.refused_commits > 50_000 && counts.refused > 1_000_000,
        "{counts:?}"
    );
    assert!(counts.ticks > 1_000_000, "{counts:?}");
}
