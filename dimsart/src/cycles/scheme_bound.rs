//! Bounds of small schemes around a module kind, for all choices of its parameters.

use ::cycles::timing::Timing;
use dimsart_core::limits::{MAX_CHANNEL_TYPES, MAX_DOF, MAX_LINKS};
use dimsart_core::scheme::{ENGINE, Row, RowError};
use dimsart_core::{
    Command, CommandError, Direction, Endpoint, Finding, Format, KindId, ModuleKinds, ModuleRef, Parameter,
    ParameterError, ParameterType, PortDescription, TypeRef, Value, Vocabulary, types,
};
use dimsart_link::saved_scheme;

use super::controller::Lengths;
use super::law_costs;
use super::steady::channels;
use super::worst::Worst;
use super::{Controller, CyclesError, Firmware};
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::SchemeErrorMessage;
use hil_sim::schemes::device;

/// Content of a COMM module: the maximum, with waves, the most expensive type.
const CONTENT: [TypeRef; MAX_CHANNEL_TYPES] = [
    types::CH2_WAVES.first(),
    TypeRef { number: 9, ..types::CH2_WAVES.first() },
    TypeRef { number: 9, ..types::CH1_WAVES.first() },
    TypeRef { number: 9, ..types::FORCE.first() },
];

/// Content with a type other than `f32`, whose packets are checked word by word. Not used for senders here.
const MIXED_CONTENT: [TypeRef; MAX_CHANNEL_TYPES] = {
    let [first, second, third, _] = CONTENT;
    [first, second, third, TypeRef { number: 9, ..types::LINK_LOST.first() }]
};

/// Maximum degrees of freedom of a scheme.
#[expect(clippy::cast_possible_truncation, reason = "8")]
pub(super) const DOF_LIMIT: u16 = MAX_DOF as u16;

/// Bound of a small scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SchemeBound {
    /// A tick without its modules' calls.
    pub(super) rest: u64,
    /// Module calls in a tick.
    pub(super) calls: u64,
    /// Calls of the module under test: total cycles and number.
    pub(super) module: (u64, u64),
}

/// A module kind with values of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variant {
    module: ModuleRef,
    parameters: Vec<Command>,
    /// Module kinds of the controller.
    kinds: ModuleKinds,
}

impl Variant {
    /// Returns all combinations of choices and switches; numbers at their default and at another value, separately for
    /// structural and other parameters.
    pub(super) fn of(kind: KindId, kinds: ModuleKinds) -> Vec<Self> {
        let module = ModuleRef { kind, number: 1 };
        if module == law_costs::MODULE {
            return vec![Self::new(module, law_costs::plain(), kinds)];
        }
        let described = |index| Some((index, kinds.describe_parameter(kind, index)?));
        let parameters: Vec<(u8, Parameter)> = (0..).map_while(described).collect();
        let mut all = Vec::new();
        for (structural, others) in [(false, false), (true, false), (false, true), (true, true)] {
            let mut sets = vec![Vec::new()];
            for (index, parameter) in &parameters {
                let values = values(parameter, if parameter.is_structural { structural } else { others });
                let with = |set: &Vec<Command>, given: &[Value]| {
                    let given = given.iter().map(|value| Command::set(module, *index, *value));
                    set.iter().copied().chain(given).collect()
                };
                sets = sets.iter().flat_map(|set| values.iter().map(move |given| with(set, given))).collect();
            }
            for parameters in sets {
                let variant = Self::new(module, parameters, kinds);
                if !all.contains(&variant) {
                    all.push(variant);
                }
            }
        }
        all
    }

    /// Its kind.
    pub(super) fn kind(&self) -> KindId {
        self.module.kind
    }

    /// A module that gets these commands before it is plugged in.
    pub(super) fn new(module: ModuleRef, parameters: Vec<Command>, kinds: ModuleKinds) -> Self {
        Self { module, parameters, kinds }
    }

