//! Two engines that work together, each at its own rate and priority.
//!
//! Each is a [`Dimsart`](crate::Dimsart) of its own, with a device, a scheme and a safety stage. What one of them gets
//! from the other one is among its device's outputs, as what sensors measure is; what a slower one, such as a trajectory
//! planner or the coordinator of an arm, commands is among its device's inputs. So the check of each scheme sees all there
//! is to see, and what crosses has been through the slower one's limits.
//!
//! ```text
//! sensors ─▶ fast: frame ─▶ modules ─▶ safety stage ─▶ actuators
//!              ▲              │ any signals
//!              │ Coupling     ▼ Coupling
//!            safety stage ◀─ modules ◀─ frame :slow
//! ```
//! Neither waits for the other one: the faster can interrupt the slower at any instruction. One that gets nothing new for
//! too long has [late commands](Coupling::are_late): its device gets its safe value.

mod snapshot;

/// What [`snapshot`] is made of; where it is checked there are others.
mod atomic {
    pub(super) use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};
}

use atomic::{AtomicU8, AtomicU32};
pub use snapshot::{Snapshot, SnapshotReader, SnapshotWriter};

use crate::signal::Word;

/// Ticks without anything new after which commands are late, unless told otherwise.
pub const TIMEOUT_TICKS: u32 = 20;

impl<const N: usize> Snapshot<N> {
    /// Without anything written yet.
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

/// One engine's end of what crosses.
///
/// ```
/// use dimsart_core::{AxisKind, Coupling, DeviceDescriptor, Dimsart, ProvidedMemory, Snapshot, Word, types};
/// use dimsart_modules::ALL;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // The joint gets DES_POSITION beside what its encoder measures; the planner gets POSITION and commands DES_POSITION.
/// let axes = [AxisKind::Rotary];
/// let joint = DeviceDescriptor::new("joint", &axes, 0.001, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE])?;
/// let planner = DeviceDescriptor::new("planner", &axes, 0.01, &[types::POSITION], &[types::DES_POSITION])?;
/// let [mut joint, mut planner] = [joint, planner].map(|device| Dimsart::new(ProvidedMemory::leaked(), device, ALL).expect("it fits"));
/// let (mut there, mut back) = (Snapshot::<1>::new(), Snapshot::<1>::new());
/// let (mut of_joint, mut of_planner) = Coupling::pair(&mut there, &mut back);
///
/// // In the fast interrupt:
/// let (mut measured, mut force) = ([Word::from(0.1), Word(0)], [Word(0)]);
/// of_joint.get(&mut measured[1..]);
/// joint.hold_back(of_joint.are_late());
/// joint.tick(&measured, &mut force);
/// of_joint.show(joint.signals(&[types::POSITION.first()]));
///
/// // In the slow one, below it:
/// let (mut measured, mut commanded) = ([Word(0)], [Word(0)]);
/// of_planner.get(&mut measured);
/// planner.hold_back(of_planner.are_late());
/// planner.tick(&measured, &mut commanded);
/// of_planner.show(commanded);
/// # assert_eq!(measured[0], Word::from(0.1));
/// # Ok(())
/// # }
/// ```
///
/// It shows the other one `SHOWS` words at most, and gets `GETS` words at most.
#[derive(Debug)]
pub struct Coupling<'a, const SHOWS: usize, const GETS: usize> {
    shows: SnapshotWriter<'a, SHOWS>,
    gets: SnapshotReader<'a, GETS>,
    /// Since something new came; none before anything did.
    silent_ticks: Option<u32>,
    timeout_ticks: u32,
}

impl<'a, const SHOWS: usize, const GETS: usize> Coupling<'a, SHOWS, GETS> {
    /// One engine's end and the other one's, over what lies between them. Commands are late after [`TIMEOUT_TICKS`].
    #[must_use]
    pub fn pair(
        there: &'a mut Snapshot<SHOWS>,
        back: &'a mut Snapshot<GETS>,
    ) -> (Self, Coupling<'a, GETS, SHOWS>) {
        let ((shows, gets_there), (shows_back, gets)) = (there.split(), back.split());
        (Self::new(shows, gets), Coupling::new(shows_back, gets_there))
    }

    fn new(shows: SnapshotWriter<'a, SHOWS>, gets: SnapshotReader<'a, GETS>) -> Self {
        Self { shows, gets, silent_ticks: None, timeout_ticks: TIMEOUT_TICKS }
    }

    /// Ticks, of this engine, without anything new after which commands are late; at least 1.
    #[must_use]
    pub fn with_timeout_ticks(self, timeout_ticks: u32) -> Self {
        Self { timeout_ticks: timeout_ticks.max(1), ..self }
    }

    /// Before a tick, once: puts what the other one showed last into these words of what is measured. They stay as they
    /// are while nothing has come yet.
    pub fn get(&mut self, measured: &mut [Word]) {
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

    /// Whether nothing new has come for too many ticks, or nothing at all yet: for
    /// [`Dimsart::hold_back`](crate::Dimsart::hold_back).
    #[must_use]
    pub fn are_late(&self) -> bool {
        self.silent_ticks.is_none_or(|ticks| ticks >= self.timeout_ticks)
    }

    /// After a tick: shows the other one these words.
    pub fn show(&mut self, words: impl IntoIterator<Item = Word>) {
        self.shows.write(words.into_iter().map(|word| word.0));
    }
}
