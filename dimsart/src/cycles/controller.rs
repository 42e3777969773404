//! A controller in emulated memory, created and run by the image's own functions.

use std::collections::BTreeSet;
use std::ops::Range;

use ::cycles::bound::{Call, Input};
use ::cycles::instruction::Width;
use ::cycles::machine::{Machine, MachineError, Run};
use ::cycles::timing::Timing;
use dimsart_core::limits::MAX_PACKET_WORDS;
use dimsart_core::{MAX_PACKET_BYTES, Packet, Word};

use super::firmware::EntryPoints;
use super::{CyclesError, Firmware};

/// Address of the controller and its memory, unused by images and valid on the emulated board, too.
const PLACE: u32 = 0x2100_0000;
/// Address of arguments and results.
const ARGUMENTS: u32 = 0x2140_0000;
const ARGUMENT_BYTES: u32 = 0x2000;
/// `Frames`: two counts, then measured and commanded words.
const FRAMES: u32 = ARGUMENTS;
const MEASURED: u32 = FRAMES + 8;
const COMMANDED: u32 = MEASURED + 4 * MAX_WORDS;
const MAX_WORDS: u32 = 64;
/// Bytes of a scheme, of a packet, or a kind per axis.
const BYTES: u32 = ARGUMENTS + 0x800;
/// A packet that was read, or none.
const RECEIVED: u32 = ARGUMENTS + 0x1000;
/// Result of reading damaged bytes, next to a valid packet.
const DAMAGED: u32 = ARGUMENTS + 0x1400;
/// Result of a function.
const RESULT: u32 = ARGUMENTS + 0x1800;
/// Space of a packet with its header.
const RESULT_BYTES: usize = 0x100;

/// Counters with which an image times its calls, `DWT_CYCCNT` and `SYST_CVR`, in separate memory; constant here.
const COUNTERS: [u32; 2] = [0xE000_1004, 0xE000_E018];

/// Delivery of packets of all lengths in a bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lengths {
    /// A call per length: the tightest bound of a delivery.
    PerLength,
    /// One call: sufficient for bounds of ticks, 50 times faster.
    Combined,
}

/// A controller in an emulated processor.
#[derive(Debug, Clone)]
pub struct Controller {
    machine: Machine,
    entry: EntryPoints,
    /// Address of the controller.
    address: u32,
    words_in: usize,
    words_out: usize,
}

impl Controller {
    /// Creates a controller without a scheme, for the board's device with `dof` linear axes.
    ///
    /// # Errors
    /// [`CyclesError::Machine`] if the image fails, such as with too many axes.
    pub fn new(firmware: &Firmware, timing: Timing, dof: usize) -> Result<Self, CyclesError> {
        let mut machine = Machine::new(firmware.image.clone(), timing).map_err(machine("the image"))?;
        machine.map(PLACE, firmware.controller_bytes.next_multiple_of(4));
        machine.map(ARGUMENTS, ARGUMENT_BYTES);
        COUNTERS.iter().for_each(|counter| machine.map(*counter, 4));
        machine.record_calls_of(firmware.compute.iter().copied().chain([firmware.command]));
        let mut controller =
            Self { machine, entry: firmware.entry, address: PLACE, words_in: 0, words_out: 0 };
        // All zero: linear axes.
        let connect = Call::new(firmware.entry.connect, [PLACE, BYTES, number(dof), FRAMES]);
        controller.address = controller.run("dimsart_connect", &connect)?.result;
        let [words_in, words_out] = [0, 4].map(|offset| controller.words(FRAMES + offset, 1));
        let count = |words: Vec<Word>| words.first().map_or(0, |word| word.0 as usize);
        (controller.words_in, controller.words_out) = (count(words_in), count(words_out));
        Ok(controller)
    }

    /// Enables the limit of the image's stamp, as a board does.
    ///
    /// # Errors
    /// [`CyclesError::Machine`].
    pub fn enable_tick_limit(&mut self) -> Result<Run, CyclesError> {
        self.run("dimsart_limit", &Call::new(self.entry.limit, [self.address, 0, 0, 0]))
    }

    /// Loads a [saved scheme](dimsart_link::saved_scheme).
    ///
    /// # Errors
    /// [`CyclesError::IncompatibleImage`] or [`CyclesError::Refused`]; no scheme is loaded then.
    pub fn load(&mut self, scheme: &[u8]) -> Result<Run, CyclesError> {
        let run = self.call_of_load(scheme)?;
        let run = self.run("dimsart_load", &run)?;
        match run.result {
            0 => Ok(run),
            u32::MAX => Err(CyclesError::IncompatibleImage),
            command => Err(CyclesError::Refused { command }),
        }
    }

