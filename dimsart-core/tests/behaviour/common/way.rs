//! Two controllers with a line that the test controls.

use dimsart_core::{Packet, types};
use rand_core::Rng;

use super::{Bench, DelayedLink, H};

/// One axis of waves from a sender to a receiver; the test is the line.
pub(crate) struct Way {
    pub(crate) sender: Bench,
    pub(crate) receiver: Bench,
}

pub(crate) fn sender() -> Bench {
    sender_with("")
}

pub(crate) fn sender_with(rows: &str) -> Bench {
    let mut bench = Bench::of(1, &[types::CH1_WAVES], &[]);
    bench.run(&format!("{rows}\nCOMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD"));
    bench
}

impl Way {
    /// A line that never times out.
    pub(crate) fn new(rows: &str) -> Self {
        Self::timed(&format!("COMM_RXMOD TIMEOUT_TICKS 0\n{rows}"))
    }

    pub(crate) fn every(rows: &str, every: u32) -> Self {
        let receiver = Self::timed(&format!("{rows}\nCOMM_RXMOD CRX_EVERY {every}"));
        Self { sender: sender_with(&format!("COMM_TXMOD CTX_EVERY {every}")), ..receiver }
    }

    pub(crate) fn timed(rows: &str) -> Self {
        let mut receiver = Bench::of(1, &[], &[]);
        receiver.run(&format!("{rows}\nCOMM_RXMOD CRX_ADD_DATA CH2_WAVES\nMOD_ENG MOD_ON COMM_RXMOD"));
        Self { sender: sender(), receiver }
    }

    pub(crate) fn send(&mut self, wave: f32) -> Packet {
        self.try_send(wave).unwrap()
    }

    pub(crate) fn try_send(&mut self, wave: f32) -> Option<Packet> {
        self.sender.tick(&[wave]);
        self.sender.dimsart.take_outgoing(0)
    }

    /// Runs a tick of the receiver after these packets; returns the wave.
    pub(crate) fn receive<'a>(&mut self, packets: impl IntoIterator<Item = &'a Packet>) -> f32 {
        for packet in packets {
            self.receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
        }
        self.receiver.tick(&[]);
        self.receiver.signal("CH2_WAVES")[0]
    }

    pub(crate) fn count(&self, name: &str) -> u32 {
        self.receiver.bits(name)[0]
    }
}

/// Two connected ends, one axis of waves each way; packets take `delay` ticks.
pub(crate) struct Ends {
    pub(crate) ends: [Bench; 2],
    pub(crate) links: [DelayedLink; 2],
    pub(crate) tick: usize,
}

impl Ends {
    pub(crate) fn end(rows: &str) -> Bench {
        let mut bench = Bench::of(1, &[types::CH1_WAVES], &[]);
        bench.run(&format!(
            "COMM_RXMOD TIMEOUT_TICKS 0\n{rows}\nCOMM_RXMOD CRX_ADD_DATA CH2_WAVES\nMOD_ENG MOD_ON COMM_RXMOD\n\
             COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD"
        ));
        bench
    }

    pub(crate) fn new(rows: &str, delay: usize) -> Self {
        let links = [DelayedLink::new(delay), DelayedLink::new(delay)];
        Self { ends: [Self::end(rows), Self::end(rows)], links, tick: 0 }
    }

    pub(crate) fn tick(&mut self, waves: [f32; 2]) {
        let Self { ends, links: [there, back], tick } = self;
        back.deliver(*tick, &mut ends[0].dimsart);
        ends[0].tick(&waves[..1]);
        there.send(*tick, &mut ends[0].dimsart);
        there.deliver(*tick, &mut ends[1].dimsart);
        ends[1].tick(&waves[1..]);
        back.send(*tick, &mut ends[1].dimsart);
        *tick += 1;
    }
}

/// From 0 to 1.
pub(crate) fn chance(random: &mut impl Rng) -> f64 {
    f64::from(random.next_u32()) / 4_294_967_296.0
}

pub(crate) fn energy(wave: f32) -> f64 {
    0.5 * f64::from(H) * f64::from(wave).powi(2)
}
