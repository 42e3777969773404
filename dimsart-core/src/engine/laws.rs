//! Programs of the controller: who uses them, and what they cost.

use super::Engine;
use crate::command::{Command, ModuleRef};
use crate::kind::Kind;
use crate::limits::MAX_PROGRAMS;
use crate::online::{LawParameter, LawRefusal, LawReport, MAX_PARAMETERS, PARAMETERS, Program};
use crate::storage::Block;

impl Engine {
    /// The programs that the controller has, each with its number.
    pub fn programs(&self) -> impl Iterator<Item = (u8, Program<'_>)> {
        self.data_base.programs().all()
    }

    /// How the place for the program of this number stands; none where there is no such place.
    #[must_use]
    pub fn law(&self, number: u8) -> Option<LawReport> {
        if number == 0 || usize::from(number) > MAX_PROGRAMS {
            return None;
        }
        let words = self.data_base.programs().get(number.into()).map_or(0, |program| program.words().len());
        let words = u8::try_from(words).unwrap_or(u8::MAX);
        Some(LawReport { words, is_used: self.uses_program(number), cycles: self.cycles_of_law(number) })
    }

    /// Carries out what a command wants of the programs.
    #[inline(never)]
    pub(super) fn change_law(&mut self, command: Command) -> Result<(), LawRefusal> {
        if MAX_PROGRAMS == 0 {
            return Err(LawRefusal::NoSuchNumber);
        }
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

    /// Of the commands that keep the program of the module at a place: the first one after `skip` others, which are
    /// counted down. A module before it with the same program has them.
    pub(super) fn law_command(&self, place: u8, module: ModuleRef, skip: &mut u16) -> Option<Command> {
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
        let instance = self.plans.running().instance(module);
        kind.zip(instance).map_or(0, |(kind, instance)| self.program_of(kind, instance.configuration))
    }

    /// Whether a module has it, plugged in or not, in either scheme.
    fn uses_program(&self, number: u8) -> bool {
        let plans = [self.plans.running(), self.plans.next()];
        number != 0
            && MAX_PROGRAMS != 0
            && plans.into_iter().flat_map(|plan| &plan.instances).any(|instance| {
                let kind = self.kind(instance.reference.kind);
                kind.is_some_and(|kind| self.program_of(kind, instance.configuration) == number)
            })
    }

    /// The program of an instance with this configuration; 0 for none.
    fn program_of(&self, kind: &Kind, configuration: Block) -> u8 {
        if MAX_PROGRAMS == 0 || !kind.runs_program() {
            return 0;
        }
        let words = self.data_base.storage().words(configuration).unwrap_or_default();
        let number = words.get(kind.settings().start).copied().unwrap_or(0);
        u8::try_from(number).unwrap_or(0)
    }

    /// Gives an instance that has got another program the defaults of that one's parameters. Which one they are of is
    /// the second word of its settings.
    pub(super) fn give_defaults_of_law(&mut self, kind: &Kind, configuration: Block) {
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

    /// What the program of an instance says of a parameter of its kind, of which the first one is the program's number.
    pub(super) fn law_parameter(
        &self,
        kind: &Kind,
        configuration: Block,
        parameter: Option<u8>,
    ) -> Option<LawParameter> {
        let program = self.data_base.programs().get(self.program_of(kind, configuration).into())?;
        program.parameter(parameter?.checked_sub(1)?)
    }

    /// What a program adds to a tick with the module that runs it; none if that is not known.
    fn cycles_of_law(&self, number: u8) -> Option<u32> {
        let kind = self.kinds().list().iter().find(|kind| kind.runs_program())?;
        let own = self.cycles_of(kind.id)?;
        Some(own.saturating_add(self.program_cycles(number)?))
    }

    /// What the instructions of a program add to a tick, by their costs.
    pub(super) fn program_cycles(&self, number: u8) -> Option<u32> {
        let (costs, program) = (self.costs?, self.data_base.programs().get(number.into())?);
        program.cycles(self.device.dof(), |opcode| costs.instruction(opcode))
    }
}
