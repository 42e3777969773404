//! A cache of flash lines with least-recently-used replacement.

/// Entries of [`LeastRecent::places`], a power of 2.
const PLACES: usize = 1024;

/// A cached line, in a list from the least to the most recently used line.
#[derive(Debug, Clone, Copy)]
struct Line {
    number: u32,
    /// Indices of its neighbours in the list; at an end, its own index.
    older: u8,
    newer: u8,
}

/// Cached flash lines; the least recently used line is replaced.
#[derive(Debug, Clone)]
pub(super) struct LeastRecent {
    lines: Vec<Line>,
    oldest: u8,
    newest: u8,
    /// The likely index in `lines` for each line, by the lower bits of its number; correct for nearly all
    /// lines.
    places: Vec<u8>,
}

impl Default for LeastRecent {
    fn default() -> Self {
        Self { lines: Vec::new(), oldest: 0, newest: 0, places: vec![0; PLACES] }
    }
}

impl LeastRecent {
    /// Uses a line and inserts it if missing. Returns whether it was cached. The cache holds `most` lines, up
    /// to 256.
    pub(super) fn take(&mut self, number: u32, most: u16) -> bool {
        let entry = number as usize % PLACES;
        let likely = self.places.get(entry).copied().unwrap_or(0);
        let is_at = |place: &u8| self.line(*place).is_some_and(|line| line.number == number);
        let found = Some(likely).filter(is_at).or_else(|| self.find(number));
        let place = found.unwrap_or_else(|| self.replace(number, most));
        self.renew(place);
        if let Some(entry) = self.places.get_mut(entry) {
            *entry = place;
        }
        found.is_some()
    }

    fn line(&self, place: u8) -> Option<&Line> {
        self.lines.get(usize::from(place))
    }

    fn find(&self, number: u32) -> Option<u8> {
        let place = self.lines.iter().position(|line| line.number == number)?;
        u8::try_from(place).ok()
    }

    /// Inserts a line in a free place or replaces the least recently used line. Returns its index.
    fn replace(&mut self, number: u32, most: u16) -> u8 {
        match u8::try_from(self.lines.len()) {
            Ok(place) if u16::from(place) < most => {
                let newest = self.newest;
                if let Some(line) = self.lines.get_mut(usize::from(newest)) {
                    line.newer = place;
                }
                self.lines.push(Line { number, older: newest, newer: place });
                self.newest = place;
                place
            }
            _ => {
                if let Some(line) = self.lines.get_mut(usize::from(self.oldest)) {
                    line.number = number;
                }
                self.oldest
            }
        }
    }

    /// Makes a line the most recently used line.
    fn renew(&mut self, place: u8) {
        let newest = self.newest;
        let Some(&Line { older, newer, .. }) = self.line(place).filter(|_| place != newest) else { return };
        let is_oldest = place == self.oldest;
        if is_oldest {
            self.oldest = newer;
        } else {
            self.set(older, |line| line.newer = newer);
        }
        self.set(newer, |line| line.older = if is_oldest { newer } else { older });
        self.set(newest, |line| line.newer = place);
        self.set(place, |line| (line.older, line.newer) = (newest, place));
        self.newest = place;
    }

    fn set(&mut self, place: u8, change: impl FnOnce(&mut Line)) {
        if let Some(line) = self.lines.get_mut(usize::from(place)) {
            change(line);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    #[test]
    fn it_holds_the_most_recently_used_lines() {
        for most in [1, 2, 3, 32, 256] {
            let (mut cache, mut model) = (LeastRecent::default(), Vec::new());
            let mut random = Pcg64Mcg::seed_from_u64(most.into());
            for _ in 0..20_000 {
                // Twice as many lines as the cache holds, some of which share an entry.
                let number = random.next_u32() % (2 * u32::from(most)) + (random.next_u32() % 2) * 1024;
                let was_there =
                    model.iter().position(|held| *held == number).map(|place| model.remove(place));
                model.push(number);
                if model.len() > usize::from(most) {
                    model.remove(0);
                }
                assert_eq!(cache.take(number, most), was_there.is_some(), "{number} of {most}");
            }
        }
    }
}
