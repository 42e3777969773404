//! Conversion of rig file sections to media parameters.

use std::path::Path;

use crate::bus::can::CanParameters;
use crate::bus::{DatagramParameters, Delay, DelayFileError, UartParameters};
use crate::rig_file::{CanSection, DelayKind, UartSection, UdpSection};

impl From<&UartSection> for UartParameters {
    fn from(uart: &UartSection) -> Self {
        let UartSection { bits_per_s, bit_error_rate, byte_drop, byte_insert, queue_bytes } = *uart;
        Self { bits_per_s, bit_error_rate, byte_drop, byte_insert, queue_bytes }
    }
}

impl From<&CanSection> for CanParameters {
    fn from(can: &CanSection) -> Self {
        let CanSection { bits_per_s, data_bits_per_s, bit_error_rate, rejoins, queue_frames, .. } = *can;
        Self { bits_per_s, data_bits_per_s, bit_error_rate, rejoins, queue_frames }
    }
}

impl UdpSection {
    /// Creates a path with this bit rate and delays.
    pub(super) fn path(&self, bits_per_s: u32, delay: Delay) -> DatagramParameters {
        DatagramParameters {
            bits_per_s,
            header_bytes: self.header_bytes,
            queue_bytes: self.queue_bytes,
            delay,
            burst_entry_probability: self.burst_entry_probability,
            burst_exit_probability: self.burst_exit_probability,
            burst_loss: self.burst_loss,
            overtaking: self.overtaking,
        }
    }

    /// Creates its delays; recorded delays are read from `folder`.
    ///
    /// # Errors
    /// [`DelayFileError`] for an invalid delays file.
    pub(super) fn delay(&self, folder: &Path) -> Result<Delay, DelayFileError> {
        let Self { delay_s, spread_s, gamma_shape, .. } = *self;
        Ok(match self.delay {
            DelayKind::Constant => Delay::Constant(delay_s),
            DelayKind::Uniform => Delay::Uniform { min_s: delay_s, width_s: spread_s },
            DelayKind::Gamma => Delay::Gamma { min_s: delay_s, mean_s: spread_s, shape: gamma_shape },
            DelayKind::Recorded => Delay::read(&folder.join(&self.delays_file))?,
        })
    }
}
