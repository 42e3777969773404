//! Repeats every tick of a controller on the host in the image: checks the bits, and measures cycles.

use ::cycles::machine::{Call, Run};
use ::cycles::timing::Timing;
use dimsart_core::limits::MAX_LINKS;
use dimsart_core::{Command, ModuleRef, Packet, Word};
use dimsart_link::saved_scheme::{self, SchemeBytes};

use super::controller::Lengths;
use super::figures::Row;
use super::interrupt::interrupt;
use super::random::{RandomInputs, Template};
use super::statistics::{Inputs, Statistics};
use super::steady::channels;
use super::worst::{Most, Worst};
use super::{Controller, CyclesError, Figures, Firmware, UNIT};
use hil_sim::experiment::Experiment;
use hil_sim::rig::{Station, TickTrace};
use hil_sim::rig_file::RigFile;

/// Setup of a measurement.
#[derive(Debug)]
pub struct Setup<'a> {
    /// The image.
    pub firmware: &'a Firmware,
    /// Source of the inputs.
    pub rig: &'a RigFile,
    /// Side of the controller.
    pub side: &'a str,
    /// Commands of the controller's scheme, in place of the rig's scheme.
    pub commands: Option<&'a [Command]>,
    /// Timing model.
    pub timing: Timing,
    /// Ticks with random inputs, after the rig's ticks.
    pub random_ticks: u64,
    /// Count instructions instead of cycles in the emulated run; bounds are still cycles.
    pub counts_instructions: bool,
    /// Name of the model's memory.
    pub profile: &'static str,
    /// Name of the model's column.
    pub column: &'static str,
}

/// Runs the rig on the host, and repeats every tick of one controller in the image. Calls `progress` with completed and total
/// ticks.
///
/// # Errors
/// [`CyclesError`], also if commands or packets of the image differ from the host's.
pub fn measure(setup: &Setup<'_>, mut progress: impl FnMut(u64, u64)) -> Result<Figures, CyclesError> {
    let Setup { firmware, rig: file, side, timing, .. } = setup;
    let mut experiment = Experiment::new(file)?.without_recording();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ticks = (experiment.duration_s() / file.sample_period_s).round() as u64;
    let rig = experiment.rig_mut();
    let axes = file.device(side).map_or(0, |device| device.axes.len());
    let mut controller = Controller::new(firmware, *timing, axes)?;
    let mut replay = Replay { counts_instructions: setup.counts_instructions, ..Replay::default() };
    let mut stations = rig.stations_mut().iter_mut();
    let Some(station) = stations.find(|station| station.name == *side) else {
        return Ok(replay.figures(setup, 0));
    };
    if let Some(commands) = setup.commands {
        replace_scheme(station, commands)?;
    }
    station.start_trace();
    let device = station.dimsart.engine().device().clone();
    let scheme = replay.load(station, setup, &mut controller)?;
    let loaded = controller.clone();
    let all_ticks = ticks + setup.random_ticks;
    let mut template: Option<Template> = None;
    for tick in 0..ticks {
        if tick % 256 == 0 {
            progress(tick, all_ticks);
        }
        rig.step();
        let Some(trace) = rig.stations().iter().find_map(Station::trace) else { continue };
        replay.repeat(Inputs::Scenario, tick, trace, firmware, &mut controller)?;
        let packet = trace.received.iter().find_map(|(link, channel, bytes)| {
            Some((*link, *channel, Packet::from_bytes(bytes, *channel).ok()?))
        });
        template = packet.or(template);
    }
    let mut random = RandomInputs::new(device, file.kinds, &scheme, template, file.seed)?;
    for tick in ticks..all_ticks {
        if tick % 256 == 0 {
            progress(tick, all_ticks);
        }
        let (is_new, trace) = random.tick();
        if is_new {
            controller = loaded.clone();
        }
        replay.repeat(Inputs::Random, tick, trace, firmware, &mut controller)?;
    }
    progress(all_ticks, all_ticks);
    Ok(replay.figures(setup, ticks))
}

/// Replaces the scheme of the controller on the host.
fn replace_scheme(station: &mut Station, commands: &[Command]) -> Result<(), CyclesError> {
    let (first, last) = ([Command::Close], [Command::Check]);
    for command in first.iter().chain(commands).chain(&last) {
        let refused = station.dimsart.command(*command);
        refused.map_err(|error| CyclesError::HostScheme(format!("{}: {error}", name(command))))?;
    }
    Ok(())
}

