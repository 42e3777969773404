//! A controller on an emulated board: one exchange per tick.

use std::fs::File;

use dimsart_core::{AxisKind, DeviceDescriptor, TickResult, Word};
use dimsart_link::exchange::{self, Frame, MAX_PACKETS, Tag};
use dimsart_link::protocol::{
    KeyBytes, LeaseAction, MAX_FRAME_BYTES, Request, RequestSealer, encode_request, request_id,
};

use super::emulator::Emulator;
use super::upload::{self, CLIENT, Layout};
use super::{EmulatedError, Image, NS_PER_INSTRUCTION};
use crate::rig::{RemoteController, RemoteError, SimulatedDimsart};

/// Ticks between renewals of the lease, half of its duration.
const RENEWAL_TICKS: u32 = 100;
/// Clock frequency of the board's processor, 25 MHz.
const NS_PER_CYCLE: u64 = 40;

/// A controller that runs as firmware on an emulated board, in lockstep with this process.
///
/// It runs the scheme of a controller in this process, its *copy*, which is never ticked: the copy's Data Base
/// mirrors the board's after every tick.
#[derive(Debug)]
pub struct Board {
    wire: Wire,
    layout: Layout,
    /// Ticks until the lease is renewed.
    ticks_to_renewal: u32,
    /// Motion flag of the next request.
    lease: LeaseAction,
    /// Cycle counter at the start of the tick before the last one.
    began: Option<u32>,
}

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
    request: Frame,
    answer: Frame,
    /// Packets for the board, including dropped ones.
    packets: usize,
    has_room: bool,
    /// Session, if the board is locked.
    pub(super) sealer: Option<RequestSealer>,
}

impl Board {
    /// Starts the image with the scheme of `copy` for a device with the same axes. The firmware's log is written to
    /// `log`. With a key, the board is locked and authenticates its links; the image must support this.
    ///
    /// # Errors
    /// [`EmulatedError`]; no process remains.
    pub fn start(
        image: &Image,
        copy: &mut SimulatedDimsart,
        key: Option<BoardKey>,
        log: Option<File>,
    ) -> Result<Self, EmulatedError> {
        let device = copy.engine().device().clone();
        let mut wire = Wire::open(image, &device, log)?;
        let layout = upload::upload(&mut wire, copy, key)?;
        Ok(Self { wire, layout, ticks_to_renewal: 0, lease: LeaseAction::Take, began: None })
    }
}

impl RemoteController for Board {
    /// A tick accepts at most [`MAX_PACKETS`]; with more it fails, so that no packet is lost silently.
    fn receive(&mut self, link: usize, bytes: &[u8]) {
        if let Some(tag) = Tag::of_link(link) {
            let Wire { request, packets, has_room, .. } = &mut self.wire;
            *packets += 1;
            *has_room &= *packets <= MAX_PACKETS && request.push(tag, bytes).is_ok();
        }
    }

    fn tick(
        &mut self,
        measured: &[Word],
        commanded: &mut [Word],
        copy: &mut SimulatedDimsart,
    ) -> Result<TickResult, RemoteError> {
        Ok(self.exchange(measured, commanded, copy)?)
    }

    fn is_authenticated(&self) -> bool {
        self.wire.sealer.is_some()
    }

    fn outgoing(&self, link: usize) -> Box<dyn Iterator<Item = &[u8]> + '_> {
        Box::new(self.wire.sections(move |tag| tag.link() == Some(link)))
    }

    /// Accuracy 1e-5, as measured by the emulator's time.
    fn instructions(&self) -> Option<u32> {
        let [before, after, mask] = self.stamps()?;
        instructions(after.wrapping_sub(before) & mask)
    }

    /// Including the exchange with the host; `None` before the second tick.
    fn instructions_of_all(&self) -> Option<u32> {
        let [before, _, mask] = self.stamps()?;
        instructions(before.wrapping_sub(self.began?) & mask)
    }

    fn command_bytes(&self) -> Box<dyn Iterator<Item = &[u8]> + '_> {
        Box::new(self.wire.sections(|tag| tag == Tag::Command))
    }

    fn send_command_bytes(&mut self, bytes: &[u8]) {
        self.wire.send(Tag::Command, bytes);
    }
}

impl Board {
    fn exchange(
        &mut self,
        measured: &[Word],
        commanded: &mut [Word],
        copy: &mut SimulatedDimsart,
    ) -> Result<TickResult, EmulatedError> {
        self.keep_lease();
        self.began = self.stamps().map(|[before, _, _]| before);
        let Self { wire, layout, .. } = self;
        if !wire.has_room {
            return Err(EmulatedError::TooManyPackets { found: wire.packets });
        }
        wire.send(Tag::Signals, &[]);
        wire.exchange(measured)?;
        let mut tick = None;
        for section in wire.answer.sections() {
            match section? {
                (Tag::Outcome, content) => tick = exchange::outcome(content)?,
                (Tag::Words, content) => {
                    let expected = 4 * commanded.len();
                    if content.len() != expected {
                        let found = content.len();
                        return Err(EmulatedError::UnexpectedAnswer {
                            what: "commanded words",
                            expected,
                            found,
                        });
                    }
                    for (word, bits) in commanded.iter_mut().zip(words(content)) {
                        *word = Word(bits);
                    }
                }
                (Tag::Signals, content) => layout.show(content, copy)?,
                _ => {}
            }
        }
        tick.ok_or(EmulatedError::NoAnswer { ticks: 1 })
    }

    /// Renews the lease in time; without a lease the board returns [`TickResult::Disarmed`].
    fn keep_lease(&mut self) {
        if self.ticks_to_renewal == 0 {
            self.wire.ask(&Request::Lease(self.lease), request_id(CLIENT, 0));
            (self.ticks_to_renewal, self.lease) = (RENEWAL_TICKS, LeaseAction::Renew);
        }
        self.ticks_to_renewal -= 1;
    }

    /// Cycle counter before and after the last tick, and its valid bits.
    fn stamps(&self) -> Option<[u32; 3]> {
        let stamps = self.wire.sections(|tag| tag == Tag::Stamps).next()?;
        let mut cycles = words(stamps);
        let mask = u32::MAX.checked_shr(32 - u32::from(*stamps.get(8)?))?;
        Some([cycles.next()?, cycles.next()?, mask])
    }
}

impl Wire {
    fn open(image: &Image, device: &DeviceDescriptor, log: Option<File>) -> Result<Self, EmulatedError> {
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

fn instructions(cycles: u32) -> Option<u32> {
    u32::try_from(u64::from(cycles) * NS_PER_CYCLE / NS_PER_INSTRUCTION).ok()
}

/// Converts bytes to words.
pub(super) fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word))
}
