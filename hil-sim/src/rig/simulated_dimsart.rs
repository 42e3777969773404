//! A simulated controller in pooled heap memory.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

use dimsart_core::limits::Capacities;
use dimsart_core::{DeviceDescriptor, Dimsart, ModuleKinds, ProvidedMemory, StorageError, memory};
use scopeguard::ScopeGuard;

/// Sizes of a simulated controller: a link per joint of a coordinator, and delays of seconds.
pub const SIZES: Capacities =
    Capacities { modules: 32, wires: 240, bindings: 64, slots: 64, links: 8, programs: 8, words: 32_768 };

/// Unused memory for further controllers.
static FREE: Mutex<Vec<ProvidedMemory>> = Mutex::new(Vec::new());

/// A simulated controller; its memory is reused after it is dropped.
#[derive(Debug)]
pub struct SimulatedDimsart(ScopeGuard<Dimsart, fn(Dimsart)>);

impl SimulatedDimsart {
    /// As [`Dimsart::new`].
    ///
    /// # Errors
    /// [`StorageError`] if the device's types do not fit into the Data Base.
    pub fn new(device: DeviceDescriptor, kinds: ModuleKinds) -> Result<Self, StorageError> {
        let mut dimsart = Self::without_device();
        dimsart.connect(device, kinds)?;
        Ok(dimsart)
    }

    /// As [`Dimsart::without_device`].
    #[must_use]
    pub fn without_device() -> Self {
        let free = FREE.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let memory = free.unwrap_or_else(|| Box::leak(Box::new(<memory!(SIZES)>::new())).into());
        Self(scopeguard::guard(Dimsart::without_device(memory), give_back))
    }
}

fn give_back(dimsart: Dimsart) {
    FREE.lock().unwrap_or_else(PoisonError::into_inner).push(dimsart.release());
}

impl Deref for SimulatedDimsart {
    type Target = Dimsart;

    fn deref(&self) -> &Dimsart {
        &self.0
    }
}

impl DerefMut for SimulatedDimsart {
    fn deref_mut(&mut self) -> &mut Dimsart {
        &mut self.0
    }
}
