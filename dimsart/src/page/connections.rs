//! Connections of browsers: limited in number and time, to keep file descriptors free for a STOP.
//!
//! When the limit is reached, the oldest connection without a WebSocket is closed for a new one.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::time::{Sleep, sleep};

use crate::broker::accepting::{self, AcceptFailures};

/// Maximum number of connections, far below the limit of open files.
const MAX_CONNECTIONS: usize = 64;
/// Maximum duration of a connection without a WebSocket.
const REQUEST_TIME: Duration = Duration::from_secs(10);

/// Accepts browsers.
#[derive(Debug)]
pub(super) struct Connections {
    listener: TcpListener,
    /// Oldest first: sender that closes it, and whether it has a WebSocket.
    open: VecDeque<(oneshot::Sender<()>, HasSocket)>,
    failures: AcceptFailures,
}

/// Whether a connection has become a WebSocket.
#[derive(Debug, Clone, Default)]
pub(super) struct HasSocket(Arc<AtomicBool>);

impl HasSocket {
    /// Removes the time limit: for a WebSocket, or a request that takes time and closes the connection.
    pub(super) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn get(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Connected<IncomingStream<'_, Connections>> for HasSocket {
    fn connect_info(stream: IncomingStream<'_, Connections>) -> Self {
        stream.io().has_socket.clone()
    }
}

impl Connections {
    pub(super) fn new(listener: TcpListener) -> Self {
        Self { listener, open: VecDeque::new(), failures: AcceptFailures::default() }
    }

    /// Admits a new connection; `None` if every open connection has a WebSocket.
    fn admit<S>(&mut self, stream: S, time: Duration) -> Option<Connection<S>> {
        self.open.retain(|(close, _)| !close.is_closed());
        if self.open.len() >= MAX_CONNECTIONS && !self.close_oldest() {
            return None;
        }
        let (close, closed) = oneshot::channel();
        let has_socket = HasSocket::default();
        self.open.push_back((close, has_socket.clone()));
        Some(Connection { stream, closed, has_socket, deadline: Box::pin(sleep(time)), is_over: false })
    }

    /// Closes the oldest connection without a WebSocket; returns false if all have one.
    fn close_oldest(&mut self) -> bool {
        let oldest = self.open.iter().position(|(_, has_socket)| !has_socket.get());
        let close = oldest.and_then(|oldest| self.open.remove(oldest));
        // It may be closed already.
        close.map(|(close, _)| close.send(())).is_some()
    }
}

impl Listener for Connections {
    type Io = Connection<TcpStream>;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Self::Io, Self::Addr) {
        loop {
            match self.listener.accept().await {
                Ok((stream, address)) => {
                    self.failures.end();
                    if let Some(connection) = self.admit(stream, REQUEST_TIME) {
                        // Let a closed connection release its file descriptor before the next accept.
                        tokio::task::yield_now().await;
                        return (connection, address);
                    }
                }
                Err(error) => {
                    if let Some(report) = self.failures.report("page", &error) {
                        eprintln!("dimsart: {report}");
                    }
                    self.close_oldest();
                    sleep(accepting::PAUSE).await;
                }
            }
        }
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        self.listener.local_addr()
    }
}

/// A connection with a time limit.
#[derive(Debug)]
pub(super) struct Connection<S> {
    stream: S,
    closed: oneshot::Receiver<()>,
    has_socket: HasSocket,
    deadline: Pin<Box<Sleep>>,
    is_over: bool,
}

impl<S> Connection<S> {
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        if !self.is_over && !self.has_socket.get() {
            self.is_over = Pin::new(&mut self.closed).poll(context).is_ready()
                || self.deadline.as_mut().poll(context).is_ready();
        }
        if self.is_over { Err(ErrorKind::TimedOut.into()) } else { Ok(()) }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Connection<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Connection<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::{AsyncReadExt as _, DuplexStream, duplex};

    fn run<T>(test: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(test)
    }

    /// Whether a connection without bytes to read is closed.
    async fn is_closed(connection: &mut Connection<DuplexStream>) -> bool {
        let mut byte = [0];
        tokio::select! {
            biased;
            read = connection.read(&mut byte) => read.is_err(),
            () = std::future::ready(()) => false,
        }
    }

    #[test]
    fn the_oldest_idle_connections_make_room_and_websockets_stay() {
        run(async {
            let mut connections = Connections::new(TcpListener::bind("127.0.0.1:0").await.unwrap());
            let (mut open, mut peers) = (Vec::new(), Vec::new());
            for number in 0..1100 {
                let (near, far) = duplex(8);
                peers.push(near);
                let connection = connections.admit(far, Duration::from_secs(3600)).unwrap();
                if number == 0 {
                    connection.has_socket.set();
                }
                open.push(connection);
            }
            assert!(connections.open.len() <= MAX_CONNECTIONS);
            let last = open.len() - MAX_CONNECTIONS + 1;
            for (number, connection) in open.iter_mut().enumerate() {
                assert_eq!(is_closed(connection).await, (1..last).contains(&number), "{number}");
            }
        });
    }

    #[test]
    fn a_connection_that_has_sent_no_request_in_time_is_closed() {
        run(async {
            let mut connections = Connections::new(TcpListener::bind("127.0.0.1:0").await.unwrap());
            let (_near, far) = duplex(8);
            let mut connection = connections.admit(far, Duration::ZERO).unwrap();
            assert_eq!(connection.read(&mut [0]).await.unwrap_err().kind(), ErrorKind::TimedOut);
            let (_near, far) = duplex(8);
            let mut connection = connections.admit(far, Duration::ZERO).unwrap();
            connection.has_socket.set();
            assert!(!is_closed(&mut connection).await, "a WebSocket has no time limit");
        });
    }
}
