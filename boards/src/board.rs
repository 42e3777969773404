//! The interface between the firmware and a board.

use core::ops::Range;

use dimsart_core::limits::{Capacities, MAX_DOF};
use dimsart_core::{
    AxisKind, Counter, DataType, DriveFault, InputLimits, MAX_PACKET_BYTES, OutputLimits, Scalar as _,
    TickResult, Word, types,
};
use dimsart_link::StartCause;
#[cfg(feature = "auth")]
use dimsart_link::auth::Profile;
use dimsart_link::protocol::{Identification, MotorFallback, MotorReport};
use embassy_executor::SendSpawner;
use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;

use crate::receive_channels::ReceiveChannels;

/// Maximum bytes per transfer of a link: a packet, with its tag if authenticated.
#[cfg(not(feature = "auth"))]
pub const MAX_PAYLOAD_BYTES: usize = MAX_PACKET_BYTES;
/// Maximum bytes per transfer of a link: a packet, with its tag if authenticated.
#[cfg(feature = "auth")]
pub const MAX_PAYLOAD_BYTES: usize = MAX_PACKET_BYTES + Profile::Full.overhead();

/// A board and its device.
///
/// Functions without `self` are called before the start or after a failure. They must work at any time and
/// priority, and must not use state that may be in use.
pub trait Board: Sized {
    /// Name, equal to the build's feature.
    const NAME: &'static str;
    /// Capacity of the board's memory.
    const SIZES: Capacities;
    /// Measured types; the last ones are the timing of ticks, a suffix of [`types::TIMING`] or all of it.
    const OUTPUTS: &'static [&'static DataType];
    /// Commanded types.
    const INPUTS: &'static [&'static DataType] = &[types::DES_FORCE];
    /// Limits of each commanded type for [`with_limits`](dimsart_core::DeviceDescriptor::with_limits); empty
    /// for a simulated device.
    const LIMITS: &'static [&'static [InputLimits]] = &[];
    /// Limits of the first type of [`OUTPUTS`](Self::OUTPUTS) for
    /// [`with_output_limits`](dimsart_core::DeviceDescriptor::with_output_limits).
    const OUTPUT_LIMITS: &'static [OutputLimits] = &[];
    /// Maximum number of received packets of all links between two ticks; further packets are lost.
    const PACKETS_PER_TICK: usize = Self::SIZES.links + 1;

    /// Cycles that interrupts above the tick may take during a module call: the time driver.
    const SPARE_CYCLES: u32 = 2_000;

    /// Sensors and actuators. Owned by the tick.
    type Joints: Joints;
    /// Command line.
    type CommandPort: CommandPort;
    /// Receives packets of other controllers.
    type LinkIn: LinkIn;
    /// Sends packets to other controllers.
    type LinkOut: LinkOut;
    /// Flash for schemes.
    type Flash: NorFlash + 'static;
    /// The idle loop.
    type Idle: Idle;

    /// Starts clocks, pins, time driver and the two executors, and returns the parts. Called once.
    ///
    /// The actuators are then in their safe state. An error that prevents control of the device is a panic:
    /// the panic handler brings the device to rest and reports the reason.
    fn start() -> BoardParts<Self>;

    /// Returns [`OUTPUTS`](Self::OUTPUTS) after the [start](Self::start), when the measured types are known.
    #[must_use]
    fn outputs() -> &'static [&'static DataType] {
        Self::OUTPUTS
    }

    /// Puts the actuators into their safe state: no force, power stage off.
    ///
    /// Cannot fail and does not block. The state remains until the next [`Joints::write`].
    fn disarm();

    /// Returns a free-running counter of the processor's clock.
    fn counter() -> Counter;

    /// Returns the [`counter`](Self::counter)'s counts per 1024 instructions on an emulated board, whose
    /// counter counts the emulator's time; 0 if the counter counts processor cycles.
    fn counts_per_1024_instructions() -> u32 {
        0
    }

    /// Publishes the data base after every tick, for an observer: its revision and the words of every signal.
    /// A board without an observer does nothing.
    fn show(_revision: u32, _words: impl Iterator<Item = u32>) {}

    /// Feeds the watchdog.
    fn feed_watchdog();

    /// Returns the cause of the start. Called once, early.
    fn start_cause() -> StartCause {
        StartCause::Unknown
    }

    /// Restarts the board after a reported panic or exception. Ends an emulated board in lockstep with its
    /// host.
    fn reset() -> !;
}

/// The type of motion on each axis.
pub type Axes = heapless::Vec<AxisKind, MAX_DOF, u8>;

/// Limits of a device's inputs and outputs.
#[derive(Clone, Copy)]
pub struct Limits {
    /// See [`Board::LIMITS`].
    pub inputs: &'static [&'static [InputLimits]],
    /// See [`Board::OUTPUT_LIMITS`].
    pub outputs: &'static [OutputLimits],
}

