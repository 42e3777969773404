//! Shared by the behaviour tests: a controller on a test bench, with plain numbers in and out.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

pub(crate) mod way;

use std::collections::VecDeque;

use dimsart_core::{
    AxisKind, CommandError, DataType, DeviceDescriptor, Dimsart, Direction, EVERY_TICKS, Engine, KindId,
    ModuleKinds, ModuleRef, Packet, PortSpec, ProvidedMemory, Step, TickResult, TypeRef, Usage, Value, Word,
    scheme, types,
};
use dimsart_modules::ALL;

/// Ids of all kinds of the library.
pub(crate) static IDS: [KindId; ALL.list().len()] = ALL.ids();

/// A module of the library, by the index of its kind.
pub(crate) fn module_at(place: usize, number: u8) -> ModuleRef {
    ModuleRef { kind: IDS[place], number }
}

/// Sample period of every bench, `s`.
pub(crate) const H: f32 = 1e-3;

/// The types of a device, concatenated.
pub(crate) type Types = &'static [&'static DataType];

/// A controller without a robot: the test plays the device.
pub(crate) struct Bench {
    pub(crate) dimsart: Dimsart,
}

impl Bench {
    /// A controller of `dof` linear axes for a device that measures `outputs` and is commanded by `inputs`.
    pub(crate) fn of(dof: usize, outputs: Types, inputs: Types) -> Self {
        Self::with_kinds(ALL, dof, outputs, inputs)
    }

    /// As `of`, with other module kinds.
    pub(crate) fn with_kinds(kinds: ModuleKinds, dof: usize, outputs: Types, inputs: Types) -> Self {
        let axes = vec![AxisKind::Linear; dof];
        let device = DeviceDescriptor::new("bench", &axes, H, outputs, inputs).unwrap();
        Self { dimsart: Dimsart::new(ProvidedMemory::leak_default(), device, kinds).unwrap() }
    }

    /// Executes rows `module command value`; all must be accepted.
    pub(crate) fn rows(&mut self, rows: &str) {
        let errors = self.load(rows);
        assert_eq!(errors, [""; 0], "{:?}", self.findings());
    }

    /// Executes rows and returns the errors, as `line:problem`.
    pub(crate) fn load(&mut self, rows: &str) -> Vec<String> {
        let text: String = rows.lines().map(|row| prefixed(row) + "\n").collect();
        let mut errors = Vec::new();
        scheme::load(&text, "bench", &["bench"], &mut self.dimsart, |error| {
            errors.push(format!("{}:{:?}", error.place.line, error.problem));
        });
        errors
    }

    /// Executes rows and starts the scheme.
    pub(crate) fn run(&mut self, rows: &str) {
        self.rows(rows);
        self.rows("MOD_ENG MATCHING_CHECK");
    }

    /// Executes one well-formed row and returns the engine's result.
    pub(crate) fn order(&mut self, row: &str) -> Result<(), CommandError> {
        let text = prefixed(row);
        let row = scheme::rows(&text).next().unwrap();
        let command = row.command(self.dimsart.engine_mut()).unwrap();
        self.dimsart.command(command)
    }

    /// Runs a tick that must compute, although links may be down; returns the commands.
    pub(crate) fn tick(&mut self, measured: &[f32]) -> Vec<f32> {
        let (tick, commanded) = self.try_tick(&words(measured));
        assert!(matches!(tick, TickResult::Ran | TickResult::LinkDown { .. }), "{tick:?}");
        commanded.into_iter().map(|word| f32::from_bits(word.0)).collect()
    }

    /// Runs a tick with frames of the right size.
    pub(crate) fn try_tick(&mut self, measured: &[Word]) -> (TickResult, Vec<Word>) {
        // Not zero, so that an unwritten frame is detected.
        let mut commanded = vec![Word(0xDEAD); self.dimsart.frame().input_words()];
        let tick = self.dimsart.tick(measured, &mut commanded);
        (tick, commanded)
    }

    /// Returns the words of a signal, `NAME` or `NAME.2`.
    pub(crate) fn bits(&self, name: &str) -> &[u32] {
        let engine = self.dimsart.engine();
        let signal = engine.device().signal(name).unwrap();
        engine.data_base().words(engine.data_base().slot(signal).unwrap())
    }

    /// Returns a signal of real numbers.
    pub(crate) fn signal(&self, name: &str) -> Vec<f32> {
        self.bits(name).iter().map(|word| f32::from_bits(*word)).collect()
    }

    /// Returns the texts of the matching check's findings.
    pub(crate) fn findings(&self) -> Vec<String> {
        let engine = self.dimsart.engine();
        let report = engine.check();
        report.findings().iter().map(|finding| engine.explain(*finding).to_string()).collect()
    }

    /// Returns the calls of a tick with their stages.
    pub(crate) fn steps(&self) -> Vec<String> {
        let steps = self.dimsart.engine().steps();
        steps
            .map(|step| {
                format!("{} {:?}", self.dimsart.engine().kinds().module_name(step.module), step.stage)
            })
            .collect()
    }

