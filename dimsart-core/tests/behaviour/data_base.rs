//! The Data Base allocates whatever fits, refuses the rest with the sizes, and never leaks.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]
#![expect(clippy::cast_possible_truncation, reason = "numbers of a test, small by construction")]

use std::collections::BTreeMap;

use crate::common::Bench;
use dimsart_core::limits::{DEFAULT_WORDS, MAX_MODULES, MAX_SLOTS};
use dimsart_core::{
    Command, CommandError, Context, DataType, Declarations, Direction, Engine, Input, KindId, Matrix, Memory,
    Module, ModuleKinds, ModuleRef, Output, ParameterError, Parameters, PortSpec, Shape, StorageError,
    Summary, TypeRef, Unit, Value, Word, types, words,
};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

fn below(random: &mut Pcg32, bound: u32) -> u32 {
    random.next_u32() % bound
}

/// An allocation of a module: a signal that may be shared, or its own memory.
#[derive(Debug, Clone, Copy)]
enum Need {
    Signal(TypeRef, usize),
    Memory(usize),
}

/// Simple model of the Data Base.
#[derive(Default)]
struct Model {
    /// Module kinds for which the device has enough axes.
    kinds: Vec<KindId>,
    /// Users and words of each signal.
    signals: BTreeMap<(u16, u8), (u32, usize)>,
    slots: usize,
    words: usize,
    /// Module instances with their own words, and their allocations while plugged in.
    modules: Vec<(ModuleRef, usize, Option<Vec<Need>>)>,
    /// Words of an instance, by kind.
    own_words: BTreeMap<KindId, usize>,
}

impl Model {
    fn take(&mut self, need: Need) -> Result<(), StorageError> {
        let wanted = match need {
            Need::Signal(signal, words) => {
                if let Some((users, _)) = self.signals.get_mut(&(signal.id, signal.number)) {
                    *users += 1;
                    return Ok(());
                }
                words
            }
            Need::Memory(words) => words,
        };
        let free = DEFAULT_WORDS - self.words;
        if self.slots == MAX_SLOTS {
            return Err(StorageError::OutOfSlots);
        } else if wanted > free {
            return Err(StorageError::OutOfMemory { wanted, free });
        }
        if let Need::Signal(signal, words) = need {
            self.signals.insert((signal.id, signal.number), (1, words));
        }
        self.slots += 1;
        self.words += wanted;
        Ok(())
    }

    fn give_back(&mut self, need: Need) {
        let words = match need {
            Need::Memory(words) => words,
            Need::Signal(signal, words) => {
                let key = (signal.id, signal.number);
                let users = &mut self.signals.get_mut(&key).unwrap().0;
                *users -= 1;
                if *users > 0 {
                    return;
                }
                self.signals.remove(&key);
                words
            }
        };
        self.slots -= 1;
        self.words -= words;
    }

    fn take_all(&mut self, needs: &[Need]) -> Result<(), StorageError> {
        for (index, need) in needs.iter().enumerate() {
            if let Err(error) = self.take(*need) {
                needs[..index].iter().for_each(|need| self.give_back(*need));
                return Err(error);
            }
        }
        Ok(())
    }

    fn find(&self, module: ModuleRef) -> Option<usize> {
        self.modules.iter().position(|(found, ..)| *found == module)
    }

    /// Effect of a command to a module on the module's existence.
    fn bring_up(&mut self, module: ModuleRef) -> Result<usize, CommandError> {
        if let Some(index) = self.find(module) {
            return Ok(index);
        }
        if self.modules.len() == MAX_MODULES {
            return Err(CommandError::TooManyModules);
        }
        let (wanted, free) = (self.own_words[&module.kind], DEFAULT_WORDS - self.words);
        if wanted > free {
            return Err(CommandError::Storage(StorageError::OutOfMemory { wanted, free }));
        }
        self.words += wanted;
        self.modules.push((module, wanted, None));
        Ok(self.modules.len() - 1)
    }

    fn plug_in(&mut self, module: ModuleRef, needs: Vec<Need>) -> Result<(), CommandError> {
        let is_new = self.find(module).is_none();
        let index = self.bring_up(module)?;
        if self.modules[index].2.is_some() {
            return Err(CommandError::PluggedIn(module));
        }
        if let Err(error) = self.take_all(&needs) {
            if is_new {
                self.words -= self.modules.pop().unwrap().1;
            }
            return Err(CommandError::Storage(error));
        }
        self.modules[index].2 = Some(needs);
        Ok(())
    }

