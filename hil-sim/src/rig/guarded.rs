//! The end of a link whose packets are authenticated.

use dimsart_core::auth::{AuthError, Guard};
use dimsart_core::envelope::MAX_CONTENT_BYTES;

/// A guard, and what it has seen so far.
#[derive(Debug)]
pub(super) struct Guarded {
    /// Number of the link in the station's Data Base.
    pub(super) link: usize,
    pub(super) guard: Guard,
    pub(super) refusal: Option<AuthError>,
    period_s: f64,
    ticks: u32,
}

impl Guarded {
    pub(super) fn new(link: usize, guard: Guard, period_s: f64) -> Self {
        Self { link, guard, refusal: None, period_s, ticks: 0 }
    }

    /// Lets time pass: it also does while the world stands still.
    pub(super) fn tick(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a clock that wraps")]
    fn now_ms(&self) -> u32 {
        (f64::from(self.ticks) * self.period_s * 1e3) as u64 as u32
    }

    /// Gives `deliver` what the other side's guard was given; nothing at all in place of what is refused.
    pub(super) fn open(&mut self, bytes: &[u8], mut deliver: impl FnMut(&[u8])) {
        match self.guard.take(self.now_ms(), bytes, &mut [0; MAX_CONTENT_BYTES]) {
            Ok(content) => content.into_iter().for_each(deliver),
            Err(error) => {
                self.refusal = Some(error);
                deliver(&[]);
            }
        }
    }

    /// The handshakes that are due.
    pub(super) fn shake_hands(&mut self, mut carry: impl FnMut(&[u8])) {
        let now_ms = self.now_ms();
        while let Some(handshake) = self.guard.handshake(now_ms) {
            carry(handshake);
        }
    }

    /// The content with a tag. It is lost while the other side has not answered.
    pub(super) fn seal(&mut self, content: &[u8], carry: impl FnMut(&[u8])) {
        let mut out = [0; MAX_CONTENT_BYTES];
        self.guard.seal(content, &mut out).into_iter().for_each(carry);
    }
}

/// Lets two guards find together without a link in between.
pub(super) fn introduce(left: &mut Guard, right: &mut Guard) {
    let tell = |from: &mut Guard, to: &mut Guard, now_ms| {
        while let Some(handshake) = from.handshake(now_ms) {
            // A handshake between equal keys and channels is always taken.
            let _ = to.take(now_ms, handshake, &mut []);
        }
    };
    for round in 1..=3 {
        let now_ms = round * dimsart_core::auth::CHALLENGE_MS;
        tell(left, right, now_ms);
        tell(right, left, now_ms);
    }
}
