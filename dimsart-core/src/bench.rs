//! Test bench for a control law: one axis, 1 kHz, plain numbers in and out.

use crate::data_base::StorageError;
use crate::device::DeviceDescriptor;
use crate::device::descriptor::DescriptorError;
use crate::dimsart::Dimsart;
use crate::engine::ModuleKinds;
use crate::limits::MAX_DOF;
use crate::memory::ProvidedMemory;
use crate::rows::{self, SchemeError};
use crate::safety::TickResult;
use crate::signal::{AxisKind, DataType, Word};

/// A controller for a device with one linear axis, whose measurements the test sets.
///
/// ```
/// use dimsart_core::{Bench, types};
///
/// let mut bench = Bench::new(
///     dimsart_modules::ALL,
///     &[types::POSITION, types::DES_POSITION],
///     "all PCTRL_MOD K_PARAM 3000
///      all MOD_ENG   MOD_ON PCTRL_MOD
///      all MOD_ENG   MATCHING_CHECK",
/// )?;
/// assert_eq!(bench.tick(&[0.0, 0.1], "DES_FORCE"), Some(300.0));
/// # Ok::<(), dimsart_core::BenchError>(())
/// ```
#[derive(Debug)]
pub struct Bench {
    dimsart: Dimsart,
}

/// Reason why a bench was not created.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BenchError {
    /// The device cannot have these types.
    Device(DescriptorError),
    /// The Data Base has no room for the measurements.
    Memory(StorageError),
    /// The first row of the scheme that was refused.
    Scheme(SchemeError<'static>),
    /// The scheme does not run: it has no `MATCHING_CHECK`, or does not match.
    NotRunning,
}

impl Bench {
    /// Sample period, `s`.
    pub const PERIOD_S: f32 = 1e-3;

    /// Creates a controller with these module kinds and a scheme whose rows are for `all`. Its device
    /// measures one value of each of the types.
    ///
    /// # Errors
    /// [`BenchError`].
    pub fn new(
        kinds: ModuleKinds,
        measured: &'static [&'static DataType],
        rows: &'static str,
    ) -> Result<Self, BenchError> {
        const AXES: &[AxisKind] = &[AxisKind::Linear];
        let device = DeviceDescriptor::new("bench", AXES, Self::PERIOD_S, measured, &[]);
        let device = device.map_err(BenchError::Device)?;
        let mut dimsart =
            Dimsart::new(ProvidedMemory::leak_default(), device, kinds).map_err(BenchError::Memory)?;
        let mut first = None;
        rows::load(rows, "all", &[], &mut dimsart, |error| first = first.or(Some(error)));
        match first {
            Some(error) => Err(BenchError::Scheme(error)),
            None if !dimsart.engine().is_running() => Err(BenchError::NotRunning),
            None => Ok(Self { dimsart }),
        }
    }

    /// Runs a tick and returns the first value of a signal, `NAME` or `NAME.2`; none if the tick did not run
    /// or the signal does not exist.
    pub fn tick(&mut self, measured: &[f32], signal: &str) -> Option<f32> {
        let mut words = [Word::default(); MAX_DOF];
        words.iter_mut().zip(measured).for_each(|(word, value)| *word = Word::from(*value));
        if self.dimsart.tick(words.get(..measured.len())?, &mut []) != TickResult::Ran {
            return None;
        }
        let engine = self.dimsart.engine();
        let slot = engine.data_base().slot(engine.device().signal(signal)?)?;
        engine.data_base().words(slot).first().map(|word| f32::from_bits(*word))
    }

    /// Returns the controller.
    #[must_use]
    pub fn controller(&self) -> &Dimsart {
        &self.dimsart
    }
}
