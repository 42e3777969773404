//! A cache of flash lines with least-recently-used replacement.

/// Maximum entries of [`LeastRecent::places`], a power of 2: all lines of 512 KiB.
const PLACES: usize = 1 << 16;

/// A cached line, in a list from the least to the most recently used line.
#[derive(Debug, Clone, Copy)]
struct Line {
    number: u32,
    /// Indices of its neighbours in the list; at an end, its own index.
    older: u8,
    newer: u8,
}

/// Cached flash lines; the least recently used line is replaced.
#[derive(Debug, Clone, Default)]
pub(super) struct LeastRecent {
    lines: Vec<Line>,
    oldest: u8,
    newest: u8,
    /// Index in `lines` plus 1, by the lower bits of a line's number; 0 if it is not cached.
    places: Vec<u16>,
}

impl LeastRecent {
    /// Uses a line and inserts it if missing. Returns whether it was cached. The cache holds `most` lines, up
    /// to 256.
    #[inline]
    pub(super) fn take(&mut self, number: u32, most: u16) -> bool {
        let place = self.places.get(number as usize % PLACES).and_then(|entry| entry.checked_sub(1));
        let place = place.and_then(|place| u8::try_from(place).ok());
        let found = place.filter(|place| self.line(*place).is_some_and(|line| line.number == number));
        let place = found.unwrap_or_else(|| self.replace(number, most));
        self.renew(place);
        found.is_some()
    }

    fn line(&self, place: u8) -> Option<&Line> {
        self.lines.get(usize::from(place))
    }

    fn set_entry(&mut self, number: u32, entry: u16) {
        let index = number as usize % PLACES;
        if index >= self.places.len() {
            self.places.resize(index + 1, 0);
        }
        if let Some(place) = self.places.get_mut(index) {
            *place = entry;
        }
    }

    /// Inserts a line in a free place or replaces the least recently used line. Returns its index.
    fn replace(&mut self, number: u32, most: u16) -> u8 {
        let place = match u8::try_from(self.lines.len()) {
            Ok(place) if u16::from(place) < most => {
                let newest = self.newest;
                self.set(newest, |line| line.newer = place);
                self.lines.push(Line { number, older: newest, newer: place });
                self.newest = place;
                place
            }
            _ => {
                let replaced = self.line(self.oldest).map(|line| line.number);
                replaced.into_iter().for_each(|replaced| self.set_entry(replaced, 0));
                self.set(self.oldest, |line| line.number = number);
                self.oldest
            }
        };
        self.set_entry(number, u16::from(place) + 1);
        place
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