/// Statistics so far.
#[derive(Debug, Default)]
struct Replay {
    /// Index in `modules` of every call of a tick.
    steps: Vec<usize>,
    modules: Vec<(ModuleRef, Statistics)>,
    tick: Statistics,
    rest: Statistics,
    read: Statistics,
    deliver: Statistics,
    take: Statistics,
    commands: Vec<(String, Statistics, Option<Most>)>,
    instructions: u64,
    counts_instructions: bool,
    worst: Option<Worst>,
    worst_read: Option<Most>,
    no_bound: Option<String>,
}

impl Replay {
    /// Loads the scheme of the controller on the host into the image's controller.
    fn load(
        &mut self,
        station: &mut Station,
        setup: &Setup<'_>,
        controller: &mut Controller,
    ) -> Result<SchemeBytes, CyclesError> {
        let Setup { firmware, timing, .. } = setup;
        let engine = station.dimsart.engine_mut();
        for step in engine.steps() {
            let known = self.modules.iter().position(|(module, _)| *module == step.module);
            self.steps.push(known.unwrap_or(self.modules.len()));
            if known.is_none() {
                self.modules.push((step.module, Statistics::default()));
            }
        }
        let scheme = saved_scheme::save(engine).map_err(|_| CyclesError::SchemeTooLong)?;
        let given = [Command::Close].into_iter().chain(engine.rebuild_commands());
        let names: Vec<String> = given.chain([Command::Check]).map(|command| name(&command)).collect();
        let bounds = self.bounded(Worst::of_commands(firmware, timing, controller, &scheme));
        let bounds = bounds.into_iter().flatten().map(Some).chain(std::iter::repeat(None));
        let run = controller.load(&scheme)?;
        let calls = run.calls.iter().filter(|call| call.function == firmware.command);
        for ((name, call), most) in names.into_iter().zip(calls).zip(bounds) {
            let known = self.commands.iter().position(|(known, ..)| *known == name);
            let place = known.unwrap_or_else(|| {
                self.commands.push((name, Statistics::default(), most));
                self.commands.len() - 1
            });
            if let Some((_, statistics, known)) = self.commands.get_mut(place) {
                statistics.add(Inputs::Scenario, call.cycles, call.stack_bytes);
                *known = known.zip(most).map(|(known, most)| known.or(most));
            }
        }
        self.worst_read = self.bounded(Worst::of_read(firmware, timing, controller));
        let channels = channels(&station.dimsart);
        self.worst = self.bounded(Worst::of_ticks(
            firmware,
            timing,
            controller,
            channels.map(Some),
            Lengths::PerLength,
        ));
        Ok(scheme)
    }

    /// Returns the value, or notes the error.
    fn bounded<T>(&mut self, worst: Result<T, CyclesError>) -> Option<T> {
        worst.map_err(|error| self.no_bound.get_or_insert(error.to_string()).clone()).ok()
    }

    /// Repeats one tick of the controller on the host.
    fn repeat(
        &mut self,
        inputs: Inputs,
        tick: u64,
        trace: &TickTrace,
        firmware: &Firmware,
        controller: &mut Controller,
    ) -> Result<(), CyclesError> {
        for (link, channel, bytes) in &trace.received {
            let [read, deliver] = controller.receive(*link, *channel, bytes)?;
            self.read.add_run(inputs, &read);
            self.deliver.add_run(inputs, &deliver);
        }
        let run = controller.tick(&trace.measured)?;
        self.tick.add(inputs, self.counted(run.cycles, run.instructions), run.stack_bytes);
        self.instructions += run.instructions;
        let calls: Vec<&Call> =
            run.calls.iter().filter(|call| firmware.compute.contains(&call.function)).collect();
        if calls.len() != trace.module_calls.len() {
            return Err(CyclesError::Calls { tick, expected: trace.module_calls.len(), found: calls.len() });
        }
        self.add_modules(inputs, &run, trace.module_calls.iter().zip(calls));
        let commanded = controller.commands();
        if commanded != trace.commands {
            let (expected, found) = (bits(&trace.commands), bits(&commanded));
            return Err(CyclesError::Differs { tick, what: "command to the device", expected, found });
        }
        for link in 0..MAX_LINKS {
            let (take, taken) = controller.take_packet(link)?;
            self.take.add_run(inputs, &take);
            let sent = trace.sent.iter().find(|(sent, _)| *sent == link);
            if let Some((_, packet)) = sent.filter(|(_, packet)| !taken.is(packet)) {
                let (expected, found) = (format!("{packet:x?}"), format!("{taken:x?}"));
                return Err(CyclesError::Differs { tick, what: "packet", expected, found });
            }
        }
        Ok(())
    }

