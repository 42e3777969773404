//! The hand-written master of `firmware/src/by_hand.rs` in an emulated processor.

use std::error::Error;

use cycles::machine::{Machine, Run};
use cycles::timing::Timing;
use dimsart::cycles::Firmware;
use dimsart_core::{Packet, Word};

/// RAM at an address that no image uses.
const MASTER: u32 = 0x2100_0000;
const FRAMES: u32 = 0x2140_0000;
const RECEIVED: u32 = 0x2180_0000;
/// Maximum instructions of each function.
const BYTES: u32 = 0x1000;

const DOF: u32 = 3;
const POSITION: u32 = FRAMES;
const FORCE: u32 = POSITION + 4 * DOF;
const SEND: u32 = FORCE + 4 * DOF;
/// Three numbers and whether the samples are finite.
const HEAD_BYTES: usize = 8;

/// The hand-written master.
pub(crate) struct Hand {
    machine: Machine,
    tick: u32,
}

impl Hand {
    /// Creates it before its first tick.
    pub(crate) fn new(firmware: &Firmware, timing: Timing) -> Result<Self, Box<dyn Error>> {
        let entry = |name: &str| {
            let function = firmware.image.function(name).map(|function| function.address);
            function.ok_or_else(|| {
                format!(
                    "{} lacks {name}: build the image with `cargo board nucleo-g474re,by-hand`",
                    firmware.name
                )
            })
        };
        let (start, tick) = (entry("by_hand_start")?, entry("by_hand_tick")?);
        let mut machine = Machine::new(firmware.image.clone(), timing)?;
        [MASTER, FRAMES, RECEIVED].into_iter().for_each(|address| machine.map(address, BYTES));
        machine.call(start, [MASTER, 0, 0, 0])?;
        Ok(Self { machine, tick })
    }

    /// Runs one tick, with the received packet, if any.
    pub(crate) fn tick(
        &mut self,
        measured: &[Word],
        received: Option<&Packet>,
    ) -> Result<Run, Box<dyn Error>> {
        self.machine.write(POSITION, &bytes(measured.iter().map(|word| word.0)))?;
        if let Some(packet) = received {
            let mut image = head(packet).to_vec();
            image.extend(bytes(packet.words.iter().copied()));
            self.machine.write(RECEIVED, &image)?;
        }
        let received = received.map_or(0, |_| RECEIVED);
        Ok(self.machine.call(self.tick, [MASTER, FRAMES, received, 0])?)
    }

    /// Returns the command of the last tick.
    pub(crate) fn commanded(&self) -> Result<Vec<Word>, Box<dyn Error>> {
        let mut force = [0; 4 * DOF as usize];
        self.machine.read(FORCE, &mut force)?;
        let (words, _) = force.as_chunks::<4>();
        Ok(words.iter().map(|word| Word(u32::from_le_bytes(*word))).collect())
    }

    /// Returns whether the last tick sent this packet.
    pub(crate) fn sent(&self, packet: &Packet) -> Result<bool, Box<dyn Error>> {
        let expected = bytes(packet.words.iter().copied());
        let mut found = vec![0; HEAD_BYTES + expected.len()];
        self.machine.read(SEND, &mut found)?;
        let (found, words) = found.split_at(HEAD_BYTES);
        // Except its finiteness, which the receiver checks.
        Ok(found.iter().zip(&head(packet)).take(6).all(|(found, expected)| found == expected)
            && words == expected)
    }
}

/// Start of a packet in memory. All packets of the simulator are finite.
fn head(packet: &Packet) -> [u8; HEAD_BYTES] {
    let [content, counter, echo] = [packet.content, packet.counter, packet.echo].map(u16::to_le_bytes);
    [content[0], content[1], counter[0], counter[1], echo[0], echo[1], 1, 0]
}

fn bytes(words: impl Iterator<Item = u32>) -> Vec<u8> {
    words.flat_map(u32::to_le_bytes).collect()
}
