//! The connection to the host: passes received data to the tasks and returns the results of a tick.

use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering::Relaxed};

use critical_section::Mutex;
use dimsart_core::{AxisKind, DataType, MAX_DEVICE_TYPES, TickResult, limits::MAX_DOF, types};
use heapless::Vec;
use semihosting::fd::{AsFd as _, OwnedFd};
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::process::exit;
use static_cell::ConstStaticCell;

use super::{Mps2An386, SharedWords, clock, uart};
use crate::board::{Axes, Board, Idle, LinkIn, LinkOut, MAX_PAYLOAD_BYTES};
use crate::handover::{ItemQueue, QueueReceiver, QueueSender};
use crate::receive_channels::ReceiveChannels;
use dimsart_link::exchange::{ExchangeError, Frame, MAX_SIGNAL_WORDS, Tag, VERSION};

const WORDS: usize = MAX_DEVICE_TYPES * MAX_DOF;

/// Measurements of the host.
pub(super) static MEASURED: SharedWords<WORDS> = SharedWords::new();
/// Commands of the last tick.
pub(super) static COMMANDED: SharedWords<WORDS> = SharedWords::new();
/// The cycle counter before and after the last tick.
pub(super) static STAMPS: SharedWords<2> = SharedWords::new();
/// Outcome of the last tick, until it is sent.
static OUTCOME: Mutex<Cell<Option<TickResult>>> = Mutex::new(Cell::new(None));
/// File descriptor of the pipe to the host, for the last message; `NOT_OPEN` while closed.
static FROM_BOARD: AtomicI32 = AtomicI32::new(NOT_OPEN);
const NOT_OPEN: i32 = -1;
static TICKS: AtomicU32 = AtomicU32::new(0);
/// Whether the host requested the data base.
static IS_WATCHED: AtomicBool = AtomicBool::new(false);
/// Revision and words of the data base, as bytes.
static SIGNALS: Mutex<RefCell<Vec<u8, { 4 * (1 + MAX_SIGNAL_WORDS) }>>> =
    Mutex::new(RefCell::new(Vec::new()));

/// Exit codes of the emulator.
const EXIT_HOST_LEFT: i32 = 0;
const EXIT_NO_HOST: i32 = 2;
const EXIT_BAD_FRAME: i32 = 3;

/// A link's number and a packet's bytes.
type Numbered = (usize, Vec<u8, MAX_PAYLOAD_BYTES>);
type Packets = ItemQueue<Numbered, 5>;

/// Packets received from the host.
pub struct HostReceiver(QueueReceiver<Numbered>);
/// Packets to the host.
pub struct HostSender(QueueSender<Numbered>);

impl LinkIn for HostReceiver {
    async fn receive(&mut self, _: &ReceiveChannels, packet: &mut [u8; MAX_PAYLOAD_BYTES]) -> (usize, usize) {
        self.0.ready_to_receive().await;
        let copied = self.0.receive_in_place(|(link, bytes)| {
            let bytes = bytes.as_slice();
            if let Some(space) = packet.get_mut(..bytes.len()) {
                space.copy_from_slice(bytes);
            }
            (*link, bytes.len())
        });
        // Single receiver: the item exists.
        copied.unwrap_or_default()
    }
}

impl LinkOut for HostSender {
    async fn send(&mut self, link: usize, _: u16, packet: &[u8]) {
        // Dropped if too long, as on every link.
        if let Ok(bytes) = Vec::from_slice(packet) {
            self.0.send((link, bytes));
        }
    }
}

/// Stores the outcome of a tick.
pub(super) fn set_outcome(tick: TickResult) {
    critical_section::with(|section| OUTCOME.borrow(section).set(Some(tick)));
    TICKS.store(TICKS.load(Relaxed).wrapping_add(1), Relaxed);
}

/// Stores the requested data base, truncated if too long.
pub(super) fn show(revision: u32, words: impl Iterator<Item = u32>) {
    if !IS_WATCHED.load(Relaxed) {
        return;
    }
    critical_section::with(|section| {
        let mut bytes = SIGNALS.borrow_ref_mut(section);
        bytes.clear();
        let mut add = |word: u32| {
            let _ = bytes.extend_from_slice(&word.to_le_bytes());
        };
        add(revision);
        words.for_each(add);
    });
}

/// Reports to the host that the firmware stopped, with the final outputs and the cycle counter. Nothing may
/// run afterwards.
pub(super) fn say_stopped() {
    let number = FROM_BOARD.load(Relaxed);
    if number == NOT_OPEN {
        return;
    }
    #[expect(unsafe_code, reason = "the owner of the pipe has stopped")]
    // SAFETY: an open file descriptor whose owner never runs again.
    let mut from_board = File::from(unsafe { OwnedFd::from_raw_fd(number) });
    STAMPS.set(1, Some(Mps2An386::counter().now()));
    let mut frame = Frame::new();
    frame.clear();
    // If the host has left, the emulator's exit code reports the same.
    let _ = frame.push_with(Tag::Stopped, 4 * WORDS, |bytes| COMMANDED.copy_to_bytes(bytes));
    let _ = frame.push(Tag::Stamps, &stamps());
    let _ = from_board.write_all(frame.as_bytes());
}

