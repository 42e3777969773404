//! Coupling of two engines that run at different rates and priorities.
//!
//! Each engine is a [`Dimsart`](crate::Dimsart) with its own device, scheme and safety stage. Data from the
//! other engine are outputs of its device, like sensor values; the commands of a slower engine, such as a
//! trajectory planner, are inputs of its device. So the matching check of each scheme covers the coupling,
//! and commands pass the limits of the slower engine.
//!
//! ```text
//! sensors ─▶ fast: frame ─▶ modules ─▶ safety stage ─▶ actuators
//!              ▲              │ any signals
//!              │ Coupling     ▼ Coupling
//!            safety stage ◀─ modules ◀─ frame :slow
//! ```
//! Neither engine waits for the other: the faster one can interrupt the slower one at any instruction. If new
//! data are missing for too long, [commands are late](Coupling::is_stale) and the device gets its safe value.

mod snapshot;

/// The atomics of [`snapshot`]; `tests/snapshot_orders.rs` replaces them.
mod atomic {
    pub(super) use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};
}

use atomic::{AtomicU8, AtomicU32};
pub use snapshot::{Snapshot, SnapshotReader, SnapshotWriter};

use crate::signal::Word;

/// Default timeout: ticks without new data after which commands are late.
pub const TIMEOUT_TICKS: u32 = 20;

impl<const N: usize> Snapshot<N> {
    /// Creates an empty snapshot.
    #[must_use]
    pub const fn new() -> Self {
        Self::of([const { [const { AtomicU32::new(0) }; N] }; 3], AtomicU8::new(0))
    }
}

impl<const N: usize> Default for Snapshot<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// One engine's end of a coupling.
///
/// ```
/// use dimsart_core::{AxisKind, Coupling, DeviceDescriptor, Dimsart, ProvidedMemory, Snapshot, Word, types};
/// use dimsart_modules::ALL;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // The joint gets DES_POSITION in addition to its own POSITION; the planner gets POSITION and commands DES_POSITION.
/// let axes = [AxisKind::Rotary];
/// let joint = DeviceDescriptor::new("joint", &axes, 0.001, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE])?;
/// let planner = DeviceDescriptor::new("planner", &axes, 0.01, &[types::POSITION], &[types::DES_POSITION])?;
/// let [mut joint, mut planner] = [joint, planner].map(|device| Dimsart::new(ProvidedMemory::leak_default(), device, ALL).expect("it fits"));
/// let (mut there, mut back) = (Snapshot::<1>::new(), Snapshot::<1>::new());
/// let (mut of_joint, mut of_planner) = Coupling::pair(&mut there, &mut back);
///
/// // In the fast interrupt:
/// let (mut measured, mut force) = ([Word::from(0.1), Word(0)], [Word(0)]);
/// of_joint.receive(&mut measured[1..]);
/// joint.set_commands_stale(of_joint.is_stale());
/// joint.tick(&measured, &mut force);
/// of_joint.send(joint.signals(&[types::POSITION.first()]));
///
/// // In the slow interrupt of lower priority:
/// let (mut measured, mut commanded) = ([Word(0)], [Word(0)]);
/// of_planner.receive(&mut measured);
/// planner.set_commands_stale(of_planner.is_stale());
/// planner.tick(&measured, &mut commanded);
/// of_planner.send(commanded);
/// # assert_eq!(measured[0], Word::from(0.1));
/// # Ok(())
/// # }
/// ```
///
/// It sends at most `SEND_WORDS` words and receives at most `RECEIVE_WORDS` words.
#[derive(Debug)]
pub struct Coupling<'a, const SEND_WORDS: usize, const RECEIVE_WORDS: usize> {
    shows: SnapshotWriter<'a, SEND_WORDS>,
    gets: SnapshotReader<'a, RECEIVE_WORDS>,
    /// Ticks since new data; none before the first data.
    silent_ticks: Option<u32>,
    timeout_ticks: u32,
}

impl<'a, const SEND_WORDS: usize, const RECEIVE_WORDS: usize> Coupling<'a, SEND_WORDS, RECEIVE_WORDS> {
    /// Creates the two ends of a coupling over two snapshots. The timeout is [`TIMEOUT_TICKS`].
    #[must_use]
    pub fn pair(
        there: &'a mut Snapshot<SEND_WORDS>,
        back: &'a mut Snapshot<RECEIVE_WORDS>,
    ) -> (Self, Coupling<'a, RECEIVE_WORDS, SEND_WORDS>) {
        let ((shows, gets_there), (shows_back, gets)) = (there.split(), back.split());
        (Self::new(shows, gets), Coupling::new(shows_back, gets_there))
    }

    fn new(shows: SnapshotWriter<'a, SEND_WORDS>, gets: SnapshotReader<'a, RECEIVE_WORDS>) -> Self {
        Self { shows, gets, silent_ticks: None, timeout_ticks: TIMEOUT_TICKS }
    }

    /// Sets the timeout in ticks of this engine, at least 1.
    #[must_use]
    pub fn with_timeout_ticks(self, timeout_ticks: u32) -> Self {
        Self { timeout_ticks: timeout_ticks.max(1), ..self }
    }

    /// Call once before each tick: copies the peer's latest data into these measured words. They stay
    /// unchanged before the first data.
    pub fn receive(&mut self, measured: &mut [Word]) {
        self.silent_ticks = match self.gets.update() {
            true => Some(0),
            false => self.silent_ticks.map(|ticks| ticks.saturating_add(1)),
        };
        if self.silent_ticks.is_some() {
            for (measured, word) in measured.iter_mut().zip(self.gets.words()) {
                *measured = Word(word);
            }
        }
    }

    /// Returns whether new data are missing for too long, or none have arrived yet; pass it to
    /// [`Dimsart::set_commands_stale`](crate::Dimsart::set_commands_stale).
    #[must_use]
    pub fn is_stale(&self) -> bool {
        self.silent_ticks.is_none_or(|ticks| ticks >= self.timeout_ticks)
    }

    /// Call after each tick: sends these words to the peer.
    pub fn send(&mut self, words: impl IntoIterator<Item = Word>) {
        self.shows.write(words.into_iter().map(|word| word.0));
    }
}
