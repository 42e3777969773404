//! What a word can be: a few numbers, or every so many-th number of an interval.

mod arithmetic;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use arithmetic::shifted;

/// Most numbers that are kept one by one.
pub(crate) const MAX_SET: usize = 8;
/// Most results that a function is tried on one by one.
const MAX_TRIED: u64 = 64;

/// The numbers that a word can be; never none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Values(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Ascending, without repetitions; what is behind the first `count` is zero.
    Set { numbers: [u32; MAX_SET], count: u8 },
    /// More than [`MAX_SET`] numbers: from `low` to `high` in steps that divide the distance.
    Range { low: u32, high: u32, step: u32 },
}

impl Values {
    /// Every number.
    pub(crate) const ALL: Self = Self(Kind::Range { low: 0, high: u32::MAX, step: 1 });

    /// One number.
    pub(crate) fn one(number: u32) -> Self {
        let mut numbers = [0; MAX_SET];
        if let Some(first) = numbers.first_mut() {
            *first = number;
        }
        Self(Kind::Set { numbers, count: 1 })
    }

    /// Every number from `low` to `high`; the two in any order.
    pub(crate) fn between(low: u32, high: u32) -> Self {
        Self::stepped(low.min(high), low.max(high), 1)
    }

    /// `low` and every `step`-th number after it up to `high`, which must not be below `low`.
    pub(crate) fn stepped(low: u32, high: u32, step: u32) -> Self {
        let step = step.max(1);
        let high = low + (high.max(low) - low) / step * step;
        let range = Kind::Range { low, high, step };
        if u64::from((high - low) / step) < MAX_SET as u64 {
            Self::collect_few::<MAX_SET>(Self(range).iter()).unwrap_or(Self::one(low))
        } else {
            Self(range)
        }
    }

    /// All of these numbers, perhaps with some between them. The iterator must not be empty: it is 0 alone then.
    pub(crate) fn collect(numbers: impl Iterator<Item = u32>) -> Self {
        Self::of(&mut numbers.collect::<Vec<u32>>()).unwrap_or(Self::one(0))
    }

    /// The same of so few that they need no memory of their own: of the first `MAX`.
    fn collect_few<const MAX: usize>(numbers: impl Iterator<Item = u32>) -> Option<Self> {
        let (mut all, mut count) = ([0; MAX], 0);
        for (place, number) in all.iter_mut().zip(numbers) {
            *place = number;
            count += 1;
        }
        Self::of(all.get_mut(..count)?)
    }

    fn of(numbers: &mut [u32]) -> Option<Self> {
        numbers.sort_unstable();
        let (low, high) = (*numbers.first()?, *numbers.last()?);
        let (mut set, mut count, mut last) = ([0; MAX_SET], 0_u8, None);
        for number in numbers.iter().copied() {
            if last == Some(number) {
                continue;
            }
            let Some(place) = set.get_mut(usize::from(count)) else {
                let step = numbers.iter().fold(0, |step, number| greatest_divisor(step, number - low));
                return Some(Self(Kind::Range { low, high, step }));
            };
            *place = number;
            (count, last) = (count + 1, Some(number));
        }
        Some(Self(Kind::Set { numbers: set, count }))
    }

    /// Results of a function of three words, if these have few enough values to be tried one by one.
    pub(crate) fn map(words: [Self; 3], function: impl Fn([u32; 3]) -> u32) -> Option<Self> {
        let [a, b, c] = words;
        let count = a.count().saturating_mul(b.count()).saturating_mul(c.count());
        if count > MAX_TRIED {
            return None;
        }
        let mut results = Vec::new();
        for x in a.iter() {
            for y in b.iter() {
                results.extend(c.iter().map(|z| function([x, y, z])));
            }
        }
        Self::of(&mut results)
    }

    /// The smallest of them.
    pub(crate) fn low(&self) -> u32 {
        match &self.0 {
            Kind::Set { numbers, .. } => numbers.first().copied().unwrap_or(0),
            Kind::Range { low, .. } => *low,
        }
    }

    /// The greatest of them.
    pub(crate) fn high(&self) -> u32 {
        match &self.0 {
            Kind::Set { numbers, count } => {
                usize::from(*count).checked_sub(1).and_then(|last| numbers.get(last)).copied().unwrap_or(0)
            }
            Kind::Range { high, .. } => *high,
        }
    }

    /// What divides every distance between two of them; 0 when there is but one.
    pub(crate) fn step(&self) -> u32 {
        match &self.0 {
            Kind::Set { .. } => {
                self.iter().fold(0, |step, number| greatest_divisor(step, number - self.low()))
            }
            Kind::Range { step, .. } => *step,
        }
    }

