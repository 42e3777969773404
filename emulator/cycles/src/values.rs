//! The set of possible values of a word: a few numbers, or an arithmetic progression.

mod arithmetic;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use arithmetic::shifted;

/// Maximum number of explicitly stored numbers.
pub(crate) const MAX_SET: usize = 8;
/// Maximum number of combinations for which a function is evaluated.
const MAX_TRIED: u64 = 64;

/// The possible values of a word; never empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Values(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Ascending, without duplicates; entries after the first `count` are zero.
    Set { numbers: [u32; MAX_SET], count: u8 },
    /// More than [`MAX_SET`] numbers: from `low` to `high`; `step` divides their difference.
    Range { low: u32, high: u32, step: u32 },
}

impl Values {
    /// All numbers.
    pub(crate) const ALL: Self = Self(Kind::Range { low: 0, high: u32::MAX, step: 1 });

    /// One number.
    pub(crate) fn one(number: u32) -> Self {
        let mut numbers = [0; MAX_SET];
        if let Some(first) = numbers.first_mut() {
            *first = number;
        }
        Self(Kind::Set { numbers, count: 1 })
    }

    /// All numbers from `low` to `high`, in either order.
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

    /// A set that covers these numbers, possibly with others between them. For an empty iterator, the set is
    /// {0}.
    pub(crate) fn collect(numbers: impl Iterator<Item = u32>) -> Self {
        Self::of(&mut numbers.collect::<Vec<u32>>()).unwrap_or(Self::one(0))
    }

    /// The same for the first `MAX` numbers, without a heap allocation.
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

    /// Results of a function of three words, if these have few enough combinations to evaluate all.
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

    /// Minimum.
    pub(crate) fn low(&self) -> u32 {
        match &self.0 {
            Kind::Set { numbers, .. } => numbers.first().copied().unwrap_or(0),
            Kind::Range { low, .. } => *low,
        }
    }

    /// Maximum.
    pub(crate) fn high(&self) -> u32 {
        match &self.0 {
            Kind::Set { numbers, count } => {
                usize::from(*count).checked_sub(1).and_then(|last| numbers.get(last)).copied().unwrap_or(0)
            }
            Kind::Range { high, .. } => *high,
        }
    }

    /// A common divisor of all differences; 0 for a single number.
    pub(crate) fn step(&self) -> u32 {
        match &self.0 {
            Kind::Set { .. } => {
                self.iter().fold(0, |step, number| greatest_divisor(step, number - self.low()))
            }
            Kind::Range { step, .. } => *step,
        }
    }

    /// Number of values.
    pub(crate) fn count(&self) -> u64 {
        match &self.0 {
            Kind::Set { count, .. } => u64::from(*count),
            Kind::Range { low, high, step } => u64::from((high - low) / step) + 1,
        }
    }

    /// The number, if there is only one.
    pub(crate) fn single(&self) -> Option<u32> {
        match &self.0 {
            Kind::Set { numbers, count: 1 } => numbers.first().copied(),
            _ => None,
        }
    }

    /// Whether the set contains a number.
    pub(crate) fn contains(&self, number: u32) -> bool {
        match &self.0 {
            Kind::Set { .. } => self.iter().any(|member| member == number),
            Kind::Range { low, high, step } => {
                (*low..=*high).contains(&number) && (number - low).is_multiple_of(*step)
            }
        }
    }

    /// All numbers, ascending.
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

    /// Numbers in either set, possibly with others between them.
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

    /// Numbers in both sets, possibly with others from one set.
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

    /// The numbers from `least` to `greatest`.
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

    /// Whether a number from `least` to `greatest` is in the set: [`limit`](Self::limit) without its result.
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

    /// The numbers that satisfy a predicate; all of them if there are too many to test.
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

/// Greatest common divisor; every number divides 0.
fn greatest_divisor(a: u32, b: u32) -> u32 {
    let (mut a, mut b) = (a, b);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}
