//! Programs of the controller: who uses them, and what they cost.
//!
//! The engine reaches all of it through the kind that runs programs, so that an image without that kind has none of it.
//! Functions with `law` in their names call those with `program` in theirs through pointers: `boards/calls.txt` relies on it.

use super::Engine;
use crate::data_base::Block;
use crate::module::{Kind, ModuleRef};
use crate::online::{LawRefusal, LawReport, MAX_PARAMETERS, PARAMETERS, Program};
use crate::parameter::Parameters;
use crate::scheme::Command;

/// What an engine does about programs.
#[derive(Debug)]
pub(crate) struct Laws {
    change: fn(&mut Engine, Command) -> Result<(), LawRefusal>,
    report: fn(&Engine, u8) -> Option<LawReport>,
    words: fn(&Engine, u8) -> Option<&[u32]>,
    command: fn(&Engine, u8, ModuleRef, &mut u16) -> Option<Command>,
    give_defaults: fn(&mut Engine, &Kind, Block),
    parameter: fn(&Engine, &Kind, Block, &mut Parameters<'_>),
    cycles: fn(&Engine, u8) -> Option<u32>,
}

/// Of a kind that runs programs.
pub(crate) static LAWS: Laws = Laws {
    change: Engine::change_program,
    report: Engine::program_report,
    words: Engine::program_words,
    command: Engine::program_command,
    give_defaults: Engine::give_defaults_of_program,
    parameter: Engine::program_parameter,
    cycles: Engine::cycles_of_program,
};

impl Engine {
    /// None where no module can run a program.
    #[inline(never)]
    fn program_functions(&self) -> Option<&'static Laws> {
        self.kinds.laws()
    }

    /// The programs that the controller has, each with its number.
    pub fn programs(&self) -> impl Iterator<Item = (u8, Program<'_>)> {
        self.data_base.programs().all()
    }

    /// The words of the program of this number; none where there is none, or no module can run one.
    #[must_use]
    #[inline(never)]
    pub fn law_words(&self, number: u8) -> Option<&[u32]> {
        (self.program_functions()?.words)(self, number)
    }

    /// How the place for the program of this number stands; none where there is no such place.
    #[must_use]
    #[inline(never)]
    pub fn law(&self, number: u8) -> Option<LawReport> {
        (self.program_functions()?.report)(self, number)
    }

    /// Carries out what a command wants of the programs.
    #[inline(never)]
    pub(super) fn change_law(&mut self, command: Command) -> Result<(), LawRefusal> {
        let laws = self.program_functions().ok_or(LawRefusal::NoSuchNumber)?;
        (laws.change)(self, command)
    }

    /// Of the commands that keep the program of the module at a place: the first one after `skip` others, which are
    /// counted down. A module before it with the same program has them.
    #[inline(never)]
    pub(super) fn law_command(&self, place: u8, module: ModuleRef, skip: &mut u16) -> Option<Command> {
        (self.program_functions()?.command)(self, place, module, skip)
    }

    /// Gives an instance that has got another program the defaults of that one's parameters, if its kind runs programs.
    #[inline(never)]
    pub(super) fn give_defaults_of_law(&mut self, kind: &Kind, configuration: Block) {
        if let Some(laws) = self.kinds.laws().filter(|_| kind.runs_program()) {
            (laws.give_defaults)(self, kind, configuration);
        }
    }

    /// Tells a visit what the program of an instance says of the parameter that is asked for, if its kind runs programs.
    #[inline(never)]
    pub(super) fn law_parameter(&self, kind: &Kind, configuration: Block, visit: &mut Parameters<'_>) {
        if let Some(laws) = self.kinds.laws().filter(|_| kind.runs_program()) {
            (laws.parameter)(self, kind, configuration, visit);
        }
    }

    /// What the instructions of a program add to a tick, by their costs.
    #[inline(never)]
    pub(super) fn law_cycles(&self, number: u8) -> Option<u32> {
        (self.program_functions()?.cycles)(self, number)
    }

    fn program_words(&self, number: u8) -> Option<&[u32]> {
        Some(self.data_base.programs().get(number.into())?.words())
    }

    fn program_report(&self, number: u8) -> Option<LawReport> {
        let programs = self.data_base.programs();
        if number == 0 || usize::from(number) > programs.capacity() {
            return None;
        }
        let words = programs.get(number.into()).map_or(0, |program| program.words().len());
        let words = u8::try_from(words).unwrap_or(u8::MAX);
        Some(LawReport { words, is_used: self.uses_program(number), cycles: self.cycles_with_module(number) })
    }

