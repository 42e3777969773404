//! Simple model of transactions: lists of modules and their state.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

use std::collections::BTreeMap;

use dimsart_core::{Command, CommandError, ParameterError, TypeRef, Value, types};

use super::{MAX_INPUTS, MAX_OUTPUTS};

/// An instance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Instance {
    /// Unique number of the instance: a module that is closed and created again is a new one.
    life: u64,
    /// Inputs, outputs, words of memory, gain.
    settings: [u32; 4],
    /// By port: index of its name in all names.
    bound: [Option<TypeRef>; MAX_INPUTS + MAX_OUTPUTS],
    /// Its memory while it is plugged in.
    memory: Option<u64>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Scheme {
    pub(super) instances: BTreeMap<u8, Instance>,
    /// Modules that are plugged in.
    pub(super) order: Vec<u8>,
    place_before: Option<u8>,
}

/// State of a module.
#[derive(Debug, Clone, Default)]
struct Remembered {
    ticks: u32,
    position: usize,
    line: Vec<u32>,
}

impl Remembered {
    /// Restarts, but keeps the content of its memory.
    fn begin(&mut self) {
        (self.ticks, self.position) = (0, 0);
    }
}

#[derive(Debug, Default)]
pub(super) struct Model {
    pub(super) running: Scheme,
    draft: Option<(Scheme, bool)>,
    pub(super) is_running: bool,
    lives: u64,
    /// By instance number and memory.
    states: BTreeMap<(u64, u64), Remembered>,
}

pub(super) type Outcome = Result<(), CommandError>;

impl Instance {
    fn new(life: u64) -> Self {
        Self { life, settings: [0; 4], bound: [None; 4], memory: None }
    }

    fn counts(&self) -> (usize, usize) {
        (self.settings[0] as usize, self.settings[1] as usize)
    }

    fn reads(&self) -> Vec<TypeRef> {
        (0..self.counts().0).map(|port| self.bound[port].unwrap_or(types::SIGNAL.first())).collect()
    }

    pub(super) fn writes(&self) -> Vec<TypeRef> {
        let ports = MAX_INPUTS..MAX_INPUTS + self.counts().1;
        ports.map(|port| self.bound[port].unwrap_or(types::SIGNAL_OUT.first())).collect()
    }
}

impl Scheme {
    /// By the definition: inputs without a writer, signals with two writers, reads before the write.
    fn faults(&self) -> usize {
        let mut reads = Vec::new();
        let mut writes = vec![(0, types::POSITION.first())];
        for (place, number) in (1..).zip(&self.order) {
            let instance = &self.instances[number];
            reads.extend(instance.reads().into_iter().map(|signal| (place, signal)));
            writes.extend(instance.writes().into_iter().map(|signal| (place, signal)));
        }
        reads.push((usize::MAX, types::DES_FORCE.first()));
        let first = |signal| writes.iter().find(|(_, found)| *found == signal).map(|(place, _)| *place);
        let late = reads.iter().filter(|(place, signal)| first(*signal).is_none_or(|first| *place <= first));
        let mut signals: Vec<_> = writes.iter().map(|(_, signal)| (signal.id, signal.number)).collect();
        signals.sort_unstable();
        signals.dedup();
        late.count() + writes.len() - signals.len()
    }
}

impl Model {
    fn edited(&mut self) -> &mut Scheme {
        match &mut self.draft {
            Some((draft, _)) => draft,
            None => &mut self.running,
        }
    }

    pub(super) fn command(&mut self, command: Command) -> Outcome {
        match command {
            Command::Begin if self.draft.is_some() => Err(CommandError::TransactionOpen),
            Command::Begin => {
                self.draft = Some((self.running.clone(), false));
                Ok(())
            }
            Command::Abort => self.draft.take().map(drop).ok_or(CommandError::NoTransaction),
            Command::Commit => self.commit(),
            Command::Check => {
                let faults = self.edited().faults();
                if faults > 0 {
                    return Err(CommandError::HasFaults { faults });
                }
                match &mut self.draft {
                    Some((_, starts)) => *starts = true,
                    None if !self.is_running => self.start(),
                    None => {}
                }
                Ok(())
            }
            Command::Stop => {
                self.is_running = false;
                if let Some((_, starts)) = &mut self.draft {
                    *starts = false;
                }
                Ok(())
            }
            Command::Reset => {
                self.states.values_mut().for_each(Remembered::begin);
                Ok(())
            }
            Command::ResetModule(module) => {
                let found = self.running.instances.get(&module.number);
                let life = found.ok_or(CommandError::NotPluggedIn(module))?.life;
                let states = self.states.iter_mut().filter(|((of, _), _)| *of == life);
                states.for_each(|(_, state)| state.begin());
                Ok(())
            }
            Command::Close | Command::Init => {
                match &mut self.draft {
                    Some(draft) => *draft = (Scheme::default(), false),
                    None => (self.running, self.is_running) = (Scheme::default(), false),
                }
                Ok(())
            }
            change => {
                let mut changed = self.edited().clone();
                self.change(&mut changed, change)?;
                let changes_wiring =
                    matches!(change, Command::PlugIn(_) | Command::Unplug(_) | Command::CloseModule(_));
                if self.draft.is_none() && self.is_running && changes_wiring && changed.faults() > 0 {
                    // The model does not predict which of them.
                    return Err(CommandError::HasFaults { faults: changed.faults() });
                }
                *self.edited() = changed;
                Ok(())
            }
        }
    }