    /// Reads bytes received over a link on a channel, and delivers the packet for the next tick. Returns both runs.
    ///
    /// # Errors
    /// [`CyclesError::Machine`].
    pub fn receive(&mut self, link: usize, channel: u16, bytes: &[u8]) -> Result<[Run; 2], CyclesError> {
        let length = self.put_bytes(bytes)?;
        let read = Call::new(self.entry.read, [RECEIVED, BYTES, length, channel.into()]);
        let read = self.run("dimsart_read", &read)?;
        Ok([read, self.run("dimsart_deliver", &self.call_of_deliver(number(link)))?])
    }

    /// Returns the processor before the first instruction of a tick, for single steps; the controller does not change.
    ///
    /// # Errors
    /// [`CyclesError::Access`].
    pub fn before_tick(&self, measured: &[Word]) -> Result<Machine, CyclesError> {
        let mut controller = self.clone();
        controller.measure(measured)?;
        controller.machine.begin(self.entry.tick, self.tick_arguments());
        Ok(controller.machine)
    }

    /// Runs one tick. Other measurements of the board, such as tick times, are 0.
    ///
    /// # Errors
    /// [`CyclesError::Machine`].
    pub fn tick(&mut self, measured: &[Word]) -> Result<Run, CyclesError> {
        self.measure(measured)?;
        self.run("dimsart_tick", &self.call_of_tick())
    }

    fn measure(&mut self, measured: &[Word]) -> Result<(), CyclesError> {
        let rest = std::iter::repeat(&Word(0));
        let words = measured.iter().chain(rest).take(self.words_in);
        let bytes: Vec<u8> = words.flat_map(|word| word.0.to_le_bytes()).collect();
        self.write(MEASURED, &bytes)
    }

    /// Returns the commands of the last tick.
    #[must_use]
    pub fn commands(&self) -> Vec<Word> {
        self.words(COMMANDED, self.words_out)
    }

    /// Takes the packet of the last tick for a link.
    ///
    /// # Errors
    /// [`CyclesError::Machine`].
    pub fn take_packet(&mut self, link: usize) -> Result<(Run, EmulatedPacket), CyclesError> {
        self.write(RESULT, &[0; RESULT_BYTES])?;
        let run = self.run("dimsart_take", &self.call_of_take(number(link)))?;
        let mut bytes = vec![0; RESULT_BYTES];
        self.machine.read(RESULT, &mut bytes).map_err(access)?;
        Ok((run, EmulatedPacket(bytes)))
    }

    /// The emulated processor.
    pub(super) fn machine(&self) -> &Machine {
        &self.machine
    }

    pub(super) fn call_of_load(&mut self, scheme: &[u8]) -> Result<Call, CyclesError> {
        let length = self.put_bytes(scheme)?;
        Ok(Call::new(self.entry.load, [self.address, BYTES, length, 0]))
    }

    /// Calls that read any bytes on any channel: up to a packet's length, and longer. Separate, since longer input is rejected
    /// without a copy.
    pub(super) fn calls_of_any_read(&self) -> [Call; 2] {
        let longest = number(MAX_PACKET_BYTES);
        [0..=longest, longest + 1..=RECEIVED - BYTES].map(|length| Call {
            function: self.entry.read,
            arguments: [RECEIVED..=RECEIVED, BYTES..=BYTES, length, 0..=u16::MAX.into()],
            inputs: vec![Input::unknown_memory(BYTES..RECEIVED)],
            is_optional: false,
        })
    }

    pub(super) fn call_of_deliver(&self, link: u32) -> Call {
        Call::new(self.entry.deliver, [self.address, link, RECEIVED, 0])
    }

    /// Deliveries over a link: of damaged bytes, and of packets on a channel with any content and length, in one call or a call
    /// per length.
    pub(super) fn calls_of_any_delivery(
        &mut self,
        link: u32,
        channel: u16,
        lengths_of: Lengths,
    ) -> Result<Vec<Call>, CyclesError> {
        // The words that differ between these packets are the content.
        let packet = |words, bit: bool| {
            let number = if bit { u16::MAX } else { 0x0101 };
            let words = std::iter::repeat_n(if bit { u32::MAX } else { 0 }, words).collect();
            Packet { channel, counter: number, echo: number, content: number, words }.to_bytes()
        };
        let shorter = self.read(RECEIVED, channel, &packet(MAX_PACKET_WORDS - 1, true))?;
        let zeros = self.read(RECEIVED, channel, &packet(MAX_PACKET_WORDS, false))?;
        let ones = self.read(RECEIVED, channel, &packet(MAX_PACKET_WORDS, true))?;
        let (mut content, mut lengths) = (Vec::new(), Vec::new());
        for (place, words) in ones.iter().zip(zeros).zip(shorter).enumerate() {
            let start = RECEIVED + 4 * number(place);
            let addresses = start..start + 4;
            match words {
                ((ones, zeros), _) if *ones != zeros => content.push(Input::unknown_memory(addresses)),
                ((ones, _), shorter) if *ones != shorter => lengths.push(addresses),
                _ => {}
            }
        }
        self.read(DAMAGED, channel, &[])?;
        let mut calls = vec![Call::new(self.entry.deliver, [self.address, link, DAMAGED, 0])];
        let most = number(MAX_PACKET_WORDS);
        let counts = match lengths_of {
            Lengths::PerLength => (0..=most).map(|words| words..=words).collect(),
            Lengths::Combined => vec![0..=most],
        };
        for values in counts {
            let length = |addresses: &Range<u32>| Input {
                addresses: addresses.clone(),
                width: Width::Word,
                values: values.clone(),
            };
            let inputs = content.iter().cloned().chain(lengths.iter().map(length)).collect();
            calls.push(Call { inputs, ..self.call_of_deliver(link) });
        }
        Ok(calls)
    }

