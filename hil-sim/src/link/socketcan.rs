//! Link over a Linux CAN interface, for two processes or a process and boards. Untested: no interface was available.

use std::io;

use dimsart_link::carrier::can::{Assembler, frames};
use dimsart_link::carrier::can_fd::{pack, unpack};
use socketcan::{
    CanAnyFrame, CanDataFrame, CanFdFrame, CanFdSocket, CanFilter, EmbeddedFrame as _, ExtendedId, Id,
    Socket as _, SocketOptions as _, StandardId,
};

use super::{Channels, Link};

/// Both directions of a CAN interface, with channels as identifiers; channel 0 is any 29-bit identifier. Sending and
/// receiving never block.
#[derive(Debug)]
pub struct SocketCan {
    socket: CanFdSocket,
    is_fd: bool,
    channels: Channels,
    assembler: Assembler,
}

/// The identifier is extended.
const EXTENDED: u32 = 0x8000_0000;
const STANDARD_BITS: u32 = 0x7FF;

impl SocketCan {
    /// Opens the interface.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn open(interface: &str, is_fd: bool, channels: Channels) -> io::Result<Self> {
        let socket = CanFdSocket::open(interface)?;
        socket.set_nonblocking(true)?;
        let filter = match u32::from(channels.receive) {
            0 => CanFilter::new(EXTENDED, EXTENDED),
            channel => CanFilter::new(channel, EXTENDED | STANDARD_BITS),
        };
        socket.set_filters(&[filter])?;
        let assembler = if channels.is_authenticated { Assembler::authenticated() } else { Assembler::new() };
        Ok(Self { socket, is_fd, channels, assembler })
    }

    /// On channel 0: an identifier that is unique on this computer.
    fn identifier(&self) -> Id {
        let own = ExtendedId::new(std::process::id() & ExtendedId::MAX.as_raw()).unwrap_or(ExtendedId::ZERO);
        let standard = StandardId::new(self.channels.out).filter(|_| self.channels.out != 0);
        standard.map_or(Id::Extended(own), Id::Standard)
    }
}

impl Link for SocketCan {
    fn send(&mut self, _now: u64, bytes: &[u8]) {
        // A full queue loses the packet; the receiver counts it.
        if self.is_fd {
            let frame = pack(bytes).and_then(|data| CanFdFrame::new(self.identifier(), &data));
            if let Some(mut frame) = frame {
                frame.set_brs(true);
                let _ = self.socket.write_frame(&frame);
            }
        } else {
            for data in frames(bytes, self.channels.out).into_iter().flatten() {
                let Some(frame) = CanDataFrame::new(self.identifier(), &data) else { return };
                if self.socket.write_frame(&frame).is_err() {
                    return;
                }
            }
        }
    }

    fn receive(&mut self, _now: u64, deliver: &mut dyn FnMut(&[u8])) {
        loop {
            match self.socket.read_frame() {
                Ok(CanAnyFrame::Fd(frame)) if self.is_fd => {
                    unpack(frame.data()).into_iter().for_each(&mut *deliver)
                }
                Ok(CanAnyFrame::Normal(frame)) if !self.is_fd => {
                    let content = self.assembler.push(frame.data(), self.channels.receive);
                    content.into_iter().for_each(&mut *deliver);
                }
                Ok(_) => {}
                Err(_) => return,
            }
        }
    }
}