/// The parts of a started board.
pub struct BoardParts<B: Board> {
    /// The type of motion on each axis of the device.
    pub axes: Axes,
    /// Runs tasks above everything but the time driver: the tick.
    pub tick: SendSpawner,
    /// Runs tasks below the tick: commands, telemetry, links.
    pub background: SendSpawner,
    /// Sensors and actuators.
    pub joints: B::Joints,
    /// Command line.
    pub command_port: B::CommandPort,
    /// Receives packets.
    pub link_in: B::LinkIn,
    /// Sends packets.
    pub link_out: B::LinkOut,
    /// Storage for schemes, if any.
    pub storage: Option<Storage<B::Flash>>,
    /// The idle loop.
    pub idle: B::Idle,
}

/// Flash for schemes.
pub struct Storage<F> {
    /// The flash. It may wait in the background, but must not delay higher priorities unless it [stalls the
    /// tick](Self::stalls_tick).
    pub flash: F,
    /// The range for schemes: two or more whole pages outside the image.
    pub range: Range<u32>,
    /// The range for the key: two whole pages outside the image and the schemes.
    #[cfg(feature = "auth")]
    pub keys: Range<u32>,
    /// Whether the processor stalls while the flash is written.
    pub stalls_tick: bool,
}

/// Sensors and actuators, in SI units and in the layout of the device's types.
pub trait Joints: Send + 'static {
    /// Reads every sensor, in the order of the descriptor's outputs, in bounded time without blocking.
    ///
    /// `measured` excludes the device's [`types::TIMING`]: the tick measures these.
    ///
    /// A failed sensor reads NaN: the tick is refused and the device gets its safe value.
    fn read(&mut self, measured: &mut [Word]);

    /// Whether the joints have a drive with a stored configuration. If so, implement the next four functions.
    const HAS_DRIVE: bool = false;

    /// Begins before the first tick. `motor` contains the stored configuration and returns the active one.
    /// Returns the device's limits if they depend on the configuration.
    fn begin(&mut self, _motor: &mut MotorReport) -> Option<Limits> {
        None
    }

    /// Checks whether the next start would accept a drive's configuration.
    ///
    /// # Errors
    /// The reason if not.
    fn check_motor(_layout: u16, _words: &[u32]) -> Result<(), MotorFallback> {
        Err(MotorFallback::Layout)
    }

    /// Starts the identification of the motor with this current, `A`; it runs while motion is enabled.
    fn identify(_current_a: f32) {}

    /// Returns the state of the identification.
    fn identification() -> Identification {
        Identification::None
    }

    /// Returns why the drive's bridge is off, as of the last [`read`](Self::read); `None` without a fault.
    fn fault(&self) -> Option<DriveFault> {
        None
    }

    /// Commands every actuator, in the order of the descriptor's inputs, in bounded time without blocking.
    ///
    /// `commanded` is the finite output of the safety stage and drives the actuators whatever `tick` is,
    /// because a safe value may be approached gradually. A power stage is on only while [`needs_power_stage`]. An
    /// actuator that fails is detected by its sensors, or disarms itself.
    fn write(&mut self, tick: TickResult, commanded: &[Word]);
}

/// A byte stream to a host. Bytes that arrive faster than they are read are lost; the protocol detects that.
/// Line errors count as lost bytes and are not reported.
pub trait CommandPort: Read + Write + Send + 'static {}

/// Returns whether a power stage is needed: the scheme commands, or a ramp to zero is in progress.
#[must_use]
pub fn needs_power_stage(tick: TickResult, commanded: &[Word]) -> bool {
    matches!(tick, TickResult::Ran) || commanded.iter().any(|word| f32::from_word(*word) != 0.0)
}

/// Receives packets over the device's links.
pub trait LinkIn: Send + 'static {
    /// Waits for a packet on any link; returns the link's number and the packet's length in `packet`.
    ///
    /// Corrupt packets may be dropped or passed on, because packets have a CRC; so may packets of another
    /// channel. A cancelled wait loses nothing.
    fn receive(
        &mut self,
        listening: &ReceiveChannels,
        packet: &mut [u8; MAX_PAYLOAD_BYTES],
    ) -> impl Future<Output = (usize, usize)>;
}

/// Sends packets over the device's links.
pub trait LinkOut: Send + 'static {
    /// Sends a packet of a channel over a link. Drops packets that cannot be sent or have no such link: a
    /// late packet is worth less than the next one.
    fn send(&mut self, link: usize, channel: u16, packet: &[u8]) -> impl Future<Output = ()>;
}

/// The lowest priority.
pub trait Idle {
    /// Waits for interrupts forever.
    fn run(self) -> !;
}