    fn unplug(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let index = self.find(module).ok_or(CommandError::NotPluggedIn(module))?;
        let needs = self.modules[index].2.take().ok_or(CommandError::NotPluggedIn(module))?;
        needs.iter().for_each(|need| self.give_back(*need));
        Ok(())
    }

    fn close(&mut self, module: ModuleRef) -> Result<(), CommandError> {
        let index = self.find(module).ok_or(CommandError::NotPluggedIn(module))?;
        let (_, own_words, needs) = self.modules.remove(index);
        self.words -= own_words;
        let needs = needs.unwrap_or_default();
        needs.iter().for_each(|need| self.give_back(*need));
        Ok(())
    }
}

/// Returns the allocations of a module, from its declared ports and their signals.
fn needs(engine: &mut Engine, module: ModuleRef) -> Vec<Need> {
    let dof = engine.device().dof();
    let need = |engine: &Engine, spec: &PortSpec| match (spec.data_type, spec.direction) {
        (None, Direction::Memory(words)) => Need::Memory(words),
        (None, _) => panic!("{spec:?} is neither signal nor memory"),
        (Some((_, default)), _) => {
            let signal = engine.binding(module, spec.name).unwrap_or(default);
            let shape = engine.device().data_type(signal.id).unwrap().shape;
            let words = match shape {
                Shape::Scalar => 1,
                Shape::Vector => dof,
                Shape::Matrix(rows, columns) => usize::from(rows) * usize::from(columns),
                Shape::Square => dof * dof,
            };
            Need::Signal(signal, words)
        }
    };
    let specs = engine.ports(module).unwrap();
    specs.iter().map(|spec| need(engine, spec)).collect()
}

/// Mostly an existing module, preferably of the first kinds, which have the most ports.
fn any_module(random: &mut Pcg32, model: &Model) -> ModuleRef {
    let index = below(random, MAX_MODULES as u32 + 2) as usize;
    if let Some((module, ..)) = model.modules.get(index) {
        return *module;
    }
    let kinds = if below(random, 2) == 0 { 3 } else { model.kinds.len() as u32 };
    let kind = model.kinds[below(random, kinds) as usize];
    ModuleRef { kind, number: u8::try_from(below(random, 4) + 1).unwrap() }
}

/// A parameter that changes the allocations, sometimes with a value too large to fit.
fn structural_parameter(random: &mut Pcg32, dof: usize) -> (&'static str, &'static str, Value) {
    let largest = u32::try_from(DEFAULT_WORDS / dof / 4).unwrap();
    let length = Value::Count(below(random, largest) + 1);
    let flag = Value::Flag(below(random, 2) == 0);
    let signal = Value::Type(types::ALL[below(random, 6) as usize].first());
    [
        ("TIMEDELAY_MOD", "TD_PARAM", length),
        ("RECORDER_MOD", "LENGTH", length),
        ("PDCTRL_MOD", "LAW_OUTPUT", flag),
        ("WTRANSF_MOD", "FORM", Value::Choice(u8::try_from(below(random, 3)).unwrap())),
        ("COMM_RXMOD", "CRX_ADD_DATA", signal),
        ("COMM_TXMOD", "CTX_ADD_DATA", signal),
    ][below(random, 6) as usize]
}

/// Returns whether a device has enough axes for a module of this kind.
fn has_the_axes_of(kind: KindId, dof: usize) -> bool {
    let mut bench = Bench::of(dof, &[], &[]);
    let plugged_in = bench.dimsart.command(Command::PlugIn(ModuleRef { kind, number: 1 }));
    plugged_in != Err(CommandError::Parameter(ParameterError::NoSuchEntry))
}

