//! Bindings: ports that commands have bound to other signals than the default.

use crate::module::module_ref::ModuleRef;
use crate::signal::TypeRef;

/// A port that a command has bound to a signal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) module: ModuleRef,
    pub(crate) signal: TypeRef,
    pub(crate) port: &'static str,
}

/// The bindings of one module in a list of all bindings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModuleBindings<'a> {
    pub(crate) module: ModuleRef,
    pub(crate) bindings: &'a [Binding],
}

impl ModuleBindings<'_> {
    /// Returns the signal that a command has bound to a port.
    #[inline(never)]
    pub(crate) fn signal(&self, port: &str) -> Option<TypeRef> {
        let is_it = |binding: &&Binding| binding.module == self.module && binding.port == port;
        self.bindings.iter().find(is_it).map(|binding| binding.signal)
    }
}
