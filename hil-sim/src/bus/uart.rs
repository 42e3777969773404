//! One direction of a UART: ten bits per byte, bit errors, lost and spurious bytes.

use std::collections::VecDeque;

use super::line::SerialLine;
use super::random::Random;
use super::traffic::{BusyInterval, Timeline};

/// Start bit, data, stop bit.
const BITS_PER_BYTE: u32 = 10;

/// Parameters of a UART line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UartParameters {
    /// Bit rate, `bit/s`.
    pub bits_per_s: u32,
    /// Probability of a bit error, 0 to 1. A wrong start or stop bit loses the byte.
    pub bit_error_rate: f64,
    /// Share of lost bytes, 0 to 1: receiver overruns.
    pub byte_drop: f64,
    /// Share of bytes preceded by a spurious byte, 0 to 1.
    pub byte_insert: f64,
    /// Queue size, bytes.
    pub queue_bytes: usize,
}

/// One direction.
#[derive(Debug)]
pub struct Uart {
    parameters: UartParameters,
    line: SerialLine,
    random: Random,
    /// Bits until the next bit error.
    good_bits: u64,
    /// Bytes with their arrival time, `ns`.
    on_the_way: VecDeque<(u64, u8)>,
    errors: u64,
    timeline: Timeline,
}

impl Uart {
    /// Creates a line with a random seed.
    #[must_use]
    pub fn new(parameters: UartParameters, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let good_bits = random.geometric(parameters.bit_error_rate);
        let line = SerialLine::new(parameters.bits_per_s, BITS_PER_BYTE, parameters.queue_bytes);
        let (on_the_way, timeline) = (VecDeque::new(), Timeline::default());
        Self { parameters, line, random, good_bits, on_the_way, errors: 0, timeline }
    }

    /// Queues bytes from `now_ns` on. Returns false if they do not all fit; then no byte is sent.
    pub fn send(&mut self, now_ns: u64, bytes: &[u8]) -> bool {
        let Some(start_ns) = self.line.take(now_ns, bytes.len()) else { return false };
        let before = self.errors;
        for (count, byte) in (1..).zip(bytes) {
            let arrival_ns = start_ns + self.line.lasts_ns(count);
            if self.random.bernoulli(self.parameters.byte_insert) {
                self.errors += 1;
                let noise = self.noise();
                self.on_the_way.push_back((arrival_ns, noise));
            }
            if let Some(byte) = self.carry(*byte) {
                self.on_the_way.push_back((arrival_ns, byte));
            }
        }
        let (end_ns, is_error) = (start_ns + self.line.lasts_ns(bytes.len()), self.errors > before);
        self.timeline.add(BusyInterval { start_ns, end_ns, sender: 0, label: String::new(), is_error });
        true
    }

    /// Applies errors to a byte; `None` if lost.
    fn carry(&mut self, byte: u8) -> Option<u8> {
        let wrong_bits = self.wrong_bits();
        let is_lost = self.random.bernoulli(self.parameters.byte_drop) || wrong_bits & 0b10_0000_0001 != 0;
        self.errors += u64::from(is_lost || wrong_bits != 0);
        let [_, data] = (wrong_bits >> 1).to_be_bytes();
        (!is_lost).then_some(byte ^ data)
    }

    /// Error mask of the ten bits of a byte, start bit lowest.
    fn wrong_bits(&mut self) -> u16 {
        let mut mask = 0;
        for bit in 0..BITS_PER_BYTE {
            if self.good_bits == 0 {
                mask |= 1 << bit;
                self.good_bits = self.random.geometric(self.parameters.bit_error_rate);
            } else {
                self.good_bits -= 1;
            }
        }
        mask
    }

    fn noise(&mut self) -> u8 {
        u8::try_from(self.random.uniform_integer(u32::from(u8::MAX))).unwrap_or(u8::MAX)
    }