/// Gives the engine and the model the same random commands; returns how often an allocation failed.
fn compare_with_model(dof: usize, operations: u32, seed: u64) -> [u32; 3] {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut bench = Bench::of(dof, &[types::POSITION, types::FORCE], &[types::DES_FORCE]);
    let mut model = Model::default();
    let kinds = ALL.list().iter().map(|kind| kind.id);
    model.kinds = kinds.clone().filter(|kind| has_the_axes_of(*kind, dof)).collect();
    model.own_words = kinds.map(|kind| (kind, bench.dimsart.engine().module_words(kind).unwrap())).collect();
    for data_type in [types::POSITION, types::FORCE, types::DES_FORCE] {
        model.take(Need::Signal(data_type.first(), dof)).unwrap();
    }
    let measured: Vec<Word> = (1..=2 * dof).map(|word| Word::from(word as f32)).collect();
    bench.try_tick(&measured);
    let start = bench.dimsart.engine().usage();
    let mut refused = [0; 3];
    for operation in 0..operations {
        let module = any_module(&mut random, &model);
        let engine = bench.dimsart.engine_mut();
        match below(&mut random, 16) {
            0..8 => {
                let needs = needs(engine, module);
                let expected = model.plug_in(module, needs);
                assert_eq!(engine.command(Command::PlugIn(module)), expected, "{operation}");
                match expected {
                    Err(CommandError::TooManyModules) => refused[0] += 1,
                    Err(CommandError::Storage(StorageError::OutOfSlots)) => refused[1] += 1,
                    Err(CommandError::Storage(StorageError::OutOfMemory { .. })) => refused[2] += 1,
                    _ => {}
                }
            }
            8 => {
                let expected = model.unplug(module);
                assert_eq!(engine.command(Command::Unplug(module)), expected, "{operation}");
            }
            9 => {
                let expected = model.close(module);
                assert_eq!(engine.command(Command::CloseModule(module)), expected, "{operation}");
            }
            10..12 => {
                let (kind, name, value) = structural_parameter(&mut random, dof);
                let kind = ALL.module(kind).unwrap().kind;
                let module = ModuleRef { kind, ..module };
                let parameter = ALL.parameter(kind, name).unwrap();
                if engine.command(Command::set(module, parameter, value)).is_ok() {
                    model.bring_up(module).unwrap();
                }
            }
            _ => {
                let first = below(&mut random, types::ALL.len() as u32);
                for port in 0..10_u8 {
                    let data_type = &types::ALL[(first as usize + usize::from(port)) % types::ALL.len()];
                    let number = u8::try_from(below(&mut random, 200) + 1).unwrap();
                    let signal = TypeRef { id: data_type.id, number };
                    if engine.command(Command::bind(module, port, signal)).is_ok() {
                        model.bring_up(module).unwrap();
                    }
                }
            }
        }
        let usage = engine.usage();
        let expected = (model.modules.len(), model.slots, model.words);
        assert_eq!((usage.modules, usage.slots, usage.words), expected, "{operation}");
        let kept = [bench.bits("POSITION"), bench.bits("FORCE")].concat();
        assert!(kept.iter().eq(measured.iter().map(|word| &word.0)), "{operation}");
    }
    let engine = bench.dimsart.engine_mut();
    for (module, ..) in &model.modules {
        engine.command(Command::CloseModule(*module)).unwrap();
    }
    assert_eq!(engine.usage(), start);
    refused
}

#[test]
fn a_million_random_plug_ins_and_plug_outs_do_what_a_simple_model_says() {
    let refused = compare_with_model(3, 1_000_000, 3);
    // Every limit was reached, so refusals of each kind were tested.
    assert!(refused.iter().all(|count| *count > 0), "{refused:?}");
}

#[test]
fn random_plug_ins_and_plug_outs_do_what_the_model_says_on_any_number_of_axes() {
    for dof in [1, 2, 6, 8] {
        compare_with_model(dof, 20_000, dof as u64);
    }
}

/// Writes its stamp everywhere in its first tick, and nothing later.
#[derive(Debug)]
struct Stamper;

words! {
    parameters StamperSettings { stamp: f32, length: u32 }
    struct StamperState { has_stamped: bool }
    ports StamperPorts { memory: Memory, output: Output }
}

impl Module for Stamper {
    const NAME: &'static str = "STAMPER_MOD";
    const SUMMARY: &'static str = "Leaves a stamp in all that is its own.";

    type Settings = StamperSettings;
    type Gains = ();
    type State = StamperState;
    type AxisState = ();
    type Ports = StamperPorts;

    fn parameters(settings: &mut StamperSettings, _: &mut (), visit: &mut Parameters<'_>) {
        visit.real(&mut settings.stamp, "STAMP", Unit::One, 0.0..=1e9, 0.0, "Word to write.");
        visit.structural_count(&mut settings.length, "LENGTH", Unit::One, 0..=1000, 0, "Words of memory.");
    }

