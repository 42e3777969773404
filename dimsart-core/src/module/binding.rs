//! Ports that commands have bound to other signals than their types' first ones.

use crate::module::module_ref::ModuleRef;
use crate::signal::TypeRef;

/// A port that a command has bound to another signal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) module: ModuleRef,
    pub(crate) signal: TypeRef,
    pub(crate) port: &'static str,
}

/// The bindings of a module, among all there are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModuleBindings<'a> {
    pub(crate) module: ModuleRef,
    pub(crate) bindings: &'a [Binding],
}

impl ModuleBindings<'_> {
    /// Where a command has bound a port, if one has.
    #[inline(never)]
    pub(crate) fn signal(&self, port: &str) -> Option<TypeRef> {
        let is_it = |binding: &&Binding| binding.module == self.module && binding.port == port;
        self.bindings.iter().find(is_it).map(|binding| binding.signal)
    }
}
