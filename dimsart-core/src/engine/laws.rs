//! Programs of the controller: use, storage and cost.
//!
//! The engine accesses all of this through the kind that runs programs, so that an image without that kind
//! does not contain it. Functions with `law` in their names call those with `program` in theirs through
//! pointers; `boards/calls.txt` relies on this.

use super::Engine;
use crate::data_base::Block;
use crate::module::{ModuleKind, ModuleRef};
use crate::online::{LawRefusal, LawReport, MAX_PARAMETERS, PARAMETERS, Program};
use crate::parameter::Parameters;
use crate::scheme::Command;

/// Functions of the engine for programs.
#[derive(Debug)]
pub(crate) struct Laws {
    change: fn(&mut Engine, Command) -> Result<(), LawRefusal>,
    report: fn(&Engine, u8) -> Option<LawReport>,
    words: fn(&Engine, u8) -> Option<&[u32]>,
    command: fn(&Engine, u8, ModuleRef, &mut u16) -> Option<Command>,
    give_defaults: fn(&mut Engine, &ModuleKind, Block),
    parameter: fn(&Engine, &ModuleKind, Block, &mut Parameters<'_>),
    cycles: fn(&Engine, u8) -> Option<u32>,
}

/// The functions for an image with a kind that runs programs.
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
    /// Returns the functions; none if no module kind runs programs.
    #[inline(never)]
    fn program_functions(&self) -> Option<&'static Laws> {
        self.kinds.laws()
    }

    /// Returns the stored programs with their numbers.
    pub fn programs(&self) -> impl Iterator<Item = (u8, Program<'_>)> {
        self.data_base.programs().all()
    }

    /// Returns the words of the program with this number, if there is one and a module kind can run it.
    #[must_use]
    #[inline(never)]
    pub fn law_words(&self, number: u8) -> Option<&[u32]> {
        (self.program_functions()?.words)(self, number)
    }

    /// Returns the state of the program slot with this number; none if there is no such slot.
    #[must_use]
    #[inline(never)]
    pub fn law(&self, number: u8) -> Option<LawReport> {
        (self.program_functions()?.report)(self, number)
    }

    /// Executes a program command.
    #[inline(never)]
    pub(super) fn change_law(&mut self, command: Command) -> Result<(), LawRefusal> {
        let laws = self.program_functions().ok_or(LawRefusal::UnknownNumber)?;
        (laws.change)(self, command)
    }

    /// Returns the commands that store the program of the module at a place: the first one after `skip`
    /// others, which are counted down. Skips a program that an earlier module shares.
    #[inline(never)]
    pub(super) fn law_command(&self, place: u8, module: ModuleRef, skip: &mut u16) -> Option<Command> {
        (self.program_functions()?.command)(self, place, module, skip)
    }

    /// Sets an instance's parameters to the defaults of its new program, if its kind runs programs.
    #[inline(never)]
    pub(super) fn give_defaults_of_law(&mut self, kind: &ModuleKind, configuration: Block) {
        if let Some(laws) = self.kinds.laws().filter(|_| kind.runs_program()) {
            (laws.give_defaults)(self, kind, configuration);
        }
    }

    /// Describes the requested parameter of an instance by its program, if its kind runs programs.
    #[inline(never)]
    pub(super) fn law_parameter(&self, kind: &ModuleKind, configuration: Block, visit: &mut Parameters<'_>) {
        if let Some(laws) = self.kinds.laws().filter(|_| kind.runs_program()) {
            (laws.parameter)(self, kind, configuration, visit);
        }
    }

    /// Returns the cycles that the instructions of a program add to a tick.
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
            Command::UploadLaw { place, words } => self.data_base.programs_mut().put(place, words),
            Command::StoreLaw { number, count } => {
                let is_used = self.uses_program(number);
                self.data_base.programs_mut().keep(number, count, is_used)?;
            }
            Command::RemoveLaw { number } if self.uses_program(number) => return Err(LawRefusal::InUse),
            Command::RemoveLaw { number } => self.data_base.programs_mut().remove(number),
            // `Engine::command` passes only program commands.
            _ => return Err(LawRefusal::UnknownNumber),
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
                Some(Command::UploadLaw { place: number_of(start), words: [word(start), word(start + 1)] })
            }
            skip if skip == puts => Some(Command::StoreLaw { number, count: number_of(words.len()) }),
            _ => {
                *skip = skip.saturating_sub(u16::from(number_of(puts + 1)));
                None
            }
        }
    }

    /// Returns the program of a module in the running scheme; 0 for none.
    fn program_of_module(&self, module: ModuleRef) -> u8 {
        let kind = self.kind(module.kind);
        let instance = self.schemes.running().instance(module);
        kind.zip(instance).map_or(0, |(kind, instance)| self.program_of(kind, instance.configuration))
    }

    /// Returns whether a module of either scheme uses a program, plugged in or not.
    fn uses_program(&self, number: u8) -> bool {
        let schemes = [self.schemes.running(), self.schemes.pending()];
        number != 0
            && schemes.into_iter().flat_map(|scheme| scheme.instances.iter()).any(|instance| {
                let kind = self.kind(instance.reference.kind);
                kind.is_some_and(|kind| self.program_of(kind, instance.configuration) == number)
            })
    }

    /// Returns the program of an instance with this configuration; 0 for none.
    fn program_of(&self, kind: &ModuleKind, configuration: Block) -> u8 {
        if !kind.runs_program() {
            return 0;
        }
        let words = self.data_base.storage().words(configuration).unwrap_or_default();
        let number = words.get(kind.settings().start).copied().unwrap_or(0);
        u8::try_from(number).unwrap_or(0)
    }

    /// The second word of the settings stores the program whose parameters are set.
    fn give_defaults_of_program(&mut self, kind: &ModuleKind, configuration: Block) {
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

    /// The first parameter of a kind that runs programs is the program number.
    fn program_parameter(&self, kind: &ModuleKind, configuration: Block, visit: &mut Parameters<'_>) {
        let program = self.data_base.programs().get(self.program_of(kind, configuration).into());
        let parameter = visit.asked().and_then(|parameter| parameter.checked_sub(1));
        visit.set_law_description(
            program.zip(parameter).and_then(|(program, parameter)| program.parameter(parameter)),
        );
    }

    /// Returns the cycles that a program and its module add to a tick; none if unknown.
    fn cycles_with_module(&self, number: u8) -> Option<u32> {
        let kind = self.kinds().list().iter().find(|kind| kind.runs_program())?;
        let own = self.module_cycles(kind.id)?;
        Some(own.saturating_add(self.cycles_of_program(number)?))
    }

    fn cycles_of_program(&self, number: u8) -> Option<u32> {
        let (costs, program) = (self.costs?, self.data_base.programs().get(number.into())?);
        program.cycles(self.device.dof(), |opcode| costs.instruction(opcode))
    }
}