    fn counted(&self, cycles: u64, instructions: u64) -> u64 {
        if self.counts_instructions { instructions } else { cycles }
    }

    /// Adds the cost of each module and of the rest of a tick. Each call has its index in the scheme's steps.
    fn add_modules<'c>(
        &mut self,
        inputs: Inputs,
        run: &Run,
        calls: impl Iterator<Item = (&'c usize, &'c Call)>,
    ) {
        let mut outside = self.counted(run.cycles, run.instructions);
        let mut modules = vec![None; self.modules.len()];
        for (step, call) in calls {
            let cycles = if self.counts_instructions { call.instructions } else { call.cycles };
            outside = outside.saturating_sub(cycles);
            if let Some(module) = self.steps.get(*step).and_then(|place| modules.get_mut(*place)) {
                let (sum, stack_bytes) = module.unwrap_or_default();
                *module = Some((sum + cycles, call.stack_bytes.max(stack_bytes)));
            }
        }
        if modules.iter().any(Option::is_some) {
            self.rest.add(inputs, outside, run.stack_bytes);
        }
        for ((_, statistics), called) in self.modules.iter_mut().zip(modules) {
            if let Some((cycles, stack_bytes)) = called {
                statistics.add(inputs, cycles, stack_bytes);
            }
        }
    }

    /// Adds up the worst cases of each module's calls.
    fn by_module(&self, calls: &[Most]) -> Vec<Most> {
        let mut modules = vec![Most::default(); self.modules.len()];
        for (place, call) in self.steps.iter().zip(calls) {
            if let Some(module) = modules.get_mut(*place) {
                *module = module.then(*call);
            }
        }
        modules
    }

    fn figures(self, setup: &Setup<'_>, ticks: u64) -> Figures {
        let Setup { firmware, rig, side, timing, profile, column, .. } = setup;
        let controller = rig.controllers.iter().find(|controller| controller.name() == *side);
        let budget_cycles = firmware.budget_cycles();
        let row = |name: &str, statistics: &Statistics, most| {
            Row::new(name.to_owned(), statistics, most, budget_cycles)
        };
        let worst = self.worst.as_ref();
        let modules = worst.map(|worst| self.by_module(&worst.calls));
        let module = |(place, (module, statistics)): (usize, &(ModuleRef, Statistics))| {
            let most = modules.as_ref().and_then(|modules| modules.get(place)).copied();
            row(&rig.kinds.module_name(*module).to_string(), statistics, most)
        };
        let rest = worst.zip(modules.as_ref()).map(|(worst, modules)| {
            let inside: u64 = modules.iter().map(|module| module.cycles).sum();
            Most { cycles: worst.tick.cycles.saturating_sub(inside), ..worst.tick }
        });
        Figures {
            unit: UNIT,
            image: firmware.name.clone(),
            side: (*side).to_owned(),
            scheme: match setup.commands {
                Some(_) => "the controller's own scheme".to_owned(),
                None => controller.map(|controller| controller.scheme.clone()).unwrap_or_default(),
            },
            dof: rig.device(side).map_or(0, |device| device.axes.len()),
            ticks,
            random_ticks: setup.random_ticks,
            profile,
            column,
            clock_hz: firmware.clock_hz,
            budget_cycles,
            tick: row("tick", &self.tick, worst.map(|worst| worst.tick)),
            frame_and_engine: row("frame and engine", &self.rest, rest),
            modules: self.modules.iter().enumerate().map(module).collect(),
            steps: self.steps.clone(),
            packets: vec![
                row("read a packet", &self.read, self.worst_read),
                row("deliver a packet", &self.deliver, worst.map(|worst| worst.deliver)),
                row("take a packet to send", &self.take, worst.map(|worst| worst.take)),
            ],
            commands: self
                .commands
                .iter()
                .map(|(name, statistics, most)| row(name, statistics, *most))
                .collect(),
            interrupt: interrupt(timing, budget_cycles),
            instructions: self.instructions,
            no_bound: self.no_bound,
        }
    }
}

/// Name of a command in schemes.
fn name(command: &Command) -> String {
    let of_module = match command {
        Command::Bind { .. } => "a port's type",
        Command::UploadLaw { .. } | Command::StoreLaw { .. } => "a law",
        _ => "a parameter",
    };
    command.as_engine_command().map_or(of_module, |known| known.name).to_owned()
}

fn bits(words: &[Word]) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("{:08x}", word.0)).collect();
    words.join(" ")
}
