//! Settings of a rig file that override a scheme's parameters.

use dimsart_core::names::split;
use dimsart_core::{Command, ModuleKinds, ModuleRef};

/// A setting: overrides the rows of the scheme.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The module.
    pub module: String,
    /// The parameter.
    pub command: String,
    /// Value as in a scheme.
    pub value: String,
    /// Key of the setting.
    pub key: String,
}

impl Setting {
    pub(super) fn row(&self) -> String {
        format!("all {} {} {}", self.module, self.command, self.value)
    }

    /// Whether `command` plugs the module in: the last time to set a parameter that determines ports or memory.
    pub(super) fn is_due_before(&self, command: Command) -> bool {
        self.module_ref().is_some_and(|module| command == Command::PlugIn(module))
    }

    /// Whether `command` set this parameter, on one axis or on all.
    pub(super) fn is_due_after(&self, command: Command, kinds: ModuleKinds) -> bool {
        let Command::Set { module, parameter, .. } = command else { return false };
        self.module_ref() == Some(module) && kinds.parameter(module.kind, &self.command) == Some(parameter)
    }

    /// Returns the module, whether or not a controller has its kind.
    pub(super) fn module_ref(&self) -> Option<ModuleRef> {
        split(&self.module).map(|(kind, number)| ModuleRef::new(kind, number))
    }
}