    /// How many there are.
    pub(crate) fn count(&self) -> u64 {
        match &self.0 {
            Kind::Set { count, .. } => u64::from(*count),
            Kind::Range { low, high, step } => u64::from((high - low) / step) + 1,
        }
    }

    /// The number, if there is but one.
    pub(crate) fn single(&self) -> Option<u32> {
        match &self.0 {
            Kind::Set { numbers, count: 1 } => numbers.first().copied(),
            _ => None,
        }
    }

    /// Whether it is one of them.
    pub(crate) fn contains(&self, number: u32) -> bool {
        match &self.0 {
            Kind::Set { .. } => self.iter().any(|member| member == number),
            Kind::Range { low, high, step } => {
                (*low..=*high).contains(&number) && (number - low).is_multiple_of(*step)
            }
        }
    }

    /// All of them, ascending.
    pub(crate) fn iter(&self) -> impl Iterator<Item = u32> + use<> {
        let (numbers, count, low, step) = match self.0 {
            Kind::Set { numbers, count } => (numbers, u64::from(count), 0, 0),
            Kind::Range { low, step, .. } => ([0; MAX_SET], self.count(), low, step),
        };
        (0..count).map(move |place| {
            let place = usize::try_from(place).unwrap_or(usize::MAX);
            match step {
                0 => numbers.get(place).copied().unwrap_or(0),
                _ => low.wrapping_add(u32::try_from(place).unwrap_or(0).wrapping_mul(step)),
            }
        })
    }

    /// Those of both, perhaps with some between them.
    pub(crate) fn union(&self, other: &Self) -> Self {
        if self == other {
            return *self;
        }
        if let (Kind::Set { .. }, Kind::Set { .. }) = (&self.0, &other.0) {
            let both = self.iter().chain(other.iter());
            return Self::collect_few::<{ 2 * MAX_SET }>(both).unwrap_or(*self);
        }
        let (low, high) = (self.low().min(other.low()), self.high().max(other.high()));
        let step = greatest_divisor(self.step(), other.step());
        Self::stepped(low, high, greatest_divisor(step, self.low().abs_diff(other.low())))
    }

    /// Those that are of both, perhaps with some others of `self`.
    pub(crate) fn intersection(&self, other: &Self) -> Option<Self> {
        match (&self.0, &other.0) {
            (Kind::Set { .. }, _) => self.retain(|number| other.contains(number)),
            (_, Kind::Set { .. }) => other.retain(|number| self.contains(number)),
            (Kind::Range { step, .. }, Kind::Range { step: other_step, .. }) => {
                let (wide, narrow) = if step >= other_step { (other, self) } else { (self, other) };
                narrow.limit(wide.low(), wide.high())
            }
        }
    }

    /// Those from `low` to `high`.
    pub(crate) fn limit(&self, least: u32, greatest: u32) -> Option<Self> {
        match self.0 {
            Kind::Set { .. } => self.retain(|number| (least..=greatest).contains(&number)),
            Kind::Range { low, high, .. } if least <= low && high <= greatest => Some(*self),
            Kind::Range { low, high, step } => {
                let from = low.checked_add(least.saturating_sub(low).div_ceil(step).checked_mul(step)?)?;
                (from <= high.min(greatest)).then(|| Self::stepped(from, high.min(greatest), step))
            }
        }
    }

    /// Whether one of them is from `low` to `high`: [`limit`](Self::limit) without its numbers.
    pub(crate) fn reaches(&self, least: u32, greatest: u32) -> bool {
        match self.0 {
            Kind::Set { .. } => self.iter().any(|number| (least..=greatest).contains(&number)),
            Kind::Range { low, high, step } => {
                let beyond = least.saturating_sub(low).div_ceil(step).checked_mul(step);
                beyond
                    .and_then(|beyond| low.checked_add(beyond))
                    .is_some_and(|from| from <= high.min(greatest))
            }
        }
    }

    /// Those for which something holds; all while there are too many to try them.
    pub(crate) fn retain(&self, holds: impl Fn(u32) -> bool) -> Option<Self> {
        if self.count() > MAX_TRIED {
            return Some(*self);
        }
        let kept = self.iter().filter(|number| holds(*number));
        match self.0 {
            Kind::Set { .. } => Self::collect_few::<MAX_SET>(kept),
            Kind::Range { .. } => Self::of(&mut kept.collect::<Vec<u32>>()),
        }
    }
}

/// Greatest number that divides both; 0 is divided by every number.
fn greatest_divisor(a: u32, b: u32) -> u32 {
    let (mut a, mut b) = (a, b);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}
