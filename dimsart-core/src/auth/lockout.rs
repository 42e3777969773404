//! Nobody may try short tags for long.

/// Time for which nothing is taken, and in which wrong tags are counted together, `ms`.
pub const LOCKOUT_MS: u32 = 1000;
/// Wrong tags within [`LOCKOUT_MS`] that lead to it.
pub const LOCKOUT_TAGS: u8 = 10;

/// Counts wrong tags.
#[derive(Debug, Default)]
pub(super) struct Lockout {
    wrong: u8,
    since_ms: u32,
    is_locked: bool,
    count: u32,
}

impl Lockout {
    /// Whether nothing is to be tried now.
    pub(super) fn is_locked(&mut self, now_ms: u32) -> bool {
        if now_ms.wrapping_sub(self.since_ms) >= LOCKOUT_MS {
            self.is_locked = false;
            self.wrong = 0;
        }
        self.is_locked
    }

    /// Counts a wrong tag.
    pub(super) fn count_wrong(&mut self, now_ms: u32) {
        if self.wrong == 0 {
            self.since_ms = now_ms;
        }
        self.wrong = self.wrong.saturating_add(1);
        if self.wrong >= LOCKOUT_TAGS {
            self.is_locked = true;
            self.since_ms = now_ms;
            self.count = self.count.saturating_add(1);
        }
    }

    /// How often it came to that.
    pub(super) fn count(&self) -> u32 {
        self.count
    }
}
