//! A control law on a bench: one axis, 1 kHz, plain numbers in and out, to try a module out in a few lines.

use crate::data_base::StorageError;
use crate::device::DeviceDescriptor;
use crate::device::descriptor::DescriptorError;
use crate::dimsart::Dimsart;
use crate::engine::Kinds;
use crate::limits::MAX_DOF;
use crate::memory::ProvidedMemory;
use crate::rows::{self, SchemeError};
use crate::safety::Tick;
use crate::signal::{AxisKind, DataType, Word};

/// A controller for a device of one linear axis that measures what a test says.
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

/// Why a bench was not set up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BenchError {
    /// No device can measure these types.
    Device(DescriptorError),
    /// There is no room for what it measures.
    Memory(StorageError),
    /// The first row of the scheme that was not taken.
    Scheme(SchemeError<'static>),
    /// Every row was taken, and the scheme does not run: it has no `MATCHING_CHECK`, or does not match.
    DoesNotRun,
}

impl Bench {
    /// Time between two ticks, `s`.
    pub const PERIOD_S: f32 = 1e-3;

    /// A controller with these kinds of modules and a scheme for `all`, whose device measures these types, one value of each.
    ///
    /// # Errors
    /// [`BenchError`].
    pub fn new(
        kinds: Kinds,
        measured: &'static [&'static DataType],
        rows: &'static str,
    ) -> Result<Self, BenchError> {
        const AXES: &[AxisKind] = &[AxisKind::Linear];
        let device = DeviceDescriptor::new("bench", AXES, Self::PERIOD_S, measured, &[]);
        let device = device.map_err(BenchError::Device)?;
        let mut dimsart =
            Dimsart::new(ProvidedMemory::leaked(), device, kinds).map_err(BenchError::Memory)?;
        let mut first = None;
        rows::load(rows, "all", &[], &mut dimsart, |error| first = first.or(Some(error)));
        match first {
            Some(error) => Err(BenchError::Scheme(error)),
            None if !dimsart.engine().is_running() => Err(BenchError::DoesNotRun),
            None => Ok(Self { dimsart }),
        }
    }

    /// Runs a tick and gives the first value of a signal, `NAME` or `NAME.2`; none where the tick did not run or nothing has
    /// that name.
    pub fn tick(&mut self, measured: &[f32], signal: &str) -> Option<f32> {
        let mut words = [Word::default(); MAX_DOF];
        words.iter_mut().zip(measured).for_each(|(word, value)| *word = Word::from(*value));
        if self.dimsart.tick(words.get(..measured.len())?, &mut []) != Tick::Ran {
            return None;
        }
        let engine = self.dimsart.engine();
        let slot = engine.data_base().slot(engine.device().signal(signal)?)?;
        engine.data_base().words(slot).first().map(|word| f32::from_bits(*word))
    }

    /// The controller, for what a test wants to look at.
    #[must_use]
    pub fn dimsart(&self) -> &Dimsart {
        &self.dimsart
    }
}
