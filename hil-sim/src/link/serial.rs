//! Link over a serial port, for two processes or a process and a board.

use std::io::{Read, Write};
use std::time::Duration;

use dimsart_link::carrier::stream::{MAX_FRAME_BYTES, StreamReceiver, encode};
use serialport::SerialPort;

use super::{ArrivalPoll, Link};
use super::{PortError, open_serial};

/// Both directions of a serial port. Sending and receiving never block.
#[derive(Debug)]
pub struct Serial {
    port: Box<dyn SerialPort>,
    receiver: StreamReceiver,
}

impl Serial {
    /// Opens the port.
    ///
    /// # Errors
    /// [`PortError`] if the port cannot be opened.
    pub fn open(path: &str, baud: u32) -> Result<Self, PortError> {
        let port = open_serial(path, baud, Duration::ZERO)?;
        Ok(Self { port, receiver: StreamReceiver::new() })
    }

    /// Detects received bytes without reading them. `None` if unsupported.
    #[must_use]
    pub fn arrival(&self) -> Option<ArrivalPoll> {
        let port = self.port.try_clone().ok()?;
        Some(ArrivalPoll::new(move || port.bytes_to_read().is_ok_and(|count| count > 0)))
    }
}

impl Link for Serial {
    fn send(&mut self, _now: u64, bytes: &[u8]) {
        if let Some(frame) = encode(bytes, &mut [0; MAX_FRAME_BYTES]) {
            // Bytes that exceed the system's buffer damage the frame; the receiver detects it.
            let _ = self.port.write_all(frame);
        }
    }

    fn receive(&mut self, _now: u64, deliver: &mut dyn FnMut(&[u8])) {
        let mut bytes = [0; 256];
        while let Ok(count @ 1..) = self.port.read(&mut bytes) {
            for byte in bytes.iter().take(count) {
                if let Some(content) = self.receiver.push(*byte) {
                    deliver(content);
                }
            }
        }
    }
}
