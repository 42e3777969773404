//! Energy ledger of a port: the energy that the peer has reported and this side has not output yet.
//!
//! Energies are sent as counters that only grow: a lost, late or duplicate packet does not change the total, and energy
//! in transit is counted on neither side (Ryu, Artigas and Preusche, *Mechatronics* 20(7), 2010). The counter is a
//! wrapping integer, so its resolution does not degrade over time.

use dimsart_core::math::CompensatedSum;

/// Counts per joule: the counter wraps after 256 J; two packets may differ by up to 128 J.
const COUNTS_PER_J: f32 = 16_777_216.0;
/// Maximum counts per tick, 64 J; excess energy is discarded, which is conservative.
const MAX_COUNTS: f32 = 1_073_741_824.0;

dimsart_core::words! {
    /// State of one axis.
    pub(super) struct Ledger {
        sent: u32,
        /// Fraction of a count not sent yet.
        rest: f32,
        received: u32,
        balance: CompensatedSum,
    }
}

impl Ledger {
    /// Creates an empty ledger; energy `received` earlier is ignored.
    pub(super) fn new(received: u32) -> Self {
        Self { received, ..Self::default() }
    }

    /// Adds the energy of the peer's new counter. A counter that went back, after a restart of the peer, adds nothing.
    pub(super) fn receive(&mut self, received: u32, limit_j: f32) {
        let counts = received.wrapping_sub(self.received).cast_signed().max(0);
        self.received = received;
        self.add(from_count(counts) * (1.0 / COUNTS_PER_J), limit_j);
    }

    /// Adds to the energy available for output. Excess above the limit is discarded, which is conservative.
    pub(super) fn add(&mut self, energy_j: f32, limit_j: f32) {
        self.balance.add_clamped(energy_j, limit_j);
    }

    /// Reports an energy of at least 0 to the peer.
    pub(super) fn send(&mut self, energy_j: f32) {
        let counts = (self.rest + energy_j * COUNTS_PER_J).min(MAX_COUNTS);
        let whole = to_count(counts);
        self.rest = counts - from_count(whole);
        self.sent = self.sent.wrapping_add(whole.cast_unsigned());
    }

    /// Books energy that entered at the port: it first covers a debt, the rest is reported to the peer. Negative energy
    /// left at the port and is subtracted.
    pub(super) fn pass(&mut self, energy_in_j: f32, limit_j: f32) {
        let kept_j = energy_in_j.min((-self.balance_j()).max(0.0));
        self.add(kept_j, limit_j);
        if energy_in_j > kept_j {
            self.send(energy_in_j - kept_j);
        }
    }

    /// Returns the counter to send to the peer.
    pub(super) fn sent(&self) -> u32 {
        self.sent
    }

    /// Returns the energy available for output, `J`; negative if too much was output.
    pub(super) fn balance_j(&self) -> f32 {
        self.balance.value()
    }
}

/// Rounds towards zero; saturates.
#[expect(clippy::cast_possible_truncation, reason = "saturating, towards zero: intended")]
fn to_count(counts: f32) -> i32 {
    counts as i32
}

#[expect(clippy::cast_precision_loss, reason = "a difference of counters, as exact as an energy")]
fn from_count(counts: i32) -> f32 {
    counts as f32
}