    fn ports(settings: &StamperSettings, declare: &mut Declarations<'_>) -> StamperPorts {
        StamperPorts {
            memory: declare.memory("MEMORY", usize::try_from(settings.length).unwrap()),
            output: declare.output("STAMPED", types::SIGNAL),
        }
    }

    fn compute(context: &Context<'_, Self>) {
        if !context.state().has_stamped {
            let StamperPorts { memory, output } = context.ports();
            let cells = context.memory(memory).iter().chain(context.words_out(output));
            cells.for_each(|cell| cell.set(context.settings().stamp.to_bits()));
        }
        context.set_state(StamperState { has_stamped: true });
    }
}

const STAMPERS: ModuleKinds = dimsart_core::kinds![Stamper];

#[test]
fn what_stays_plugged_in_keeps_its_contents_while_others_move() {
    let mut random = Pcg32::seed_from_u64(7);
    let mut bench = Bench::with_kinds(STAMPERS, 3, &[], &[]);
    bench.rows("MOD_ENG MATCHING_CHECK");
    let mut stamps = [None; 12];
    for operation in 1_u16..=20_000 {
        let number = u8::try_from(below(&mut random, 12) + 1).unwrap();
        let module = ModuleRef { kind: KindId::from_name(Stamper::NAME), number };
        let engine = bench.dimsart.engine_mut();
        let stamp = &mut stamps[usize::from(number) - 1];
        if stamp.is_some() {
            engine.command(Command::Unplug(module)).unwrap();
            *stamp = None;
        } else {
            let length = Value::Count(below(&mut random, 400));
            engine.command(Command::set(module, 1, length)).unwrap();
            engine.command(Command::set(module, 0, Value::Real(f32::from(operation)))).unwrap();
            engine.command(Command::bind(module, 1, TypeRef { number, ..types::SIGNAL.first() })).unwrap();
            if engine.command(Command::PlugIn(module)).is_ok() {
                assert!(engine.memory(module).unwrap().iter().all(|word| *word == 0), "{operation}");
                *stamp = Some(f32::from(operation).to_bits());
            }
        }
        bench.tick(&[]);
        for (number, stamp) in (1..).zip(stamps) {
            let Some(stamp) = stamp else { continue };
            let memory = bench
                .dimsart
                .engine()
                .memory(ModuleRef { kind: KindId::from_name(Stamper::NAME), number })
                .unwrap();
            let signal = bench.bits(&format!("SIGNAL.{number}"));
            assert!(memory.iter().chain(signal).all(|word| *word == stamp), "{operation}: {number}");
        }
    }
    assert!(stamps.iter().flatten().count() > 0);
}

const TABLE: &DataType = &DataType {
    id: 0x8000,
    name: "TABLE",
    unit: dimsart_core::Unit::One,
    format: dimsart_core::Format::F32,
    shape: dimsart_core::Shape::Matrix(2, 2),
    summary: Summary::new(""),
};

/// Accesses words outside its matrix.
#[derive(Debug)]
struct Beside;

impl Module for Beside {
    const NAME: &'static str = "BESIDE_MOD";
    const SUMMARY: &'static str = "";

    type Settings = ();
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = (Input<Matrix<2, 2>>, Output<Matrix<2, 2>>);

    fn ports(_: &(), declare: &mut Declarations<'_>) -> Self::Ports {
        let input = declare.input("IN", TABLE);
        (input, declare.output("OUT", TABLE))
    }

    fn compute(context: &Context<'_, Self>) {
        let (input, output) = context.ports();
        context.set_element(output, 0, 0, context.element(input, 0, 2));
        context.set_element(output, 0, 3, 9.0);
        context.set_element(output, usize::MAX, 1, 9.0);
    }
}

const BESIDES: ModuleKinds = dimsart_core::kinds![Beside];

#[test]
fn outside_a_matrix_there_is_nothing() {
    let mut bench = Bench::with_kinds(BESIDES, 1, &[TABLE], &[]);
    bench.run("BESIDE_MOD PORT_OUT TABLE.2\nMOD_ENG MOD_ON BESIDE_MOD");
    bench.tick(&[1.0, 2.0, 3.0, 4.0]);
    assert_eq!(bench.signal("TABLE.2"), [0.0; 4]);
}