    /// Minimum degrees of freedom of its kind.
    pub(super) fn min_dof(&self) -> u16 {
        let takes = |dof: &u16| {
            let plugged_in = Scheme::new(self.module, usize::from(*dof), self.kinds)
                .map(|mut scheme| scheme.dimsart.command(Command::PlugIn(self.module)));
            !matches!(plugged_in, Ok(Err(CommandError::Parameter(ParameterError::NoSuchEntry))))
        };
        (1..=DOF_LIMIT).find(takes).unwrap_or(1)
    }
}

/// Sets of values to give to a parameter.
fn values(parameter: &Parameter, takes_other: bool) -> Vec<Vec<Value>> {
    match parameter.accepts {
        ParameterType::Flag => [false, true].map(|flag| vec![Value::Flag(flag)]).into(),
        ParameterType::Choice(names) => {
            (0..).zip(names).map(|(index, _)| vec![Value::Choice(index)]).collect()
        }
        ParameterType::Types => {
            [CONTENT, MIXED_CONTENT].map(|content| content.map(Value::Type).into()).into()
        }
        ParameterType::Count { max, .. } => match parameter.default {
            Some(Value::Count(default)) if takes_other => vec![vec![Value::Count(max.min(default + 3))]],
            _ => vec![Vec::new()],
        },
        ParameterType::Integer { min, max } if takes_other => {
            vec![vec![Value::Integer(min + (max / 4 - min / 4))]]
        }
        ParameterType::Integer { .. } => vec![Vec::new()],
        ParameterType::Real { min, max } if takes_other => vec![vec![Value::Real(min + 0.25 * (max - min))]],
        ParameterType::Real { .. } => vec![Vec::new()],
    }
}

impl SchemeBound {
    /// Bounds the smallest scheme around a module kind; none if the module refuses the values, or the image the scheme, for
    /// example for lack of memory.
    ///
    /// Missing inputs come from generators, whose values are unknown in a bound; one input other than `f32` can come over a
    /// link.
    ///
    /// # Errors
    /// [`CyclesError`] if there is no such scheme or no bound.
    pub(super) fn around(
        variant: &Variant,
        firmware: &Firmware,
        timing: Timing,
        dof: usize,
    ) -> Result<Option<Self>, CyclesError> {
        let Some(mut scheme) = Scheme::around(variant, dof)? else { return Ok(None) };
        scheme.bound(firmware, timing, dof)
    }

    /// Bounds a scheme with `count` P controllers; none if the image refuses it.
    ///
    /// # Errors
    /// [`CyclesError`] if there is no bound.
    pub(super) fn of_many(
        count: u8,
        kinds: ModuleKinds,
        firmware: &Firmware,
        timing: Timing,
        dof: usize,
    ) -> Result<Option<Self>, CyclesError> {
        let mut scheme = Scheme::new(named("PCTRL_MOD"), dof, kinds)?;
        for number in 1..=count {
            scheme.plug_in_controller(number)?;
        }
        scheme.start()?;
        scheme.bound(firmware, timing, dof)
    }
}

/// A scheme under construction.
struct Scheme {
    dimsart: Box<SimulatedDimsart>,
    module: ModuleRef,
}

impl Scheme {
    fn new(module: ModuleRef, dof: usize, kinds: ModuleKinds) -> Result<Self, CyclesError> {
        let device = device("master", dof, SAMPLE_PERIOD_S)?;
        let dimsart =
            SimulatedDimsart::new(device, kinds).map_err(|error| CyclesError::Scheme(error.into()))?;
        Ok(Self { dimsart: Box::new(dimsart), module })
    }