/// Returns the cycle counter at start and end of the last tick, and its number of valid bits.
fn stamps() -> [u8; 9] {
    let mut bytes = [0; 9];
    STAMPS.copy_to_bytes(&mut bytes);
    let [.., bits] = &mut bytes;
    *bits = u8::try_from(Mps2An386::counter().bits()).unwrap_or(u8::MAX);
    bytes
}

/// The connection to the host, if any, and the device that it simulates.
pub struct Host {
    streams: Option<Streams>,
    frame: &'static mut Frame,
    packets_in: QueueSender<Numbered>,
    packets_out: QueueReceiver<Numbered>,
    /// Types measured by the host.
    played: Outputs,
    words_in: usize,
    words_out: usize,
}

struct Streams {
    to_board: File,
    from_board: File,
}

impl Streams {
    /// Opens both pipes; waits if the host has created but not opened them.
    fn open() -> Option<Self> {
        let to_board = File::open(c"to-board").ok()?;
        let from_board = File::create(c"from-board").ok()?;
        FROM_BOARD.store(from_board.as_fd().as_raw_fd(), Relaxed);
        Some(Self { to_board, from_board })
    }
}

enum Trouble {
    HostLeft,
    BadFrame,
}

impl From<ExchangeError> for Trouble {
    fn from(_: ExchangeError) -> Self {
        Self::BadFrame
    }
}

impl From<semihosting::io::Error> for Trouble {
    fn from(_: semihosting::io::Error) -> Self {
        Self::HostLeft
    }
}

/// Waits for the host and receives the description of the device; without a host, three linear axes.
pub(super) fn connect() -> (Host, Axes, HostReceiver, HostSender) {
    static FRAME: ConstStaticCell<Frame> = ConstStaticCell::new(Frame::new());
    static PACKETS_IN: ConstStaticCell<Packets> = ConstStaticCell::new(Packets::new());
    static PACKETS_OUT: ConstStaticCell<Packets> = ConstStaticCell::new(Packets::new());
    let streams = Streams::open();
    if streams.is_none() && !cfg!(feature = "timer-tick") {
        defmt::error!("no host: create the pipes to-board and from-board in the emulator's folder");
        exit(EXIT_NO_HOST);
    }
    let (packets_in, to_take) = PACKETS_IN.take().split();
    let (to_give, packets_out) = PACKETS_OUT.take().split();
    let frame = FRAME.take();
    let mut host = Host {
        streams,
        frame,
        packets_in,
        packets_out,
        played: Vec::from_array([PLAYED]),
        words_in: 0,
        words_out: 0,
    };
    let axes = host.greet().unwrap_or_else(|trouble| give_up(&trouble));
    let words = |types: &[&DataType]| types.iter().map(|of| of.shape.words(axes.len())).sum();
    host.words_in = words(&host.played);
    host.words_out = words(Mps2An386::INPUTS);
    (host, axes, HostReceiver(to_take), HostSender(to_give))
}

/// Measured type by default.
const PLAYED: &DataType = types::POSITION;

type Outputs = Vec<&'static DataType, MAX_DEVICE_TYPES>;

/// Measured types requested by the host; [`OUTPUTS`] before.
static ASKED_FOR: Mutex<Cell<&'static [&'static DataType]>> = Mutex::new(Cell::new(OUTPUTS));

pub(super) fn outputs() -> &'static [&'static DataType] {
    critical_section::with(|section| ASKED_FOR.borrow(section).get())
}

/// In lockstep every tick is on time, so only the host measures.
pub(super) const OUTPUTS: &[&DataType] = if cfg!(feature = "timer-tick") {
    let [cycles, mean, max, late, overruns, period] = types::TIMING;
    &[PLAYED, cycles, mean, max, late, overruns, period]
} else {
    &[PLAYED]
};

fn give_up(trouble: &Trouble) -> ! {
    match trouble {
        Trouble::HostLeft => exit(EXIT_HOST_LEFT),
        Trouble::BadFrame => {
            defmt::error!("invalid frame from the host: version or device differs");
            exit(EXIT_BAD_FRAME)
        }
    }
}

impl Host {
    /// Runs the first exchange.
    fn greet(&mut self) -> Result<Axes, Trouble> {
        let mut axes = Vec::from_array([AxisKind::Linear; 3]);
        if self.streams.is_none() {
            return Ok(axes);
        }
        self.receive()?;
        for section in self.frame.sections() {
            match section? {
                (Tag::Device, kinds @ [_, ..]) => {
                    let kind = |kind: &u8| if *kind == 0 { AxisKind::Linear } else { AxisKind::Rotary };
                    // Too many axes are rejected with their number.
                    axes = kinds.iter().take(MAX_DOF).map(kind).collect();
                }
                (Tag::Types, ids) => {
                    let (ids, _) = ids.as_chunks::<2>();
                    let found: Option<Outputs> = ids
                        .iter()
                        .take(MAX_DEVICE_TYPES)
                        .map(|id| types::find_by_id(u16::from_le_bytes(*id)))
                        .collect();
                    self.played = found.ok_or(Trouble::BadFrame)?;
                }
                _ => return Err(Trouble::BadFrame),
            }
        }
        self.publish_types();
        self.frame.clear();
        let mut hello: Vec<u8, 32> = Vec::from_array([VERSION]);
        // Fits: the name is short.
        let _ = hello.extend_from_slice(Mps2An386::NAME.as_bytes());
        self.frame.push(Tag::Hello, &hello)?;
        self.send()?;
        Ok(axes)
    }