    fn start(&mut self) {
        self.is_running = true;
        self.states.clear();
    }

    fn commit(&mut self) -> Outcome {
        let (draft, starts) = self.draft.clone().ok_or(CommandError::NoTransaction)?;
        let faults = draft.faults();
        if (self.is_running || starts) && faults > 0 {
            return Err(CommandError::HasFaults { faults });
        }
        (self.running, self.draft) = (draft, None);
        if starts && !self.is_running {
            self.start();
        }
        Ok(())
    }

    fn change(&mut self, scheme: &mut Scheme, change: Command) -> Outcome {
        let (Command::PlugIn(module)
        | Command::InitModule(module)
        | Command::Set { module, .. }
        | Command::Bind { module, .. }
        | Command::Unplug(module)
        | Command::PlaceBefore(module)
        | Command::CloseModule(module)) = change
        else {
            panic!("{change:?}")
        };
        let number = module.number;
        let place = scheme.order.iter().position(|found| *found == number);
        match change {
            Command::PlaceBefore(_) => {
                place.ok_or(CommandError::NotPluggedIn(module))?;
                scheme.place_before = Some(number);
                return Ok(());
            }
            Command::Unplug(_) | Command::CloseModule(_) => {
                let is_close = matches!(change, Command::CloseModule(_));
                if place.is_none() && (!is_close || !scheme.instances.contains_key(&number)) {
                    return Err(CommandError::NotPluggedIn(module));
                }
                if let Some(place) = place {
                    scheme.order.remove(place);
                    scheme.place_before = scheme.place_before.filter(|before| *before != number);
                }
                if is_close {
                    scheme.instances.remove(&number);
                } else {
                    scheme.instances.get_mut(&number).unwrap().memory = None;
                }
                return Ok(());
            }
            _ => {}
        }
        self.lives += 1;
        let life = self.lives;
        let instance = scheme.instances.entry(number).or_insert_with(|| Instance::new(life));
        let is_free = if place.is_some() { Err(CommandError::PluggedIn(module)) } else { Ok(()) };
        match change {
            Command::PlugIn(_) => {
                is_free?;
                // It continues with its memory in the running scheme if all its ports are the same.
                let there = self.running.instances.get(&number).filter(|there| there.life == instance.life);
                let kept = there.filter(|there| there.settings[..3] == instance.settings[..3]);
                instance.memory = Some(kept.and_then(|there| there.memory).unwrap_or(life));
                let before = scheme.place_before.take();
                let place = before.and_then(|before| scheme.order.iter().position(|found| *found == before));
                scheme.order.insert(place.unwrap_or(scheme.order.len()), number);
            }
            Command::InitModule(_) => {
                is_free?;
                *instance = Instance { life: instance.life, ..Instance::new(0) };
            }
            Command::Set { parameter, value: Value::Count(value), .. } => {
                if parameter < 3 && place.is_some() {
                    return Err(CommandError::Parameter(ParameterError::WhilePluggedIn));
                }
                instance.settings[usize::from(parameter)] = value;
            }
            Command::Bind { port, signal, .. } => {
                is_free?;
                let (inputs, outputs) = instance.counts();
                let port = usize::from(port);
                let name = if port < inputs {
                    port
                } else if port < inputs + outputs {
                    MAX_INPUTS + port - inputs
                } else {
                    return Err(CommandError::UnknownPort(u8::try_from(port).unwrap()));
                };
                instance.bound[name] = Some(signal);
            }
            _ => panic!("{change:?}"),
        }
        Ok(())
    }

    /// Every signal after a tick, and the commands.
    pub(super) fn tick(&mut self, measured: u32) -> BTreeMap<(u16, u8), u32> {
        let key = |signal: &TypeRef| (signal.id, signal.number);
        let mut signals = BTreeMap::from([(key(&types::POSITION.first()), measured)]);
        let mut states = BTreeMap::new();
        for number in &self.running.order {
            let instance = &self.running.instances[number];
            let of = (instance.life, instance.memory.unwrap());
            let mut state = self.states.remove(&of).unwrap_or_default();
            let words = instance.settings[2] as usize;
            state.line.resize(words, 0);
            let read: u32 = instance.reads().iter().map(|signal| signals[&key(signal)]).sum();
            let old = if words == 0 { 0 } else { std::mem::replace(&mut state.line[state.position], read) };
            for (place, signal) in (0..).zip(instance.writes()) {
                let sum = (instance.settings[3] + read + old + state.ticks + place) % 65_536;
                signals.insert(key(&signal), sum);
            }
            state.ticks += 1;
            state.position = if words == 0 { 0 } else { (state.position + 1) % words };
            states.insert(of, state);
        }
        // A module that is not plugged in has no state to restore.
        self.states = states;
        signals
    }
}
