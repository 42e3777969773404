//! A one-axis controller with any sample period, for plants that a test integrates.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    reason = "in helpers of tests as in tests"
)]

use dimsart_core::{AxisKind, DataType, DeviceDescriptor, Dimsart, ProvidedMemory, TickResult, Word, scheme};
use dimsart_modules::ALL;

/// See the module docs.
pub(crate) struct Port {
    dimsart: Dimsart,
}

impl Port {
    /// Creates a controller for a device with these measured types and rows `MODULE COMMAND VALUE`.
    pub(crate) fn new(period_s: f64, measured: &'static [&'static DataType], rows: &str) -> Self {
        let device = DeviceDescriptor::new("port", &[AxisKind::Linear], period_s as f32, measured, &[]);
        let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
        let rows = rows.lines().map(|row| format!("all {row}\n")).collect::<String>();
        let rows = rows + "all MOD_ENG MATCHING_CHECK\n";
        let mut errors = Vec::new();
        scheme::load(&rows, "all", &[], &mut dimsart, |error| errors.push(format!("{error:?}")));
        assert!(errors.is_empty() && dimsart.engine().is_running(), "{errors:?}");
        Self { dimsart }
    }

    /// Runs a tick with these measurements.
    pub(crate) fn tick(&mut self, measured: &[f64]) {
        let words: Vec<Word> = measured.iter().map(|value| Word::from(*value as f32)).collect();
        assert_eq!(self.dimsart.tick(&words, &mut []), TickResult::Ran);
    }

    /// Returns a signal after the tick.
    pub(crate) fn signal(&self, name: &str) -> f64 {
        let engine = self.dimsart.engine();
        let slot = engine.data_base().slot(engine.device().signal(name).unwrap()).unwrap();
        f64::from(f32::from_bits(engine.data_base().words(slot)[0]))
    }
}
