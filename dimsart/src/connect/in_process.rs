//! A simulated controller in this process, reached without a port.

use std::collections::VecDeque;
use std::io::{self, Read, Write};

use dimsart_link::protocol::{DeviceInfo, MAX_FRAME_BYTES, Receiver, answer};
use hil_sim::rig::SimulatedDimsart;

/// A controller of this process as a stream that answers each request immediately.
#[derive(Debug)]
pub struct InProcess<'a> {
    dimsart: &'a mut SimulatedDimsart,
    info: DeviceInfo,
    receiver: Receiver,
    answers: VecDeque<u8>,
}

impl<'a> InProcess<'a> {
    /// Wraps a controller, which does not tick during this borrow.
    #[must_use]
    pub fn new(dimsart: &'a mut SimulatedDimsart) -> Self {
        let info = DeviceInfo::new(concat!("simulated, DIMSART ", env!("CARGO_PKG_VERSION"))).with_laws();
        Self { dimsart, info, receiver: Receiver::new(), answers: VecDeque::new() }
    }
}

impl Write for InProcess<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Self { dimsart, info, receiver, answers } = self;
        let mut frame = [0; MAX_FRAME_BYTES];
        receiver.push_all(bytes, |content| {
            // The buffer has the maximum frame length; other frames than requests need no answer.
            if let Ok(Some(bytes)) = answer(content, dimsart, info, &mut frame) {
                answers.extend(bytes);
            }
        });
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for InProcess<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.answers.read(buffer)? {
            // A read of 0 bytes means a closed line.
            0 => Err(io::ErrorKind::WouldBlock.into()),
            count => Ok(count),
        }
    }
}
