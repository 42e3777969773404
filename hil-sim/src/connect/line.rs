//! One question, one answer, over a line that may lose either.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use dimsart_core::protocol::{
    Counters, DecodeError, MAX_FRAME_BYTES, PROTOCOL_VERSION, Receiver, Request, Response, client_of,
    decode_response, encode_request, request_id,
};
use dimsart_core::{Command, Target, Value, Verb};

use super::unasked::Unasked;

/// How long an answer is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// For each try.
    pub timeout: Duration,
    /// How often a request is sent at most.
    pub tries: u32,
}

impl Default for Patience {
    fn default() -> Self {
        Self { timeout: Duration::from_millis(500), tries: 3 }
    }
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// Nothing that answers.
    #[error("no answer: sent {tries} times, waited {} s each; {}", timeout.as_secs_f64(), heard(*bytes, *frames))]
    NoAnswer {
        /// How often it was asked.
        tries: u32,
        /// For each try.
        timeout: Duration,
        /// Bytes that came since the line was opened.
        bytes: u64,
        /// Whole frames among them.
        frames: u32,
    },
    /// A command that must not be given twice, so it was sent once.
    #[error(
        "no answer to the command in {} s; the line lost it or its answer, so it may have been carried out: look with \
         `show` before you give it again",
        timeout.as_secs_f64()
    )]
    Unsure {
        /// How long was waited.
        timeout: Duration,
    },
    /// A version that this one does not know.
    #[error(
        "the device's answer is not understood: this command speaks protocol {PROTOCOL_VERSION} and the device another \
         one; use the `dimsart` that the image was built with"
    )]
    NotUnderstood,
    /// The other end is gone.
    #[error("the device closed the line: was it reset or unplugged, did the emulator end? Connect again")]
    Closed,
    /// Anything else.
    #[error("the line failed: {0}; check the cable and connect again")]
    Io(io::Error),
}

fn heard(bytes: u64, frames: u32) -> String {
    match (bytes, frames) {
        (0, _) => {
            "nothing came back at all: is the board powered, does it run a DIMSART image, is this the right \
                   port, are RX and TX crossed?"
                .to_owned()
        }
        (_, 0) => format!(
            "{bytes} bytes came back and no whole frame: give the image's own baud rate with --baud, or another port"
        ),
        _ => format!(
            "{frames} whole frames came before: the line loses bytes or another program reads them; wait longer with \
             --timeout-s"
        ),
    }
}

/// A line to a device: requests out, their answers in.
#[derive(Debug)]
pub struct Line<S> {
    stream: S,
    patience: Patience,
    receiver: Receiver,
    bytes: u64,
    id: u16,
    content: Vec<u8>,
    unasked: Unasked,
}

impl<S: Read + Write> Line<S> {
    /// A line over an open stream without a buffer whose reads end soon; see [`Stream`](super::Stream).
    pub fn new(stream: S, patience: Patience) -> Self {
        // The system's own randomness: not what another host on the line draws, nor an earlier program here.
        let [number, client, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
        let id = request_id(client.max(1), number);
        let (receiver, content) = (Receiver::new(), Vec::new());
        Self { stream, patience, receiver, bytes: 0, id, content, unasked: Unasked::new() }
    }

    /// This host's number on the line, from 1.
    pub(super) fn client(&self) -> u8 {
        client_of(self.id)
    }

    /// Id of the last request.
    pub(super) fn last_id(&self) -> u16 {
        self.id
    }

    /// What the device said by itself.
    pub(super) fn unasked(&self) -> &Unasked {
        &self.unasked
    }

    pub(super) fn unasked_mut(&mut self) -> &mut Unasked {
        &mut self.unasked
    }

    /// Gives back how patient it was before.
    pub(super) fn set_patience(&mut self, patience: Patience) -> Patience {
        std::mem::replace(&mut self.patience, patience)
    }

    /// Takes in what comes unasked, for some time.
    pub(super) fn listen(&mut self, time: Duration) -> Result<(), LineError> {
        self.read_until(Instant::now() + time, None).map(drop)
    }

    /// Sends a request and gives the answer with its id; other frames and noise are passed over.
    ///
    /// It is sent again when no answer comes, unless it is a command that does something else the second
    /// time.
    ///
    /// # Errors
    /// [`LineError`]; after [`LineError::Unsure`] the command may have been carried out, otherwise the
    /// line can be used on.
    pub fn ask(&mut self, request: &Request) -> Result<Response<'_>, LineError> {
        let [number, client] = self.id.to_le_bytes();
        self.id = request_id(client, number.wrapping_add(1));
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = encode_request(request, self.id, &mut buffer)
            .map_err(|_| LineError::Io(ErrorKind::InvalidInput.into()))?;
        let may_repeat = may_repeat(request);
        let tries = if may_repeat { self.patience.tries.max(1) } else { 1 };
        for _ in 0..tries {
            match self.stream.write_all(frame) {
                // The line takes nothing more: as lost as if it did.
                Err(error) if is_nothing_yet(error.kind()) => {}
                result => result.map_err(failed)?,
            }
            if self.read_until(Instant::now() + self.patience.timeout, Some(self.id))? {
                return decode_response(&self.content)
                    .map(|(_, response)| response)
                    .map_err(|_| LineError::NotUnderstood);
            }
        }
        let timeout = self.patience.timeout;
        let Counters { frames, .. } = self.receiver.counters();
        Err(match may_repeat {
            true => LineError::NoAnswer { tries, timeout, bytes: self.bytes, frames },
            false => LineError::Unsure { timeout },
        })
    }

    /// Puts the answer to `id` into `content`; false when it does not come in time.
    fn read_until(&mut self, deadline: Instant, id: Option<u16>) -> Result<bool, LineError> {
        let Self { stream, receiver, bytes, content: answer, unasked, .. } = self;
        let mut buffer = [0; 1024];
        while Instant::now() < deadline {
            let count = match stream.read(&mut buffer) {
                Ok(0) => return Err(LineError::Closed),
                Ok(count) => count,
                Err(error) if is_nothing_yet(error.kind()) => continue,
                Err(error) => return Err(failed(error)),
            };
            let mut is_there = false;
            *bytes += u64::try_from(count).unwrap_or_default();
            receiver.take_all(buffer.get(..count).unwrap_or_default(), |content| {
                match answers(content) {
                    None => unasked.take(content),
                    found if found == id => {
                        is_there = true;
                        content.clone_into(answer);
                    }
                    // To another client, or an earlier request.
                    Some(_) => {}
                }
            });
            if is_there {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// The id of an answer, understood or not; none for other frames.
fn answers(content: &[u8]) -> Option<u16> {
    match decode_response(content) {
        Ok((id, _)) | Err(DecodeError::NotUnderstood { id }) => Some(id),
        Err(DecodeError::OtherClass) => None,
    }
}

fn is_nothing_yet(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn failed(error: io::Error) -> LineError {
    match error.kind() {
        ErrorKind::BrokenPipe | ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted => {
            LineError::Closed
        }
        _ => LineError::Io(error),
    }
}

/// Whether a request given twice comes to the same as given once.
///
/// A module cannot be plugged in, out or closed twice, and a type that is added twice is in the list
/// twice.
fn may_repeat(request: &Request) -> bool {
    let Request::Command(Command { module, param, value, .. }) = request else { return true };
    match module {
        Target::Engine => ![Verb::ModOn, Verb::ModOff, Verb::ModClose].map(|verb| verb as u8).contains(param),
        Target::Module(_) => *param >= dimsart_core::PORT || !matches!(value, Value::Type(_)),
    }
}
