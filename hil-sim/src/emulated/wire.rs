//! Exchange of sections with an emulated board.

use std::fs::File;

use dimsart_core::{AxisKind, DeviceDescriptor, Word};
use dimsart_link::exchange::{self, Frame, Tag};
use dimsart_link::protocol::{KeyBytes, MAX_FRAME_BYTES, Request, RequestSealer, encode_request};

use super::emulator::Emulator;
use super::{EmulatedError, Image};

/// Authentication data of an image [with authentication](Image::is_authenticated).
#[derive(Debug, Clone, Copy)]
pub struct BoardKey {
    /// The key.
    pub bytes: KeyBytes,
    /// Prefix of the board's nonces; both sides of a link need different ones.
    pub salt: u64,
}

/// Data of an exchange.
#[derive(Debug)]
pub(super) struct Wire {
    emulator: Emulator,
    /// Next request.
    pub(super) request: Frame,
    pub(super) answer: Frame,
    /// Packets for the board, including dropped ones.
    pub(super) packets: usize,
    pub(super) has_room: bool,
    /// Session, if the board is locked.
    pub(super) sealer: Option<RequestSealer>,
}

impl Wire {
    pub(super) fn open(
        image: &Image,
        device: &DeviceDescriptor,
        log: Option<File>,
    ) -> Result<Self, EmulatedError> {
        let emulator = Emulator::start(image, log)?;
        let (mut request, answer) = (Frame::new(), Frame::new());
        request.clear();
        let mut wire = Self { emulator, request, answer, packets: 0, has_room: true, sealer: None };
        let kinds: Vec<u8> = device.axes().iter().map(|axis| u8::from(*axis == AxisKind::Rotary)).collect();
        wire.send(Tag::Device, &kinds);
        let ids: Vec<u8> = device.outputs.iter().flat_map(|of| of.id.to_le_bytes()).collect();
        wire.send(Tag::Types, &ids);
        wire.swap()?;
        let hello = wire.sections(|tag| tag == Tag::Hello).next();
        match hello.and_then(<[u8]>::first) {
            Some(&exchange::VERSION) => Ok(wire),
            found => Err(EmulatedError::Version { found: found.copied() }),
        }
    }

    /// Adds a section to the next request; dropped if it does not fit.
    pub(super) fn send(&mut self, tag: Tag, content: &[u8]) {
        let _ = self.request.push(tag, content);
    }

    /// Sends a request on the command line, sealed if required.
    pub(super) fn ask(&mut self, request: &Request, id: u16) {
        let mut buffer = [0; MAX_FRAME_BYTES];
        // The buffer has the maximum size of a frame.
        let frame = match &mut self.sealer {
            Some(sealer) if request.needs_key() => {
                sealer.encode(request, id, &mut buffer).unwrap_or_default()
            }
            _ => encode_request(request, id, &mut buffer).ok(),
        };
        let frame = frame.unwrap_or_default().to_vec();
        self.send(Tag::Command, &frame);
    }

    /// Runs a tick of the board.
    pub(super) fn exchange(&mut self, measured: &[Word]) -> Result<(), EmulatedError> {
        let mut bytes = [0; 4 * dimsart_core::MAX_DEVICE_TYPES * dimsart_core::limits::MAX_DOF];
        for (bytes, word) in bytes.chunks_exact_mut(4).zip(measured) {
            bytes.copy_from_slice(&word.0.to_le_bytes());
        }
        self.send(Tag::Words, bytes.get(..4 * measured.len()).unwrap_or_default());
        self.swap()
    }

    fn swap(&mut self) -> Result<(), EmulatedError> {
        self.emulator.exchange(&self.request, &mut self.answer)?;
        self.request.clear();
        (self.packets, self.has_room) = (0, true);
        // Validates the answer, which is read more than once.
        self.answer.sections().find_map(Result::err).map_or(Ok(()), |error| Err(error.into()))
    }

    /// Contents of the selected sections of the last answer.
    pub(super) fn sections(&self, is_wanted: impl Fn(Tag) -> bool) -> impl Iterator<Item = &[u8]> {
        let is_wanted = move |(tag, content)| is_wanted(tag).then_some(content);
        self.answer.sections().filter_map(Result::ok).filter_map(is_wanted)
    }
}
