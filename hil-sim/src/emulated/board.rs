//! A controller on an emulated board: one exchange per tick.

use std::fs::File;

use dimsart_core::{TickResult, Word};
use dimsart_link::exchange::{self, MAX_PACKETS, Tag};
use dimsart_link::protocol::{LeaseAction, Request, request_id};

use super::upload::{self, CLIENT, Layout};
use super::wire::{BoardKey, Wire};
use super::{EmulatedError, Image, NS_PER_INSTRUCTION, words};
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

fn instructions(cycles: u32) -> Option<u32> {
    u32::try_from(u64::from(cycles) * NS_PER_CYCLE / NS_PER_INSTRUCTION).ok()
}