    fn change_program(&mut self, command: Command) -> Result<(), LawRefusal> {
        match command {
            Command::PutLaw { place, words } => self.data_base.programs_mut().put(place, words),
            Command::KeepLaw { number, count } => {
                let is_used = self.uses_program(number);
                self.data_base.programs_mut().keep(number, count, is_used)?;
            }
            Command::RemoveLaw { number } if self.uses_program(number) => return Err(LawRefusal::InUse),
            Command::RemoveLaw { number } => self.data_base.programs_mut().remove(number),
            // `Engine::command` has no other command for a law.
            _ => return Err(LawRefusal::NoSuchNumber),
        }
        Ok(())
    }

    fn program_command(&self, place: u8, module: ModuleRef, skip: &mut u16) -> Option<Command> {
        let number = self.program_of_module(module);
        let program = self.data_base.programs().get(number.into())?;
        let mut before = self.modules_by_place().take(place.into());
        if before.any(|other| self.program_of_module(other) == number) {
            return None;
        }
        let words = program.words();
        let puts = words.len().div_ceil(2);
        let start = 2 * usize::from(*skip);
        let number_of = |count: usize| u8::try_from(count).unwrap_or(u8::MAX);
        match usize::from(*skip) {
            skip if skip < puts => {
                let word = |place| words.get(place).copied().unwrap_or(0);
                Some(Command::PutLaw { place: number_of(start), words: [word(start), word(start + 1)] })
            }
            skip if skip == puts => Some(Command::KeepLaw { number, count: number_of(words.len()) }),
            _ => {
                *skip = skip.saturating_sub(u16::from(number_of(puts + 1)));
                None
            }
        }
    }

    /// The program of a module in the scheme that runs; 0 for none.
    fn program_of_module(&self, module: ModuleRef) -> u8 {
        let kind = self.kind(module.kind);
        let instance = self.schemes.running().instance(module);
        kind.zip(instance).map_or(0, |(kind, instance)| self.program_of(kind, instance.configuration))
    }

    /// Whether a module has it, plugged in or not, in either scheme.
    fn uses_program(&self, number: u8) -> bool {
        let schemes = [self.schemes.running(), self.schemes.pending()];
        number != 0
            && schemes.into_iter().flat_map(|scheme| scheme.instances.iter()).any(|instance| {
                let kind = self.kind(instance.reference.kind);
                kind.is_some_and(|kind| self.program_of(kind, instance.configuration) == number)
            })
    }

    /// The program of an instance with this configuration; 0 for none.
    fn program_of(&self, kind: &Kind, configuration: Block) -> u8 {
        if !kind.runs_program() {
            return 0;
        }
        let words = self.data_base.storage().words(configuration).unwrap_or_default();
        let number = words.get(kind.settings().start).copied().unwrap_or(0);
        u8::try_from(number).unwrap_or(0)
    }

    /// Which program the parameters are of is the second word of the settings.
    fn give_defaults_of_program(&mut self, kind: &Kind, configuration: Block) {
        let number = self.program_of(kind, configuration);
        let program = self.data_base.programs().get(number.into());
        let default = |parameter| program.and_then(|program| program.parameter(parameter));
        let defaults: [f32; MAX_PARAMETERS] =
            PARAMETERS.map(|parameter| default(parameter).map_or(0.0, |found| found.default));
        let words = self.data_base.own(configuration);
        let settings = kind.settings();
        let Some(valued) = words.get(settings.start + 1) else { return };
        if valued.replace(number.into()) == u32::from(number) {
            return;
        }
        for values in words.get(settings.end..).unwrap_or_default().chunks(MAX_PARAMETERS) {
            values.iter().zip(defaults).for_each(|(value, default)| value.set(default.to_bits()));
        }
    }

    /// The first parameter of a kind that runs programs is the program's number.
    fn program_parameter(&self, kind: &Kind, configuration: Block, visit: &mut Parameters<'_>) {
        let program = self.data_base.programs().get(self.program_of(kind, configuration).into());
        let parameter = visit.asked().and_then(|parameter| parameter.checked_sub(1));
        visit.say_of_program(
            program.zip(parameter).and_then(|(program, parameter)| program.parameter(parameter)),
        );
    }

    /// What a program adds to a tick with the module that runs it; none if that is not known.
    fn cycles_with_module(&self, number: u8) -> Option<u32> {
        let kind = self.kinds().list().iter().find(|kind| kind.runs_program())?;
        let own = self.cycles_of(kind.id)?;
        Some(own.saturating_add(self.cycles_of_program(number)?))
    }

    fn cycles_of_program(&self, number: u8) -> Option<u32> {
        let (costs, program) = (self.costs?, self.data_base.programs().get(number.into())?);
        program.cycles(self.device.dof(), |opcode| costs.instruction(opcode))
    }
}
