//! Bidirectional pipe within a process, equivalent to a serial line.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::time::Duration;

/// Maximum queued writes; further writes fail with `WouldBlock`.
pub const MAX_QUEUED_WRITES: usize = 1024;

/// One end. A read without data ends after its timeout with `WouldBlock`; it returns 0 if the other end is closed.
#[derive(Debug)]
pub struct Pipe {
    /// Outgoing bytes.
    pub writer: PipeWriter,
    /// Incoming bytes.
    pub reader: PipeReader,
}

/// Sender.
#[derive(Debug, Clone)]
pub struct PipeWriter(SyncSender<Vec<u8>>);

/// Receiver.
#[derive(Debug)]
pub struct PipeReader {
    chunks: Receiver<Vec<u8>>,
    /// Unread rest of the last chunk.
    rest: Vec<u8>,
    wait: Duration,
}

/// Creates two ends with this read timeout.
#[must_use]
pub fn pair(waits: [Duration; 2]) -> [Pipe; 2] {
    pair_with_capacities(waits, [MAX_QUEUED_WRITES; 2])
}

/// Like `pair`, with this capacity of queued writes.
#[must_use]
pub fn pair_with_capacities(waits: [Duration; 2], rooms: [usize; 2]) -> [Pipe; 2] {
    let way = |wait, room| {
        let (sender, chunks) = sync_channel(room);
        (PipeWriter(sender), PipeReader { chunks, rest: Vec::new(), wait })
    };
    let ([first_wait, second_wait], [first_room, second_room]) = (waits, rooms);
    let (to_first, from_second) = way(first_wait, first_room);
    let (to_second, from_first) = way(second_wait, second_room);
    [Pipe { writer: to_second, reader: from_second }, Pipe { writer: to_first, reader: from_first }]
}

impl Read for PipeReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let next = match self.wait.is_zero() {
                true => self.chunks.try_recv().map_err(|error| error == TryRecvError::Disconnected),
                false => {
                    let received = self.chunks.recv_timeout(self.wait);
                    received.map_err(|error| error == RecvTimeoutError::Disconnected)
                }
            };
            match next {
                Ok(chunk) => self.rest = chunk,
                Err(true) => return Ok(0),
                Err(false) => return Err(ErrorKind::WouldBlock.into()),
            }
        }
        let mut taken = self.rest.as_slice();
        let count = taken.read(buffer)?;
        self.rest.drain(..count);
        Ok(count)
    }
}

impl Write for PipeWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.0.try_send(bytes.to_vec()) {
            Ok(()) => Ok(bytes.len()),
            Err(TrySendError::Full(_)) => Err(ErrorKind::WouldBlock.into()),
            Err(TrySendError::Disconnected(_)) => Err(ErrorKind::BrokenPipe.into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_in_at_one_end_comes_out_at_the_other_in_any_pieces() {
        let [mut near, mut far] = pair([Duration::ZERO; 2]);
        near.write_all(b"abc").unwrap();
        near.write_all(b"de").unwrap();
        let mut buffer = [0; 2];
        let mut read = || {
            let count = far.read(&mut buffer).unwrap();
            String::from_utf8(buffer[..count].to_vec()).unwrap()
        };
        assert_eq!([read(), read(), read()], ["ab", "c", "de"]);
        far.write_all(b"x").unwrap();
        assert_eq!((near.read(&mut buffer).unwrap(), buffer[0]), (1, b'x'));
    }

    #[test]
    fn nothing_yet_is_told_from_nothing_any_more() {
        let [mut near, far] = pair([Duration::from_millis(1), Duration::ZERO]);
        assert_eq!(near.read(&mut [0]).unwrap_err().kind(), ErrorKind::WouldBlock);
        drop(far);
        assert_eq!(near.read(&mut [0]).unwrap(), 0);
        assert_eq!(near.write(b"x").unwrap_err().kind(), ErrorKind::BrokenPipe);
    }

    #[test]
    fn who_reads_nothing_holds_nobody_up() {
        let [mut near, _far] = pair([Duration::ZERO; 2]);
        let written = (0..2 * MAX_QUEUED_WRITES).filter(|_| near.write(b"x").is_ok()).count();
        assert_eq!(written, MAX_QUEUED_WRITES);
    }
}