    fn around(variant: &Variant, dof: usize) -> Result<Option<Self>, CyclesError> {
        let module = variant.module;
        let mut scheme = Self::new(module, dof, variant.kinds)?;
        if variant.parameters.iter().any(|command| scheme.dimsart.command(*command).is_err()) {
            return Ok(None);
        }
        // Alone first, to find missing inputs.
        scheme.give(Command::PlugIn(module))?;
        let missing = scheme.missing();
        scheme.give(Command::Unplug(module))?;
        for (number, (signal, is_for_frame)) in (OTHER..).zip(missing) {
            let is_generated =
                scheme.dimsart.engine().type_of(signal).is_some_and(|found| found.format == Format::F32);
            let renamed = if is_for_frame { signal } else { scheme.rename(signal, number)? };
            let name = scheme.dimsart.engine().signal_name(renamed).to_string();
            if is_generated {
                let generator = format!("SIGGEN_MOD.{number}");
                scheme.row(&generator, "FORM", "SINE")?;
                scheme.row(&generator, "AMPLITUDE", "1")?;
                scheme.row(&generator, "PORT_SIGNAL_OUT", &name)?;
                scheme.row(ENGINE, "MOD_ON", &generator)?;
            } else if renamed != signal {
                scheme.row("COMM_RXMOD", "CRX_ADD_DATA", &name)?;
                scheme.row(ENGINE, "MOD_ON", "COMM_RXMOD")?;
            } else {
                return Ok(None);
            }
        }
        scheme.give(Command::PlugIn(module))?;
        // Move writers of last-tick values after the module.
        let report = scheme.dimsart.engine().check();
        for finding in report.findings() {
            if let Finding::MissingDelay { writer, .. } = *finding {
                scheme.give(Command::Unplug(writer))?;
                scheme.give(Command::PlugIn(writer))?;
            }
        }
        scheme.start()?;
        Ok(Some(scheme))
    }

    /// Signals without a provider, and whether the frame reads them.
    fn missing(&self) -> Vec<(TypeRef, bool)> {
        let mut missing: Vec<(TypeRef, bool)> = Vec::new();
        for finding in self.dimsart.engine().check().findings() {
            let Finding::NoWriter { signal, reader } = *finding else { continue };
            let is_for_frame = reader == Endpoint::Frame;
            match missing.iter_mut().find(|(known, _)| *known == signal) {
                Some((_, is_known_for_frame)) => *is_known_for_frame |= is_for_frame,
                None => missing.push((signal, is_for_frame)),
            }
        }
        missing
    }

    /// Binds the module's ports to a signal with another number, since a board may provide the original. Returns the signal
    /// itself if the module gets it by a parameter.
    fn rename(&mut self, signal: TypeRef, number: u8) -> Result<TypeRef, CyclesError> {
        let (module, known) = (self.module, self.dimsart.engine());
        let reads =
            |port: &PortDescription<'_>| port.bound == Some(signal) && port.direction == Direction::Read;
        let ports = (0..).zip(known.port_texts(module)).filter(|(_, port)| reads(port));
        let ports: Vec<u8> = ports.map(|(port, _)| port).collect();
        let other = TypeRef { number, ..signal };
        for port in &ports {
            self.give(Command::Bind { module, port: *port, signal: other })?;
        }
        Ok(if ports.is_empty() { signal } else { other })
    }

    /// Plugs in a P controller that holds the position.
    fn plug_in_controller(&mut self, number: u8) -> Result<(), CyclesError> {
        let module = format!("PCTRL_MOD.{number}");
        self.row(&module, "PORT_DES_POSITION", "POSITION")?;
        self.row(&module, "PORT_DES_FORCE", &format!("DES_FORCE.{number}"))?;
        self.row(ENGINE, "MOD_ON", &module)
    }

    fn row(&mut self, module: &str, command: &str, value: &str) -> Result<(), CyclesError> {
        let words = ["all", module, command, value];
        let given = Row::from_words(&words).apply(&mut self.dimsart);
        given.map_err(|error| match error.problem {
            RowError::Refused(error) => CyclesError::Scheme(error),
            _ => {
                let reason = SchemeErrorMessage { error, known: self.dimsart.engine() }.to_string();
                CyclesError::Row { row: words.join(" "), reason }
            }
        })
    }

