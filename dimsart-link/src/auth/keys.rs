//! What is made of a key for one line: another key for each role, and one for the contents of each association.

use super::line::Line;
use super::tag::{ContentKey, Key, TAG_BYTES};

/// The two numbers of an association, of which each end has made one. No two associations have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Nonces {
    pub(super) sealer: u64,
    pub(super) opener: u64,
}

/// What an end says in a handshake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Statement {
    /// The opener answers a sealer.
    Challenge,
    /// The sealer has heard that.
    Proof,
    /// The opener takes what is sealed so.
    Taken,
}

/// The keys of both ends of one line. They are not kept ready, which takes 22 times the memory: contents need others.
#[derive(Debug)]
pub(super) struct LineKeys {
    line: Line,
    sealer: Key,
    opener: Key,
}

impl LineKeys {
    pub(super) fn new(key: &Key, line: Line) -> Self {
        let of = |role| key.derive(role, &line.to_bytes());
        Self { line, sealer: of("sealer"), opener: of("opener") }
    }

    /// Another number for every `count` and every life of the sealer.
    pub(super) fn sealer_nonce(&self, seed: u64, count: u32) -> u64 {
        nonce(&self.sealer, seed, count)
    }

    /// Another number for every `count` and every life of the opener.
    pub(super) fn opener_nonce(&self, seed: u64, count: u32) -> u64 {
        nonce(&self.opener, seed, count)
    }

    /// Makes a statement one that only who has the key can make, of one association and for a direction.
    pub(super) fn tag(&self, statement: Statement, channel: u16, nonces: Nonces) -> [u8; TAG_BYTES] {
        let (key, label) = match statement {
            Statement::Challenge => (&self.opener, "challenge"),
            Statement::Proof => (&self.sealer, "proof"),
            Statement::Taken => (&self.opener, "taken"),
        };
        key.derive(label, &context(channel, nonces)).first_bytes()
    }

    /// The key of an association's contents.
    pub(super) fn contents(&self, channel: u16, nonces: Nonces) -> ContentKey {
        ContentKey::new(&self.sealer.derive("contents", &context(channel, nonces)), self.line)
    }
}

fn nonce(key: &Key, seed: u64, count: u32) -> u64 {
    let mut context = [0; 12];
    fill(&mut context, &[&seed.to_le_bytes(), &count.to_le_bytes()]);
    u64::from_le_bytes(key.derive("nonce", &context).first_bytes())
}

/// What tells the two directions of a link apart, too: who seals comes first.
fn context(channel: u16, Nonces { sealer, opener }: Nonces) -> [u8; 18] {
    let mut context = [0; 18];
    fill(&mut context, &[&channel.to_le_bytes(), &sealer.to_le_bytes(), &opener.to_le_bytes()]);
    context
}

fn fill(to: &mut [u8], parts: &[&[u8]]) {
    for (to, from) in to.iter_mut().zip(parts.iter().copied().flatten()) {
        *to = *from;
    }
}
