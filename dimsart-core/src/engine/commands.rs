//! Export of a scheme as commands that rebuild it.

use super::Engine;
use crate::module::rate::{self, EVERY_TICKS};
use crate::module::{ModuleRef, PortSpecs};
use crate::scheme::{Command, Instance};
use crate::vocabulary::Vocabulary as _;

impl Engine {
    /// Returns command `index` of those that rebuild the module at `place` of the running scheme; none after
    /// the last one.
    ///
    /// Places count from 0: first the modules that are plugged in, in plug-in order, then the others; each
    /// has at least one command. All commands of all places rebuild the same scheme in an engine without
    /// modules, for a device of the same types; `MATCHING_CHECK` then starts it.
    #[must_use]
    pub fn rebuild_command(&mut self, place: u8, index: u16) -> Option<Command> {
        let module = self.modules_by_place().nth(usize::from(place))?;
        let is_plugged_in = self.is_plugged_in(module);
        let mut skip = index;
        if let Some(command) = self.law_command(place, module, &mut skip) {
            return Some(command);
        }
        if !is_plugged_in {
            let Some(rest) = skip.checked_sub(1) else {
                // Creates the instance, even if all its parameters have their defaults.
                return Some(Command::InitModule(module));
            };
            skip = rest;
        }
        if let Some(command) = self.difference(module, &mut skip) {
            return Some(command);
        }
        // Bindings follow the parameters, which determine the ports.
        let (running, mut specs) = (self.schemes.running(), PortSpecs::new());
        self.declare(running, module, &mut specs).then_some(())?;
        let bound = running.bound(module);
        let bound = (0..).zip(&specs).filter_map(|(port, spec)| Some((port, bound.signal(spec.name)?)));
        let mut commands = bound
            .map(|(port, signal)| Command::bind(module, port, signal))
            .chain(is_plugged_in.then_some(Command::PlugIn(module)));
        commands.nth(usize::from(skip))
    }

    /// Returns every module of the running scheme, by place.
    pub(super) fn modules_by_place(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        let running = self.schemes.running();
        let plugged_in = running.wiring.modules().iter().map(|plugged| plugged.module);
        let instances = running.instances.iter().map(|instance| instance.reference);
        plugged_in.chain(instances.filter(|module| !running.is_plugged_in(*module)))
    }

    /// Returns the command for a parameter value that differs from the default, or for a list entry: the
    /// first one after `skip` others, which are counted down.
    fn difference(&mut self, module: ModuleRef, skip: &mut u16) -> Option<Command> {
        let mut take = |parameter, entry, value| match skip.checked_sub(1) {
            Some(rest) => {
                *skip = rest;
                None
            }
            None => Some(Command::Set { module, parameter, entry, value }),
        };
        let Instance { configuration, every_ticks, .. } = *self.schemes.running().instance(module)?;
        if every_ticks > 1
            && let Some(command) = take(EVERY_TICKS, None, rate::to_value(every_ticks))
        {
            return Some(command);
        }
        let kind = module.kind;
        for param in 0..=u8::MAX {
            let (parameter, first) = self.look(configuration, kind, param, (0, None))?;
            let Some(default) = parameter.default else {
                for entry in 0..=u8::MAX {
                    let found = self.look(configuration, kind, param, (0, Some(entry)));
                    let Some((_, Some(value))) = found else { break };
                    if let Some(command) = take(param, None, value) {
                        return Some(command);
                    }
                }
                continue;
            };
            let first = first?;
            let count = parameter.entries.count(self.dof());
            let is_same = |engine: &mut Self, place| {
                engine.value_in(configuration, kind, param, place).is_ok_and(|value| value.is_same(first))
            };
            let is_uniform = (1..count).all(|place| is_same(self, place));
            for place in 0..if is_uniform { 1 } else { count } {
                let value =
                    if place == 0 { first } else { self.value_in(configuration, kind, param, place).ok()? };
                if !value.is_same(default)
                    && let Some(command) = take(param, (!is_uniform).then_some(place), value)
                {
                    return Some(command);
                }
            }
        }
        None
    }

    /// Returns the commands that rebuild the scheme; see [`rebuild_command`](Self::rebuild_command).
    pub fn rebuild_commands(&mut self) -> impl Iterator<Item = Command> + '_ {
        let mut cursor = CommandCursor::default();
        core::iter::from_fn(move || {
            loop {
                let (place, index) = cursor.next_command_location();
                let command = self.rebuild_command(place, index);
                if !cursor.advance(command.is_some()) {
                    return None;
                }
                if command.is_some() {
                    return command;
                }
            }
        })
    }
}

/// Position in the [commands](Engine::rebuild_command) of a scheme.
#[derive(Debug, Clone, Copy, Default)]
pub struct CommandCursor {
    place: u8,
    index: u16,
}

impl CommandCursor {
    /// Returns place and index of the next command.
    #[must_use]
    pub fn next_command_location(self) -> (u8, u16) {
        (self.place, self.index)
    }

    /// Advances; `was_there` is whether the command existed. Returns false at the end of the scheme.
    #[must_use]
    pub fn advance(&mut self, was_there: bool) -> bool {
        let is_end = !was_there && self.index == 0;
        let (place, index) = (self.place, self.index);
        *self = match was_there {
            true => Self { place, index: index.saturating_add(1) },
            false => Self { place: place.saturating_add(1), index: 0 },
        };
        !is_end
    }
}
