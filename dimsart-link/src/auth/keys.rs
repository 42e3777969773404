//! Key derivation for one line: a key per role, and a key per session.

use super::line::KeyDomain;
use super::tag::{ContentKey, Key, TAG_BYTES};

/// The two nonces of a session, one from each end. No two sessions have the same pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Nonces {
    pub(super) sealer: u64,
    pub(super) opener: u64,
}

/// The statements that a handshake authenticates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Statement {
    /// The opener answers a sealer.
    Challenge,
    /// The sealer answers the challenge.
    Proof,
    /// The opener accepts the session.
    SessionAccepted,
}

/// The keys of both ends of one line. Their expanded key schedules are not stored: they take 22 times the
/// memory and are not needed per message.
#[derive(Debug)]
pub(super) struct LineKeys {
    line: KeyDomain,
    sealer: Key,
    opener: Key,
}

impl LineKeys {
    pub(super) fn new(key: &Key, line: KeyDomain) -> Self {
        let of = |role| key.derive(role, &line.to_bytes());
        Self { line, sealer: of("sealer"), opener: of("opener") }
    }

    /// Returns a nonce that is unique per seed and `count`.
    pub(super) fn sealer_nonce(&self, seed: u64, count: u32) -> u64 {
        nonce(&self.sealer, seed, count)
    }

    /// Returns a nonce that is unique per seed and `count`.
    pub(super) fn opener_nonce(&self, seed: u64, count: u32) -> u64 {
        nonce(&self.opener, seed, count)
    }

    /// Authenticates a statement for one session and direction.
    pub(super) fn tag(&self, statement: Statement, channel: u16, nonces: Nonces) -> [u8; TAG_BYTES] {
        let (key, label) = match statement {
            Statement::Challenge => (&self.opener, "challenge"),
            Statement::Proof => (&self.sealer, "proof"),
            Statement::SessionAccepted => (&self.opener, "taken"),
        };
        key.derive(label, &context(channel, nonces)).first_bytes()
    }

    /// Derives the key of a session.
    pub(super) fn contents(&self, channel: u16, nonces: Nonces) -> ContentKey {
        ContentKey::new(&self.sealer.derive("contents", &context(channel, nonces)), self.line)
    }
}

fn nonce(key: &Key, seed: u64, count: u32) -> u64 {
    let mut context = [0; 12];
    fill(&mut context, &[&seed.to_le_bytes(), &count.to_le_bytes()]);
    u64::from_le_bytes(key.derive("nonce", &context).first_bytes())
}

/// Distinguishes the two directions of a link: the sealer's nonce is first.
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
