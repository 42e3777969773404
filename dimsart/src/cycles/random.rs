//! Random inputs: any measurements, packets with any content, and long silence.

use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_core::limits::MAX_PACKET_WORDS;
use dimsart_core::{DeviceDescriptor, ModuleKinds, Packet, Word};
use dimsart_link::saved_scheme::{self, saved_fingerprint};

use super::CyclesError;
use hil_sim::bus::Random;
use hil_sim::experiment::ExperimentError;
use hil_sim::rig::{SimulatedDimsart, TickTrace};

/// Ticks between restarts of the scheme: extreme values can persist.
const EPISODE_TICKS: u64 = 64;
/// Single-tick starts before each episode: a first tick is one of the longest.
const STARTS: u64 = 8;
/// Ticks until a restart after modules were isolated.
const CUT_OUT_TICKS: u64 = 4;
/// Maximum silence of a link, ticks: longer than its timeout.
const SILENCE_TICKS: u32 = 40;
/// Words of other measurements of a board.
const MORE_WORDS: usize = 64;

/// A packet of the peer: link, channel, content.
pub(super) type Template = (usize, u16, Packet);

/// A controller on the host with random inputs.
#[derive(Debug)]
pub(super) struct RandomInputs<'a> {
    random: Random,
    device: DeviceDescriptor,
    kinds: ModuleKinds,
    dimsart: Box<SimulatedDimsart>,
    scheme: &'a [u8],
    template: Option<Template>,
    silence_ticks: u64,
    trace: TickTrace,
    ticks: u64,
}

impl<'a> RandomInputs<'a> {
    pub(super) fn new(
        device: DeviceDescriptor,
        kinds: ModuleKinds,
        scheme: &'a [u8],
        template: Option<Template>,
        seed: u64,
    ) -> Result<Self, CyclesError> {
        let dimsart =
            Box::new(SimulatedDimsart::new(device.clone(), kinds).map_err(ExperimentError::Storage)?);
        let (random, trace) = (Random::new(seed), TickTrace::default());
        Ok(Self { random, device, kinds, dimsart, scheme, template, silence_ticks: 0, trace, ticks: 0 })
    }

    /// Runs the next tick. Returns its trace, and whether the scheme was restarted before it.
    pub(super) fn tick(&mut self) -> (bool, &TickTrace) {
        let mut place = self.ticks % (STARTS + EPISODE_TICKS);
        let left_ticks = STARTS + EPISODE_TICKS - place;
        if left_ticks > CUT_OUT_TICKS && self.dimsart.engine().isolated_modules().next().is_some() {
            self.ticks += left_ticks - CUT_OUT_TICKS;
            place = STARTS + EPISODE_TICKS - CUT_OUT_TICKS;
        }
        let is_new = place <= STARTS;
        if is_new {
            // A new controller, since faults outlast a scheme.
            if let Ok(dimsart) = SimulatedDimsart::new(self.device.clone(), self.kinds) {
                *self.dimsart = dimsart;
            }
            let _ = saved_scheme::load(self.scheme, saved_fingerprint(self.scheme), &mut self.dimsart);
            self.silence_ticks = 0;
        }
        let is_wild = (self.ticks / (STARTS + EPISODE_TICKS) + place.min(STARTS)) % 2 == 1;
        self.ticks += 1;
        self.receive();
        self.measure(is_wild);
        let Self { dimsart, trace, .. } = self;
        let measured = core::mem::take(&mut trace.measured);
        let mut commanded = vec![Word(0); dimsart.frame().input_words()];
        let own = measured.get(..dimsart.frame().output_words()).unwrap_or_default();
        dimsart.tick_observed(own, &mut commanded, trace);
        (trace.measured, trace.commands) = (measured, commanded);
        for link in 0..dimsart_core::limits::MAX_LINKS {
            trace.sent.extend(dimsart.take_outgoing(link).map(|packet| (link, packet)));
        }
        (is_new, &self.trace)
    }

    fn receive(&mut self) {
        self.trace.clear();
        if self.silence_ticks > 0 {
            self.silence_ticks -= 1;
            return;
        }
        if self.random.bernoulli(0.01) {
            self.silence_ticks = self.random.uniform_integer(SILENCE_TICKS);
        }
        let packets = if self.random.bernoulli(0.1) { 2 } else { self.random.uniform_integer(9).min(1) };
        for _ in 0..packets {
            let Some((link, channel, packet)) = self.packet() else { return };
            let mut bytes = packet.to_bytes().to_vec();
            if self.random.bernoulli(0.03) {
                bytes.iter_mut().take(3).for_each(|byte| *byte ^= 0x55);
            }
            if self.random.bernoulli(0.02) {
                let length = self.length(MAX_CONTENT_BYTES);
                bytes.resize(length, 0x55);
            }
            // The controller counts refused packets.
            let _ = self.dimsart.receive(link, &bytes);
            self.trace.received.push((link, channel, bytes));
        }
    }

    fn packet(&mut self) -> Option<Template> {
        let ahead = match self.random.uniform_integer(19) {
            0 => self.random.uniform_integer(40),
            1 => self.random.uniform_integer(u16::MAX.into()),
            _ => 1,
        };
        let words = match self.random.bernoulli(0.05) {
            true => self.length(MAX_PACKET_WORDS),
            false => self.template.as_ref()?.2.words.len(),
        };
        let is_wild = self.random.bernoulli(0.02);
        let words: Vec<u32> = (0..words).map(|_| self.word(is_wild)).collect();
        let is_other = self.random.bernoulli(0.02);
        let echo = u16::try_from(self.random.uniform_integer(u16::MAX.into())).unwrap_or(0);
        let (link, channel, packet) = self.template.as_mut()?;
        packet.counter = packet.counter.wrapping_add(u16::try_from(ahead).unwrap_or(1)).max(1);
        packet.echo = echo;
        let content = packet.content ^ u16::from(is_other);
        let words = words.into_iter().collect();
        Some((*link, *channel, Packet { words, content, ..packet.clone() }))
    }

    /// A length up to `most`, and often `most`, the worst case.
    fn length(&mut self, most: usize) -> usize {
        if self.random.bernoulli(0.5) {
            return most;
        }
        let most = u32::try_from(most).unwrap_or(u32::MAX);
        usize::try_from(self.random.uniform_integer(most)).unwrap_or(0)
    }

    fn measure(&mut self, is_wild: bool) {
        let axes = self.dimsart.frame().output_words();
        let words: Vec<Word> = (0..axes).map(|_| Word(self.word(is_wild))).collect();
        // Counters and times of the board: any bits.
        let more = (0..MORE_WORDS).map(|_| Word(self.bits())).collect::<Vec<_>>();
        self.trace.measured = words.into_iter().chain(more).collect();
    }

    /// A number within ±1, or any bits.
    fn word(&mut self, is_wild: bool) -> u32 {
        if is_wild && self.random.bernoulli(0.3) {
            return self.bits();
        }
        #[expect(clippy::cast_possible_truncation, reason = "a number within ±1")]
        let number = (2.0 * self.random.uniform() - 1.0) as f32;
        number.to_bits()
    }

    fn bits(&mut self) -> u32 {
        u32::try_from(self.random.uniform_integer(u32::MAX)).unwrap_or(0)
    }
}
