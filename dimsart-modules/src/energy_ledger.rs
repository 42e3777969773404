//! What a port may give out: the energy that the other side of the link has taken in, and not given out here yet.
//!
//! Energies travel as counters that only grow: a packet that is lost, late or repeated takes nothing from the sum, and
//! what is on its way counts for nobody (Ryu, Artigas and Preusche, *Mechatronics* 20(7), 2010). The counter is an
//! integer that wraps, so that it is as fine after a month as in the first second.

use dimsart_core::math::CompensatedSum;

/// Counts of a joule: it wraps after 256 J, and packets may be 128 J apart.
const COUNTS_PER_J: f32 = 16_777_216.0;
/// Of one tick, 64 J: what is beyond is not sent, which is on the safe side.
const MOST_COUNTS: f32 = 1_073_741_824.0;

dimsart_core::words! {
    /// Of an axis.
    pub(super) struct Ledger {
        sent: u32,
        /// Counts below 1 that are to be sent.
        rest: f32,
        received: u32,
        balance: CompensatedSum,
    }
}

impl Ledger {
    /// One that owes nothing. What was `received` before belongs to others.
    pub(super) fn new(received: u32) -> Self {
        Self { received, ..Self::default() }
    }

    /// Takes in the other side's counter; one that went back is of another beginning, and brings nothing.
    pub(super) fn receive(&mut self, received: u32, limit_j: f32) {
        let counts = received.wrapping_sub(self.received).cast_signed().max(0);
        self.received = received;
        self.add(from_count(counts) * (1.0 / COUNTS_PER_J), limit_j);
    }

    /// Changes what may be given out. What is beyond the limit is lost, which is on the safe side.
    pub(super) fn add(&mut self, energy_j: f32, limit_j: f32) {
        self.balance.add_up_to(energy_j, limit_j);
    }

    /// Tells the other side of an energy, at least 0.
    pub(super) fn send(&mut self, energy_j: f32) {
        let counts = (self.rest + energy_j * COUNTS_PER_J).min(MOST_COUNTS);
        let whole = to_count(counts);
        self.rest = counts - from_count(whole);
        self.sent = self.sent.wrapping_add(whole.cast_unsigned());
    }

    /// Energy that has just gone in at the port: what it does not need for a debt is the other side's; one below 0 came out,
    /// and is taken off.
    pub(super) fn pass(&mut self, energy_in_j: f32, limit_j: f32) {
        let kept_j = energy_in_j.min((-self.balance_j()).max(0.0));
        self.add(kept_j, limit_j);
        if energy_in_j > kept_j {
            self.send(energy_in_j - kept_j);
        }
    }

    /// What the other side is to know.
    pub(super) fn sent(&self) -> u32 {
        self.sent
    }

    /// What may still be given out, `J`; below 0 what was given out too much.
    pub(super) fn balance_j(&self) -> f32 {
        self.balance.value()
    }
}

/// Towards zero; saturates.
#[expect(clippy::cast_possible_truncation, reason = "saturating, towards zero: what is meant")]
fn to_count(counts: f32) -> i32 {
    counts as i32
}

#[expect(clippy::cast_precision_loss, reason = "a difference of counters, as exact as an energy")]
fn from_count(counts: i32) -> f32 {
    counts as f32
}