    /// Reads bytes to an address and returns the words there.
    fn read(&mut self, to: u32, channel: u16, bytes: &[u8]) -> Result<Vec<u32>, CyclesError> {
        let length = self.put_bytes(bytes)?;
        self.run("dimsart_read", &Call::new(self.entry.read, [to, BYTES, length, channel.into()]))?;
        Ok(self.words(to, RESULT_BYTES / 4).into_iter().map(|word| word.0).collect())
    }

    /// With any measured words and counters.
    pub(super) fn call_of_tick(&self) -> Call {
        let mut inputs = vec![Input::words(MEASURED..MEASURED + 4 * number(self.words_in))];
        inputs.extend(COUNTERS.map(|counter| Input::words(counter..counter + 4)));
        Call { inputs, ..Call::new(self.entry.tick, self.tick_arguments()) }
    }

    fn tick_arguments(&self) -> [u32; 4] {
        [RESULT, self.address, FRAMES, 0]
    }

    pub(super) fn call_of_take(&self, link: u32) -> Call {
        Call::new(self.entry.take, [RESULT, self.address, link, 0])
    }

    /// Runs a call with known arguments.
    fn run(&mut self, name: &'static str, call: &Call) -> Result<Run, CyclesError> {
        let arguments = call.arguments.each_ref().map(|argument| *argument.start());
        self.machine.call(call.function, arguments).map_err(machine(name))
    }

    /// Writes bytes to the arguments and returns their number.
    fn put_bytes(&mut self, bytes: &[u8]) -> Result<u32, CyclesError> {
        let length = number(bytes.len());
        if length > RECEIVED - BYTES {
            return Err(CyclesError::TooManyBytes { bytes: bytes.len() });
        }
        self.write(BYTES, bytes)?;
        Ok(length)
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), CyclesError> {
        self.machine.write(address, bytes).map_err(access)
    }

    /// Words of the arguments.
    fn words(&self, address: u32, count: usize) -> Vec<Word> {
        let mut bytes = vec![0; 4 * count];
        // Always mapped.
        let _ = self.machine.read(address, &mut bytes);
        let (words, _) = bytes.as_chunks::<4>();
        words.iter().map(|word| Word(u32::from_le_bytes(*word))).collect()
    }
}

/// A packet in the image's memory, or none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EmulatedPacket(Vec<u8>);

impl EmulatedPacket {
    /// Whether it has the words, counter, echo and content of this packet. All NaN are equal: their bits depend on the
    /// processor.
    ///
    /// The compiler chooses the memory layout, so that all positions are searched.
    #[must_use]
    pub fn is(&self, packet: &Packet) -> bool {
        let is_nan = |word| f32::from_bits(word).is_nan();
        let is_same = |(bytes, word): (&[u8; 4], &u32)| {
            let found = u32::from_le_bytes(*bytes);
            found == *word || is_nan(found) && is_nan(*word)
        };
        let are_words = |window: &[u8]| window.as_chunks().0.iter().zip(&packet.words).all(is_same);
        let halves: BTreeSet<[u8; 2]> = self.0.as_chunks::<2>().0.iter().copied().collect();
        let numbers = [packet.counter, packet.echo, packet.content];
        self.0.windows((4 * packet.words.len()).max(1)).any(are_words)
            && numbers.iter().all(|number| halves.contains(&number.to_le_bytes()))
    }
}

/// Converts to an argument; `u32::MAX` if it does not fit.
fn number(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn machine(what: &'static str) -> impl Fn(MachineError) -> CyclesError {
    move |source| CyclesError::Machine { what, source }
}

fn access(source: ::cycles::AccessError) -> CyclesError {
    CyclesError::Access(source)
}
