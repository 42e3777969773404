//! What the firmware asks of a board, and what a board does when it cannot.

use core::ops::Range;

use dimsart_core::limits::{MAX_DOF, Sizes};
use dimsart_core::{
    AxisKind, Counter, DataType, DriveFault, InputLimits, MAX_PACKET_BYTES, OutputLimits, Scalar as _, Tick,
    Word, types,
};
use dimsart_link::StartCause;
#[cfg(feature = "auth")]
use dimsart_link::auth::Profile;
use dimsart_link::protocol::{Identification, MotorFallback, MotorReport};
use embassy_executor::SendSpawner;
use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;

use crate::listening::Listening;

/// Most bytes that a link brings or takes at once: a packet, with its tag where it has one.
#[cfg(not(feature = "auth"))]
pub const MAX_CARRIED_BYTES: usize = MAX_PACKET_BYTES;
/// Most bytes that a link brings or takes at once: a packet, with its tag where it has one.
#[cfg(feature = "auth")]
pub const MAX_CARRIED_BYTES: usize = MAX_PACKET_BYTES + Profile::Full.overhead();

/// A board and the device on it.
///
/// Functions without `self` are needed before the board is started or after everything else has
/// failed: they must work at any time, from any priority, and use no state that could be in use.
pub trait Board: Sized {
    /// Name, as in the build's feature.
    const NAME: &'static str;
    /// What the board's memory has room for.
    const SIZES: Sizes;
    /// Types that the device measures; at the end what it measures of its ticks, the last ones of [`types::TIMING`] or all.
    const OUTPUTS: &'static [&'static DataType];
    /// Types that the device is commanded by.
    const INPUTS: &'static [&'static DataType] = &[types::DES_FORCE];
    /// What each of them allows, as [`with_limits`](dimsart_core::DeviceDescriptor::with_limits) takes it; empty where
    /// the device is a simulated one.
    const LIMITS: &'static [&'static [InputLimits]] = &[];
    /// What the first of [`OUTPUTS`](Self::OUTPUTS) can show, as
    /// [`with_output_limits`](dimsart_core::DeviceDescriptor::with_output_limits) takes it.
    const OUTPUT_LIMITS: &'static [OutputLimits] = &[];
    /// Packets of all links that can come in between two ticks; what comes beyond them is lost.
    const PACKETS_PER_TICK: usize = Self::SIZES.links + 1;

    /// What interrupts above the tick may take of the processor in the midst of a module's call: the time driver's.
    const SPARE_CYCLES: u32 = 2_000;

    /// Sensors and actuators. Owned by the tick.
    type Joints: Joints;
    /// Where commands come in and answers go out.
    type CommandPort: CommandPort;
    /// Where packets of other controllers come in.
    type LinkIn: LinkIn;
    /// Where packets to other controllers go out.
    type LinkOut: LinkOut;
    /// Flash that schemes are kept in.
    type Flash: NorFlash + 'static;
    /// What the processor does when no task has anything to do.
    type Idle: Idle;

    /// Starts clocks, pins, time driver and the two executors, and hands out the parts. Called once.
    ///
    /// The actuators are in their safe state afterwards. What keeps the device from being controlled at
    /// all is a panic with the reason: the panic handler brings the device to rest and reports it.
    fn start() -> Parts<Self>;

    /// [`OUTPUTS`](Self::OUTPUTS), once the board is [started](Self::start) and has learned what its device measures.
    #[must_use]
    fn outputs() -> &'static [&'static DataType] {
        Self::OUTPUTS
    }

    /// Puts the actuators into their safe state: no force, power stage off.
    ///
    /// Cannot fail and cannot wait. It stays that way until [`Joints::write`] is called again.
    fn disarm();

    /// A free-running counter of the processor's clock.
    fn counter() -> Counter;

    /// What 1024 instructions take by the [`counter`](Self::counter), on an emulated board: it has no cycles, and its counter
    /// counts the emulator's time. 0 where that counts the processor's cycles.
    fn counts_per_1024_instructions() -> u32 {
        0
    }

    /// Shows what the tick has left in the Data Base to whoever looks on: its revision and the words of every
    /// signal. Called after every tick; a board that nobody looks at does nothing.
    fn show(_revision: u32, _words: impl Iterator<Item = u32>) {}

    /// Keeps the watchdog from resetting the board.
    fn feed_watchdog();

    /// Why the board has started. Called once, early.
    fn start_cause() -> StartCause {
        StartCause::Unknown
    }

    /// Starts the board over, after a panic or a fault was reported. An emulated board whose clock is its host: ends it.
    fn reset() -> !;
}

/// What moves on each axis.
pub type Axes = heapless::Vec<AxisKind, MAX_DOF, u8>;

/// What a device's inputs allow and its outputs can show.
#[derive(Clone, Copy)]
pub struct Limits {
    /// As [`Board::LIMITS`].
    pub inputs: &'static [&'static [InputLimits]],
    /// As [`Board::OUTPUT_LIMITS`].
    pub outputs: &'static [OutputLimits],
}