    /// Passes bytes that have arrived by `now_ns` to `deliver`, with their arrival in `ns`.
    pub fn receive(&mut self, now_ns: u64, mut deliver: impl FnMut(u64, u8)) {
        while let Some((arrival_ns, byte)) =
            self.on_the_way.pop_front_if(|(arrival_ns, _)| *arrival_ns <= now_ns)
        {
            deliver(arrival_ns, byte);
        }
    }

    /// Returns the number of wrong, lost and spurious bytes.
    #[must_use]
    pub fn errors(&self) -> u64 {
        self.errors
    }

    /// Returns the busy time, `ns`.
    #[must_use]
    pub fn busy_ns(&self) -> u64 {
        self.line.busy_ns()
    }

    /// Returns the maximum time from queueing to arrival, `ns`.
    #[must_use]
    pub fn longest_ns(&self) -> u64 {
        self.line.longest_ns()
    }

    /// Returns the busy intervals.
    #[must_use]
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLEAN: UartParameters = UartParameters {
        bits_per_s: 1_000_000,
        bit_error_rate: 0.0,
        byte_drop: 0.0,
        byte_insert: 0.0,
        queue_bytes: 100,
    };

    fn received(uart: &mut Uart, now_ns: u64) -> Vec<(u64, u8)> {
        let mut bytes = Vec::new();
        uart.receive(now_ns, |arrival_ns, byte| bytes.push((arrival_ns, byte)));
        bytes
    }

    #[test]
    fn a_byte_takes_ten_bits_and_waits_for_those_before_it() {
        let mut uart = Uart::new(CLEAN, 1);
        assert!(uart.send(0, &[1, 2]) && uart.send(5_000, &[3]));
        assert_eq!(received(&mut uart, 9_999), []);
        assert_eq!(received(&mut uart, 20_000), [(10_000, 1), (20_000, 2)]);
        assert_eq!(received(&mut uart, 1_000_000), [(30_000, 3)]);
        assert_eq!(uart.busy_ns(), 30_000);
        // 3 bytes are 26 us 042 ns at 1 152 000 baud; the rounding of each does not add up.
        let mut fast = Uart::new(UartParameters { bits_per_s: 1_152_000, ..CLEAN }, 1);
        fast.send(0, &[0; 3]);
        assert_eq!(received(&mut fast, 1_000_000).last().unwrap().0, 26_042);
    }

    #[test]
    fn a_full_line_refuses_what_does_not_fit_whole() {
        let mut uart = Uart::new(CLEAN, 1);
        assert!(uart.send(0, &[0; 60]));
        assert!(!uart.send(0, &[0; 41]) && uart.send(0, &[0; 40]));
        assert!(!uart.send(9_999, &[0]) && uart.send(10_000, &[0]), "one byte is out");
    }

    #[test]
    fn errors_come_as_often_as_asked() {
        let sent = vec![0x5A; 100_000];
        let run = |parameters: UartParameters| {
            let mut uart = Uart::new(UartParameters { queue_bytes: sent.len(), ..parameters }, 9);
            assert!(uart.send(0, &sent));
            let bytes = received(&mut uart, u64::MAX);
            (bytes.len() as f64 / 1e5, bytes.iter().filter(|(_, byte)| *byte != 0x5A).count() as f64 / 1e5)
        };
        let near = |found: f64, wanted: f64| (found - wanted).abs() < 0.004;
        assert_eq!(run(CLEAN), (1.0, 0.0));
        let (arrived, wrong) = run(UartParameters { bit_error_rate: 0.01, ..CLEAN });
        // Start and stop bit right; then at least one of eight wrong.
        let framed = 0.99_f64.powi(2);
        assert!(near(arrived, framed) && near(wrong, framed * (1.0 - 0.99_f64.powi(8))), "{arrived} {wrong}");
        assert!(near(run(UartParameters { byte_drop: 0.05, ..CLEAN }).0, 0.95));
        let (arrived, wrong) = run(UartParameters { byte_insert: 0.05, ..CLEAN });
        assert!(near(arrived, 1.05) && near(wrong, 0.05 * 255.0 / 256.0));
    }
}