    /// Returns everything that a refused command must not change.
    pub(crate) fn snapshot(&mut self) -> Snapshot {
        let engine = self.dimsart.engine_mut();
        let kinds = engine.kinds().list().iter().map(|kind| kind.id);
        let modules = kinds.flat_map(|kind| (1..=17).map(move |number| ModuleRef { kind, number }));
        let mut parameters = Vec::new();
        let mut bindings = Vec::new();
        for module in modules {
            if engine.get(module, 0, 0) == Err(CommandError::NotPluggedIn(module)) {
                continue;
            }
            for index in (0..12).chain([EVERY_TICKS]) {
                parameters.extend((0..8).map(|axis| (module, index, engine.get(module, index, axis).ok())));
            }
            for port in engine.ports(module).unwrap_or_default() {
                bindings.push((module, port.name, engine.binding(module, port.name)));
            }
        }
        let signals = engine.data_base().signals();
        let signals = signals.map(|(slot, entry)| (entry.signal, engine.data_base().words(slot).to_vec()));
        Snapshot {
            usage: engine.usage(),
            is_running: engine.is_running(),
            steps: engine.steps().collect(),
            signals: signals.collect(),
            parameters,
            bindings,
        }
    }
}

/// Returns measurements for all inputs of a module kind, and the required bindings: numbered signals, which
/// only another module writes, are bound to a type of the same kind.
pub(crate) fn surroundings(module: ModuleRef) -> (Vec<&'static DataType>, Vec<(u8, TypeRef)>) {
    let none = DeviceDescriptor::new("none", &[AxisKind::Linear], H, &[], &[]).unwrap();
    surroundings_of(&Engine::new(ProvidedMemory::leak_default(), none, ALL).ports(module).unwrap())
}

/// As above, for these ports.
pub(crate) fn surroundings_of(ports: &[PortSpec]) -> (Vec<&'static DataType>, Vec<(u8, TypeRef)>) {
    let used: Vec<u16> = ports.iter().filter_map(|port| Some(port.data_type?.1.id)).collect();
    let (mut measured, mut bindings) = (Vec::new(), Vec::new());
    for (place, port) in (0..).zip(ports) {
        let Some((data_type, signal)) = port.data_type.filter(|_| port.direction == Direction::Read) else {
            continue;
        };
        let data_type = types::find_by_id(signal.id).unwrap_or(data_type);
        if signal.number == 1 {
            measured.push(data_type);
            continue;
        }
        let is_like = |other: &&DataType| {
            (other.unit, other.format, other.shape) == (data_type.unit, data_type.format, data_type.shape)
                && !used.contains(&other.id)
        };
        let like = types::ALL.iter().find(is_like).unwrap_or(types::SIGNAL);
        measured.push(like);
        bindings.push((place, like.first()));
    }
    measured.sort_by_key(|found| found.id);
    measured.dedup_by_key(|found| found.id);
    (measured, bindings)
}

/// A single module fed by the device, and its observed signal.
pub(crate) struct Alone {
    pub(crate) bench: Bench,
    pub(crate) output: &'static str,
}

impl Alone {
    pub(crate) fn new(dof: usize, inputs: Types, output: &'static str, rows: &str) -> Self {
        let mut bench = Bench::of(dof, inputs, &[]);
        bench.run(rows);
        Self { bench, output }
    }

    /// Runs a tick; returns every axis of the output.
    pub(crate) fn axes(&mut self, measured: &[f32]) -> Vec<f32> {
        self.bench.tick(measured);
        self.bench.signal(self.output)
    }

    /// Runs a tick; returns the first axis of the output.
    pub(crate) fn step(&mut self, measured: &[f32]) -> f32 {
        self.axes(measured)[0]
    }
}

/// The externally visible state of a controller at one moment.
#[derive(Debug, PartialEq)]
pub(crate) struct Snapshot {
    pub(crate) usage: Usage,
    pub(crate) is_running: bool,
    pub(crate) steps: Vec<Step>,
    pub(crate) signals: Vec<(TypeRef, Vec<u32>)>,
    pub(crate) parameters: Vec<(ModuleRef, u8, Option<Value>)>,
    pub(crate) bindings: Vec<(ModuleRef, &'static str, Option<TypeRef>)>,
}

/// One direction of a link with a constant delay in ticks.
pub(crate) struct DelayedLink {
    delay_ticks: usize,
    packets: VecDeque<(usize, Packet)>,
}

impl DelayedLink {
    pub(crate) fn new(delay_ticks: usize) -> Self {
        Self { delay_ticks, packets: VecDeque::new() }
    }

    /// Stores the packet of tick `now`.
    pub(crate) fn send(&mut self, now: usize, from: &mut Dimsart) {
        self.packets.push_back((now + self.delay_ticks, from.take_outgoing(0).unwrap()));
    }

    /// Delivers the packets that are due before tick `now`.
    pub(crate) fn deliver(&mut self, now: usize, to: &mut Dimsart) {
        while let Some((_, packet)) = self.packets.pop_front_if(|(due, _)| *due <= now) {
            to.receive(0, &packet.to_bytes()).unwrap();
        }
    }
}

/// Converts numbers to the words of a frame.
pub(crate) fn words(values: &[f32]) -> Vec<Word> {
    values.iter().map(|value| Word::from(*value)).collect()
}

/// Returns whether `found` is within `relative` of `expected`, or of 1 if that is larger.
#[track_caller]
pub(crate) fn assert_close(found: impl Into<f64>, expected: impl Into<f64>, relative: f64) {
    let (found, expected) = (found.into(), expected.into());
    let error = (found - expected).abs();
    assert!(error <= relative * expected.abs().max(1.0), "{found} should be {expected}, off by {error}");
}

fn prefixed(row: &str) -> String {
    if row.trim().is_empty() { String::new() } else { format!("all {}", row.trim()) }
}
