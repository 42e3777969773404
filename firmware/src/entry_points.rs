//! The controller's functions, exported by name.
//!
//! `dimsart cycles` calls and bounds these functions in an emulated processor. They are therefore never
//! inlined, and their arguments can be set by a host: a slice is an address and a length; a returned value is
//! written to an address that precedes the other arguments.
#![expect(unsafe_code, reason = "exported names for a host tool, unique in the image")]
#![expect(improper_ctypes_definitions, reason = "a host only passes these values through")]

use crate::modules::{MODULES, RUNS_PROGRAMS};
use boards::{Board as _, Limits, Selected};
use core::mem::MaybeUninit;

use dimsart_core::limits::{Capacities, MAX_DOF};
use dimsart_core::{
    AxisKind, DeviceDescriptor, Dimsart, InputLimits, MAX_DEVICE_TYPES, OutputLimits, Packet, PacketError,
    TickResult, Word, memory,
};
use dimsart_link::saved_scheme;
use dimsart_link::saved_scheme::LoadError;

use crate::stamp::{self, stamp};

const MAX_WORDS: usize = MAX_DEVICE_TYPES * MAX_DOF;

/// Properties of the image for host tools.
#[repr(C)]
struct Image {
    clock_hz: u32,
    tick_hz: u32,
    name: &'static str,
    controller_bytes: usize,
}

#[unsafe(export_name = "dimsart_image")]
static IMAGE: Image = Image {
    clock_hz: boards::CLOCK_HZ,
    tick_hz: boards::TICK_HZ,
    name: stamp::IMAGE,
    controller_bytes: size_of::<Controller>(),
};

/// Capacity of the board; includes programs only if a module can run them.
const SIZES: Capacities =
    Capacities { programs: if RUNS_PROGRAMS { Selected::SIZES.programs } else { 0 }, ..Selected::SIZES };

/// The controller and its memory. All zero until a device is [connected](connect).
pub(crate) struct Controller {
    memory: memory!(SIZES),
    dimsart: MaybeUninit<Dimsart>,
}

impl Controller {
    pub(crate) const fn new() -> Self {
        Self { memory: <memory!(SIZES)>::new(), dimsart: MaybeUninit::zeroed() }
    }
}

/// The frames between ticks and the device. All zero until a device is [connected](connect).
#[repr(C)]
pub(crate) struct Frames {
    words_in: usize,
    words_out: usize,
    measured: [Word; MAX_WORDS],
    commanded: [Word; MAX_WORDS],
    #[cfg(feature = "measure")]
    pub(crate) measurements: crate::measure::Measurements,
}

impl Frames {
    pub(crate) const fn new() -> Self {
        Self {
            words_in: 0,
            words_out: 0,
            measured: [Word(0); MAX_WORDS],
            commanded: [Word(0); MAX_WORDS],
            #[cfg(feature = "measure")]
            measurements: crate::measure::Measurements::new(),
        }
    }

    pub(crate) fn measured(&mut self) -> &mut [Word] {
        self.measured.get_mut(..self.words_in).unwrap_or_default()
    }

    pub(crate) fn commanded(&mut self) -> &mut [Word] {
        self.commanded.get_mut(..self.words_out).unwrap_or_default()
    }
}

static NO_OUTPUT_LIMITS: [OutputLimits; Selected::OUTPUT_LIMITS.len()] =
    [OutputLimits::NONE; Selected::OUTPUT_LIMITS.len()];
static NO_LIMITS: [&[InputLimits]; Selected::INPUTS.len()] = [&[InputLimits::NONE]; Selected::INPUTS.len()];

/// Connects the board's device with these axes, for the emulator of `dimsart cycles`: without the real
/// motors' limits, so that the safety stage does all of its work without changing a simulated device's
/// forces.
#[unsafe(export_name = "dimsart_connect")]
#[inline(never)]
extern "C" fn connect(
    controller: &'static mut Controller,
    axes: &[AxisKind],
    frames: &mut Frames,
) -> &'static mut Dimsart {
    connect_with(controller, axes, frames, Limits { inputs: &NO_LIMITS, outputs: &NO_OUTPUT_LIMITS })
}

/// Connects the board's device with these axes.
#[inline(never)]
pub(crate) fn connect_with(
    controller: &'static mut Controller,
    axes: &[AxisKind],
    frames: &mut Frames,
    limits: Limits,
) -> &'static mut Dimsart {
    let Controller { memory, dimsart } = controller;
    let dimsart = dimsart.write(Dimsart::without_device(memory));
    let period_s = 1.0 / boards::TICK_HZ as f32;
    let device = DeviceDescriptor::new(Selected::NAME, axes, period_s, Selected::outputs(), Selected::INPUTS);
    let device = match Selected::LIMITS {
        [] => device,
        _ => device.and_then(|device| device.with_limits(limits.inputs)),
    };
    let device = device.and_then(|device| device.with_output_limits(limits.outputs));
    let Ok(device) = device else { defmt::panic!("invalid device: {} axes", axes.len()) };
    if let Err(error) = dimsart.connect(device, MODULES) {
        defmt::panic!("data base too small for the device: {}", error);
    }
    dimsart.engine_mut().set_call_timer(Selected::counter(), Selected::SPARE_CYCLES);
    (frames.words_in, frames.words_out) = (dimsart.frame().output_words(), dimsart.frame().input_words());
    dimsart
}

/// Replaces the scheme with a saved one and starts it. Returns 0, the number of the refused command from 1,
/// or the maximum number for bytes of another image.
#[unsafe(export_name = "dimsart_load")]
extern "C" fn load(dimsart: &mut Dimsart, scheme: &[u8]) -> u32 {
    match saved_scheme::load(scheme, saved_scheme::saved_fingerprint(stamp().scheme()), dimsart) {
        Ok(()) => 0,
        Err(LoadError::Refused { command, .. }) => u32::from(command) + 1,
        Err(_) => u32::MAX,
    }
}

/// Decodes a packet received over a link, on the channel in use.
#[unsafe(export_name = "dimsart_read")]
#[inline(never)]
pub(crate) extern "C" fn read(bytes: &[u8], channel: u16) -> Result<Packet, PacketError> {
    Packet::from_bytes(bytes, channel)
}

/// Delivers a packet to the next tick.
#[unsafe(export_name = "dimsart_deliver")]
#[inline(never)]
pub(crate) extern "C" fn deliver(dimsart: &mut Dimsart, link: usize, packet: &Result<Packet, PacketError>) {
    // The controller counts rejected packets.
    let _ = dimsart.receive_parsed(link, packet);
}

/// Runs one tick.
#[unsafe(export_name = "dimsart_tick")]
#[inline(never)]
pub(crate) extern "C" fn tick(dimsart: &mut Dimsart, frames: &mut Frames) -> TickResult {
    let Frames { words_in, words_out, measured, commanded, .. } = frames;
    let measured = measured.get(..*words_in).unwrap_or_default();
    let commanded = commanded.get_mut(..*words_out).unwrap_or_default();
    #[cfg(feature = "measure")]
    return frames.measurements.tick(dimsart, measured, commanded);
    #[cfg(not(feature = "measure"))]
    dimsart.tick(measured, commanded)
}

/// Returns the packet that the tick left for a link, if any.
#[unsafe(export_name = "dimsart_take")]
#[inline(never)]
pub(crate) extern "C" fn take(dimsart: &mut Dimsart, link: usize) -> Option<Packet> {
    dimsart.take_outgoing(link)
}
