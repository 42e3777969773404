//! A simulated controller that is asked without a line.

use std::collections::VecDeque;
use std::io::{self, Read, Write};

use dimsart_link::protocol::{DeviceInfo, MAX_FRAME_BYTES, Receiver, answer};
use hil_sim::rig::SimulatedDimsart;

/// A controller of this process as a stream: requests go in, and their answers are there at once.
#[derive(Debug)]
pub struct InProcess<'a> {
    dimsart: &'a mut SimulatedDimsart,
    info: DeviceInfo,
    receiver: Receiver,
    answers: VecDeque<u8>,
}

impl<'a> InProcess<'a> {
    /// A controller that nobody ticks meanwhile.
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
        receiver.take_all(bytes, |content| {
            // The buffer is as long as a frame can be, and what is no request needs no answer.
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
            // To a line, nothing read means that the other end is gone.
            0 => Err(io::ErrorKind::WouldBlock.into()),
            count => Ok(count),
        }
    }
}
