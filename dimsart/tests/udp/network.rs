//! Two processes, and the network between them.

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A socket on a port chosen by the system, bound for its lifetime.
pub(super) fn held() -> UdpSocket {
    UdpSocket::bind("127.0.0.1:0").unwrap()
}

pub(super) fn address(socket: &UdpSocket) -> SocketAddr {
    socket.local_addr().unwrap()
}

/// The network between both sides forwards their packets. The sides know only its two ends, and the system chooses their own
/// ports at start, so that no other program can take a free port.
pub(super) struct Network {
    /// Ports at which master and slave find each other.
    ends: [UdpSocket; 2],
    /// Last sender at each end.
    peers: [Mutex<Option<SocketAddr>>; 2],
    is_over: AtomicBool,
}

/// Ends the network's threads when it is dropped.
struct End<'n>(&'n AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Network {
    /// Transfers packets while `work` runs, which receives the two ends.
    pub(super) fn carry<R>(work: impl FnOnce([SocketAddr; 2]) -> R) -> R {
        Self::tamper(|_, packet| vec![packet.to_vec()], work)
    }

    /// Transfers packets as [`carry`](Self::carry) with an intermediary: a packet for an end (0: the slave's) is replaced by the
    /// result of `meddle`.
    pub(super) fn tamper<R>(
        meddle: impl Fn(usize, &[u8]) -> Vec<Vec<u8>> + Sync,
        work: impl FnOnce([SocketAddr; 2]) -> R,
    ) -> R {
        let network =
            Self { ends: [held(), held()], peers: Default::default(), is_over: AtomicBool::new(false) };
        std::thread::scope(|scope| {
            scope.spawn(|| network.pass(0, 1, &meddle));
            scope.spawn(|| network.pass(1, 0, &meddle));
            // Also after a failed assertion: the scope waits for its threads.
            let _end = End(&network.is_over);
            work(network.ends.each_ref().map(address))
        })
    }

    /// Forwards the packets of one end.
    fn pass(&self, here: usize, there: usize, meddle: &impl Fn(usize, &[u8]) -> Vec<Vec<u8>>) {
        self.ends[here].set_read_timeout(Some(Duration::from_millis(10))).unwrap();
        let mut bytes = [0; 2048];
        while !self.is_over.load(Ordering::Relaxed) {
            // No packet, or a peer has ended.
            let Ok((length, sender)) = self.ends[here].recv_from(&mut bytes) else { continue };
            *self.peers[here].lock().unwrap() = Some(sender);
            if let Some(peer) = *self.peers[there].lock().unwrap() {
                for packet in meddle(here, &bytes[..length]) {
                    let _ = self.ends[there].send_to(&packet, peer);
                }
            }
        }
    }
}

/// Starts a side at `own`, or any port, with its peer at `peer`.
pub(super) fn start_at(
    own: Option<SocketAddr>,
    side: &str,
    peer: SocketAddr,
    folder: &Path,
    more: &[&str],
) -> Child {
    let own = own.map_or_else(|| "127.0.0.1:0".to_owned(), |own| own.to_string());
    let other = if side == "master" { "slave" } else { "master" };
    Command::new(env!("CARGO_BIN_EXE_dimsart"))
        .args(["run", "--json", "--side", side])
        .args(["--set", &format!("link.{side}_address={own}")])
        .args(["--set", &format!("link.{other}_address={peer}")])
        .arg("--out")
        .arg(folder.join(side))
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

pub(super) fn start(side: &str, peer: SocketAddr, folder: &Path, more: &[&str]) -> Child {
    start_at(None, side, peer, folder, more)
}

pub(super) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

pub(super) fn figures(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_str(text(&output.stdout).lines().last().unwrap()).unwrap()
}
