//! Settings of a scenario or rig file that are put over a scheme's own parameters.

use dimsart_core::names::split;
use dimsart_core::{Command, Kinds, ModuleRef};

/// A value that a key asks for: it goes over the rows of the scheme.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The module.
    pub module: String,
    /// The parameter.
    pub command: String,
    /// The value as a scheme would write it.
    pub value: String,
    /// The key it comes from.
    pub key: String,
}

impl Setting {
    pub(super) fn row(&self) -> String {
        format!("all {} {} {}", self.module, self.command, self.value)
    }

    /// Whether `command` plugs the module in: the last moment for a parameter that decides ports or memory.
    pub(super) fn is_due_before(&self, command: Command) -> bool {
        self.module_ref().is_some_and(|module| command == Command::PlugIn(module))
    }

    /// Whether `command` set this very parameter, on one axis or on all.
    pub(super) fn is_due_after(&self, command: Command, kinds: Kinds) -> bool {
        let Command::Set { module, parameter, .. } = command else { return false };
        self.module_ref() == Some(module) && kinds.parameter(module.kind, &self.command) == Some(parameter)
    }

    /// The module, whether a controller has its kind or not.
    pub(super) fn module_ref(&self) -> Option<ModuleRef> {
        split(&self.module).map(|(kind, number)| ModuleRef::new(kind, number))
    }
}