    fn give(&mut self, command: Command) -> Result<(), CyclesError> {
        self.dimsart.command(command).map_err(CyclesError::Scheme)
    }

    fn start(&mut self) -> Result<(), CyclesError> {
        self.give(Command::Check)
    }

    /// Channels of the links that the scheme reads.
    fn channels(&mut self) -> [Option<u16>; MAX_LINKS] {
        let receiver = named("COMM_RXMOD");
        let engine = self.dimsart.engine_mut();
        let link = engine.kinds().parameter(receiver.kind, "CRX_LINK");
        let link = link.and_then(|link| engine.get(receiver, link, 0).ok());
        let mut channels = channels(&self.dimsart).map(Some);
        for (number, channel) in (0..).zip(&mut channels) {
            *channel = channel.filter(|_| link == Some(Value::Count(number)));
        }
        channels
    }

    fn bound(
        &mut self,
        firmware: &Firmware,
        timing: Timing,
        dof: usize,
    ) -> Result<Option<SchemeBound>, CyclesError> {
        let engine = self.dimsart.engine_mut();
        let scheme = saved_scheme::save(engine).map_err(|_| CyclesError::SchemeTooLong)?;
        let steps: Vec<ModuleRef> = engine.steps().map(|step| step.module).collect();
        let channels = self.channels();
        let mut controller = Controller::new(firmware, timing, dof)?;
        match controller.load(&scheme) {
            Err(CyclesError::Refused { .. }) => return Ok(None),
            loaded => loaded?,
        };
        let worst = |lengths| Worst::of_ticks(firmware, &timing, &controller, channels, lengths);
        let worst = worst(Lengths::Combined).or_else(|_| worst(Lengths::PerLength))?;
        if worst.calls.len() != steps.len() {
            return Err(CyclesError::Calls { tick: 0, expected: steps.len(), found: worst.calls.len() });
        }
        let all: u64 = worst.calls.iter().map(|call| call.cycles).sum();
        let own = steps.iter().zip(&worst.calls).filter(|(step, _)| **step == self.module);
        let module = own.fold((0, 0), |(cycles, calls), (_, call)| (cycles + call.cycles, calls + 1));
        let rest = worst.tick.cycles.saturating_sub(all);
        Ok(Some(SchemeBound { rest, calls: steps.len() as u64, module }))
    }
}

/// First number of helper modules.
const OTHER: u8 = 91;
const SAMPLE_PERIOD_S: f64 = 1e-3;

fn named(name: &str) -> ModuleRef {
    ModuleRef::new(name, 1)
}

#[cfg(test)]
mod tests {
    use dimsart_modules::ALL;

    use super::*;

    #[test]
    fn every_kind_has_schemes_around_it_from_the_fewest_axes_on_that_it_takes() {
        for known in ALL.list() {
            let own = Variant::of(known.id, ALL);
            let least = own.iter().map(|variant| variant.min_dof()).max().unwrap();
            for dof in [least, DOF_LIMIT].map(usize::from) {
                let schemes = own.iter().map(|variant| Scheme::around(variant, dof).unwrap());
                let count = schemes.flatten().count();
                // Counters come over a link, for every choice of causality.
                let most = if known.name == "TDPA_MOD" { own.len() } else { 1 };
                assert!(count >= most, "{} with {dof}: {count} of {}", known.name, own.len());
            }
        }
    }

    #[test]
    fn an_arm_takes_the_axes_that_it_has() {
        let least = |name| Variant::new(named(name), Vec::new(), ALL).min_dof();
        assert_eq!(["PCTRL_MOD", "PLANAR_INVERSE_MOD", "PHANTOM_INVERSE_MOD"].map(least), [1, 2, 3]);
    }
}
