//! A link over real UDP sockets, for two processes on one or two computers.

use std::net::{SocketAddr, UdpSocket};

use dimsart_core::envelope::MAX_CONTENT_BYTES;

use super::{ArrivalPoll, Link};

/// Why a socket could not be set up.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on UDP address {address}: {source}; {}", repair(source))]
pub struct UdpError {
    /// The address.
    pub address: SocketAddr,
    /// What the system says.
    pub source: std::io::Error,
}

fn repair(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::AddrInUse => "end the program that uses it",
        std::io::ErrorKind::AddrNotAvailable => "it is no address of this computer",
        _ => "the system does not let it",
    }
}

/// Both directions between this process and the one at the peer's address.
///
/// Packets of anybody else are dropped. Sending and receiving never wait.
#[derive(Debug)]
pub struct Udp {
    socket: UdpSocket,
    peer: SocketAddr,
}

impl Udp {
    /// Opens the socket.
    ///
    /// # Errors
    /// [`UdpError`] when the own address is taken or not of this machine.
    pub fn open(own: SocketAddr, peer: SocketAddr) -> Result<Self, UdpError> {
        let open = || {
            let socket = UdpSocket::bind(own)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let socket = open().map_err(|source| UdpError { address: own, source })?;
        Ok(Self { socket, peer })
    }

    /// Finds out when packets come in, and leaves them there. None if the system refuses.
    #[must_use]
    pub fn arrival(&self) -> Option<ArrivalPoll> {
        let socket = self.socket.try_clone().ok()?;
        Some(ArrivalPoll::new(move || socket.peek(&mut [0; MAX_CONTENT_BYTES]).is_ok()))
    }
}

impl Link for Udp {
    fn send(&mut self, _now: u64, bytes: &[u8]) {
        // A peer that is not there yet, or a full buffer, is a lost packet: the receiver counts it.
        let _ = self.socket.send_to(bytes, self.peer);
    }

    fn receive(&mut self, _now: u64, deliver: &mut dyn FnMut(&[u8])) {
        let mut bytes = [0; MAX_CONTENT_BYTES];
        loop {
            match self.socket.recv_from(&mut bytes) {
                Ok((length, sender)) if sender == self.peer => {
                    deliver(bytes.get(..length).unwrap_or_default());
                }
                Ok(_) => {}
                // The peer's port was closed when an earlier packet got there; there may be more.
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionRefused => {}
                Err(_) => return,
            }
        }
    }
}