/// What a started board is made of.
pub struct Parts<B: Board> {
    /// What moves on each axis of the device.
    pub axes: Axes,
    /// Runs tasks above everything but the time driver: the tick.
    pub tick: SendSpawner,
    /// Runs tasks below the tick: commands, telemetry, links.
    pub background: SendSpawner,
    /// Sensors and actuators.
    pub joints: B::Joints,
    /// Where commands come in and answers go out.
    pub command_port: B::CommandPort,
    /// Where packets come in.
    pub link_in: B::LinkIn,
    /// Where packets go out.
    pub link_out: B::LinkOut,
    /// Where schemes are kept; none on a board that has no place for them.
    pub storage: Option<Storage<B::Flash>>,
    /// What the processor does when no task has anything to do.
    pub idle: B::Idle,
}

/// Flash to keep schemes in.
pub struct Storage<F> {
    /// The flash. It may wait in the background, but never holds up what is above it, unless it
    /// [stalls the tick](Self::stalls_tick).
    pub flash: F,
    /// The part to be used: whole pages, two at least, and none of the image's.
    pub range: Range<u32>,
    /// The part that a key is kept in: two whole pages, and none of the image's or the schemes'.
    #[cfg(feature = "auth")]
    pub keys: Range<u32>,
    /// Whether the processor stands still while the flash is written.
    pub stalls_tick: bool,
}

/// Sensors and actuators, in SI units and in the layout of the device's types.
pub trait Joints: Send + 'static {
    /// Reads every sensor, in the order of the descriptor's outputs. Takes bounded time and never waits.
    ///
    /// `measured` ends before those of [`types::TIMING`] that the device has: the tick
    /// measures these itself.
    ///
    /// A sensor that could not be read gives NaN: the tick is refused and the device gets its safe value.
    fn read(&mut self, measured: &mut [Word]);

    /// Whether they have a drive whose configuration the board can keep: then they have all of the next four functions.
    const HAS_DRIVE: bool = false;

    /// Begins, once, before the first tick. `motor` is what is kept of the drive's configuration; it says then what the drive
    /// runs by. Gives the device's limits where they follow from that, and are not the board's.
    fn begin(&mut self, _motor: &mut MotorReport) -> Option<Limits> {
        None
    }

    /// Says whether the next start would take a drive's configuration.
    ///
    /// # Errors
    /// Why not.
    fn check_motor(_layout: u16, _words: &[u32]) -> Result<(), MotorFallback> {
        Err(MotorFallback::Layout)
    }

    /// Has the drive find out about its motor with this current, `A`, as long as motion is allowed.
    fn identify(_current_a: f32) {}

    /// How that stands.
    fn identification() -> Identification {
        Identification::None
    }

    /// Why the bridge of the joints' drive is off, as of the last [`read`](Self::read); none while nothing is wrong.
    fn fault(&self) -> Option<DriveFault> {
        None
    }

    /// Commands every actuator, in the order of the descriptor's inputs. Takes bounded time and never
    /// waits.
    ///
    /// `commanded` is what the safety stage decided, finite, and drives the actuators whatever `tick` is: a safe value
    /// may be reached by and by. A power stage is on only while [`is_driven`].
    /// An actuator that does not follow shows up in its sensors, or disarms itself.
    fn write(&mut self, tick: Tick, commanded: &[Word]);
}

/// A byte stream to a host. Bytes that arrive faster than they are read are lost: the protocol above
/// finds that out. Errors of the line are the same loss and are not reported.
pub trait CommandPort: Read + Write + Send + 'static {}

/// Whether a power stage has something to do: the scheme commands, or the way to zero is not over.
#[must_use]
pub fn is_driven(tick: Tick, commanded: &[Word]) -> bool {
    matches!(tick, Tick::Ran) || commanded.iter().any(|word| f32::from_word(*word) != 0.0)
}

/// Packets that come in over the device's links.
pub trait LinkIn: Send + 'static {
    /// Waits for a packet on any link; gives the link's number and the packet's length in `packet`.
    ///
    /// What the line damaged is dropped or handed on as it is: packets carry a CRC. So is what comes on another
    /// channel than is listened to, as far as the medium tells channels apart. A wait that is given up loses nothing.
    fn receive(
        &mut self,
        listening: &Listening,
        packet: &mut [u8; MAX_CARRIED_BYTES],
    ) -> impl Future<Output = (usize, usize)>;
}

/// Packets that go out over the device's links.
pub trait LinkOut: Send + 'static {
    /// Sends a packet of a channel over link `link`. What cannot be sent, or has no such link, is dropped: a
    /// packet that comes late is worth less than the next one.
    fn send(&mut self, link: usize, channel: u16, packet: &[u8]) -> impl Future<Output = ()>;
}

/// What runs below every task.
pub trait Idle {
    /// Waits for interrupts, for ever.
    fn run(self) -> !;
}
