//! A scheme as the commands that would build it.

use super::Engine;
use crate::command::{Command, Target, Verb};
use crate::module::ModuleList;
use crate::parameter::Parameters;
use crate::port::PortSpecs;

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    /// Command `index` of those that would build the module at `place`; none past the last one.
    ///
    /// Places count from 0: the modules that are plugged in first, in plug-in order, then the others; each has
    /// a command at least. All commands of all places, given to an engine without modules for a device of
    /// the same types, build the same scheme; `MATCHING_CHECK` then starts it.
    #[must_use]
    pub fn command_of(&mut self, place: u8, index: u16) -> Option<Command> {
        let Self { device, data_base, instances, plug_in_order, .. } = self;
        let unplugged = (0..).zip(instances.iter()).filter(|(_, instance)| !instance.is_active);
        let mut places = plug_in_order.iter().copied().chain(unplugged.map(|(index, _)| index));
        let instance = places.nth(usize::from(place))?;
        let instance = instances.get_mut(usize::from(instance))?;
        let module = instance.reference;
        let mut skip = index;
        if !instance.is_active {
            let Some(rest) = skip.checked_sub(1) else {
                // Makes it exist, even if nothing else is to be said of it.
                return Some(Command::engine(Verb::ModInit, module));
            };
            skip = rest;
        }
        let (dof, mut change) = (u8::try_from(device.dof()).unwrap_or(u8::MAX), None);
        instance.module.parameters(&mut Parameters::changed(dof, &mut skip, &mut change));
        if let Some(change) = change {
            let (param, axis, value) = (change.index, change.axis, change.value);
            return Some(Command { module: Target::Module(module), param, axis, value });
        }
        // Behind the parameters: they decide what ports there are.
        let mut specs = PortSpecs::new();
        instance.declare(device, data_base, &mut specs).then_some(())?;
        let bound = (0..).zip(&specs).filter_map(|(port, spec)| Some((port, instance.bound(spec.name)?)));
        let mut commands = bound
            .map(|(port, signal)| Command::bind(module, port, signal))
            .chain(instance.is_active.then(|| Command::engine(Verb::ModOn, module)));
        commands.nth(usize::from(skip))
    }

    /// The commands that would build the scheme as it is; see [`command_of`](Self::command_of).
    pub fn commands(&mut self) -> impl Iterator<Item = Command> + '_ {
        let mut cursor = Cursor::default();
        core::iter::from_fn(move || {
            loop {
                let (place, index) = cursor.place_and_index();
                let command = self.command_of(place, index);
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

/// Where a walk through all [commands](Engine::command_of) of a scheme has come to.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cursor {
    place: u8,
    index: u16,
}

impl Cursor {
    /// Place and index of the command to ask for.
    #[must_use]
    pub fn place_and_index(self) -> (u8, u16) {
        (self.place, self.index)
    }

    /// Goes on after it was asked for; false at the end of the scheme.
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
