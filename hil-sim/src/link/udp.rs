//! Link over UDP sockets, for two processes.

use std::net::{SocketAddr, UdpSocket};

use dimsart_core::envelope::MAX_CONTENT_BYTES;

use super::{ArrivalPoll, Link};

/// Error of opening a socket.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on UDP address {address}: {source}; {}", repair(source))]
pub struct UdpError {
    /// The address.
    pub address: SocketAddr,
    /// Error of the operating system.
    pub source: std::io::Error,
}

fn repair(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::AddrInUse => "stop the program that uses this address",
        std::io::ErrorKind::AddrNotAvailable => "use an address of this computer",
        _ => "check the address and your permissions",
    }
}

/// Both directions between this process and the peer's address. Drops packets from other addresses. Sending and
/// receiving never block.
#[derive(Debug)]
pub struct Udp {
    socket: UdpSocket,
    peer: SocketAddr,
}

impl Udp {
    /// Opens the socket.
    ///
    /// # Errors
    /// [`UdpError`] if the own address is in use or not of this computer.
    pub fn open(own: SocketAddr, peer: SocketAddr) -> Result<Self, UdpError> {
        let open = || {
            let socket = UdpSocket::bind(own)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let socket = open().map_err(|source| UdpError { address: own, source })?;
        Ok(Self { socket, peer })
    }

    /// Detects packets of the peer without reading them. `None` if unsupported.
    #[must_use]
    pub fn arrival(&self) -> Option<ArrivalPoll> {
        let (socket, peer) = (self.socket.try_clone().ok()?, self.peer);
        let is_peers = move |(_, sender)| sender == peer;
        Some(ArrivalPoll::new(move || socket.peek_from(&mut [0; MAX_CONTENT_BYTES]).is_ok_and(is_peers)))
    }
}

impl Link for Udp {
    fn send(&mut self, _now: u64, bytes: &[u8]) {
        // A missing peer or a full buffer loses the packet; the receiver counts it.
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
                // The peer's port was closed for an earlier packet; more packets may be waiting.
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionRefused => {}
                Err(_) => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn what_a_stranger_sends_is_neither_heard_nor_taken() {
        let [peer, stranger] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
        let own = "127.0.0.1:0".parse().unwrap();
        let mut link = Udp::open(own, peer.local_addr().unwrap()).unwrap();
        let own = link.socket.local_addr().unwrap();
        let arrival = link.arrival().unwrap();
        let heard =
            |wait_ms| arrival.wait_for_arrival(Instant::now() + Duration::from_millis(wait_ms)).is_some();
        stranger.send_to(b"stranger", own).unwrap();
        assert!(!heard(50), "accepted a packet of a stranger");
        peer.send_to(b"peer", own).unwrap();
        let (mut taken, deadline) = (Vec::new(), Instant::now() + Duration::from_secs(10));
        while taken.is_empty() && Instant::now() < deadline {
            link.receive(0, &mut |bytes| taken.push(bytes.to_vec()));
        }
        assert_eq!(taken, [b"peer"]);
        peer.send_to(b"again", own).unwrap();
        assert!(heard(10_000), "lost a packet of the peer");
    }
}