    /// Adds the host's types and the board's own measurements to the device.
    fn publish_types(&self) {
        static MEASURED_TYPES: ConstStaticCell<Outputs> = ConstStaticCell::new(Outputs::new());
        let all = MEASURED_TYPES.take();
        let own = OUTPUTS.iter().filter(|of| of.id != PLAYED.id);
        // The host detects types that do not fit in the response.
        all.extend(self.played.iter().chain(own).copied().take(MAX_DEVICE_TYPES));
        critical_section::with(|section| ASKED_FOR.borrow(section).set(all));
    }

    fn exchange(&mut self) -> Result<(), Trouble> {
        self.receive()?;
        self.hand_over()?;
        tick();
        self.collect()?;
        self.send()
    }

    fn receive(&mut self) -> Result<(), Trouble> {
        let streams = self.streams.as_mut().ok_or(Trouble::HostLeft)?;
        let is_whole = self.frame.receive(|bytes| streams.to_board.read(bytes).map_err(Trouble::from))?;
        if is_whole { Ok(()) } else { Err(Trouble::HostLeft) }
    }

    fn send(&mut self) -> Result<(), Trouble> {
        let streams = self.streams.as_mut().ok_or(Trouble::HostLeft)?;
        Ok(streams.from_board.write_all(self.frame.as_bytes())?)
    }

    /// Passes the received data to the tasks, which run at once at higher priority.
    fn hand_over(&mut self) -> Result<(), Trouble> {
        IS_WATCHED.store(false, Relaxed);
        for section in self.frame.sections() {
            match section? {
                (Tag::Words, bytes) if bytes.len() == 4 * self.words_in => {
                    MEASURED.fill_from_bytes(bytes);
                }
                (Tag::Signals, _) => IS_WATCHED.store(true, Relaxed),
                (Tag::Command, mut bytes) => loop {
                    let taken = uart::RECEIVED.try_write(bytes);
                    bytes = bytes.get(taken..).unwrap_or_default();
                    if taken == 0 || bytes.is_empty() {
                        break;
                    }
                },
                (tag, packet) => {
                    let link = tag.link().ok_or(Trouble::BadFrame)?;
                    let packet = Vec::from_slice(packet).map_err(|_| Trouble::BadFrame)?;
                    self.packets_in.send((link, packet));
                }
            }
        }
        Ok(())
    }

    /// Assembles the response.
    fn collect(&mut self) -> Result<(), Trouble> {
        self.frame.clear();
        self.frame.push_outcome(critical_section::with(|section| OUTCOME.borrow(section).take()))?;
        self.frame.push_with(Tag::Words, 4 * self.words_out, |bytes| COMMANDED.copy_to_bytes(bytes))?;
        self.frame.push(Tag::Stamps, &stamps())?;
        if IS_WATCHED.load(Relaxed) {
            critical_section::with(|section| self.frame.push(Tag::Signals, &SIGNALS.borrow_ref(section)))?;
        }
        let frame = &mut *self.frame;
        while let Some(pushed) = self.packets_out.receive_in_place(|(link, packet)| {
            let tag = Tag::of_link(*link).ok_or(Trouble::BadFrame)?;
            Ok::<_, Trouble>(frame.push(tag, packet)?)
        }) {
            pushed?;
        }
        if cfg!(feature = "timer-tick") {
            return Ok(());
        }
        if uart::TO_SEND.is_empty() {
            return Ok(());
        }
        let mut bytes = [0; 256];
        while self.frame.free_bytes() >= bytes.len() {
            match uart::TO_SEND.try_read(&mut bytes) {
                0 => break,
                length => self.frame.push(Tag::Command, bytes.get(..length).unwrap_or_default())?,
            }
        }
        Ok(())
    }
}

/// Runs one tick: advances time, or waits for the timer.
fn tick() {
    if cfg!(feature = "timer-tick") {
        let before = TICKS.load(Relaxed);
        while TICKS.load(Relaxed) == before {
            core::hint::spin_loop();
        }
    } else {
        clock::advance();
    }
}

impl Idle for Host {
    fn run(mut self) -> ! {
        if self.streams.is_none() {
            // Not `wfi`: under the emulator's instruction-count time, a spinning processor is reproducible.
            loop {
                core::hint::spin_loop();
            }
        }
        loop {
            if let Err(trouble) = self.exchange() {
                give_up(&trouble);
            }
        }
    }
}
