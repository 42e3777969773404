//! What a kind of module adds to a tick: cycles of the processor.

/// Most cycles that a module adds to a tick, by the machine code: `offset + per_dof * dof`.
///
/// TRM-model cycles of a Cortex-M4F whose memory does not wait, by bounds with every choice and switch among the
/// module's parameters and two values of each number, whatever is measured and comes in, and with the most that a COMM
/// module can carry: nothing but plugging in is taken to change what a scheme may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    offset: u16,
    per_dof: u16,
}

impl Cost {
    /// A straight line over the degrees of freedom: cycles, and cycles for each.
    #[must_use]
    pub const fn new(offset: u16, per_dof: u16) -> Self {
        Self { offset, per_dof }
    }

    /// For a device with `dof` degrees of freedom, of which there are at most
    /// [`MAX_DOF`](crate::limits::MAX_DOF).
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "at most MAX_DOF")]
    pub const fn cycles(self, dof: usize) -> u32 {
        self.offset as u32 + self.per_dof as u32 * dof as u32
    }
}

/// Costs by the names of kinds; see [`module_list!`](crate::module_list).
pub type Costs = [(&'static str, Cost)];

/// The cost of the kind with this name, out of the first table that knows it; none if no table does.
#[must_use]
pub const fn cost_of(name: &str, mut tables: &[&Costs]) -> Option<Cost> {
    while let [table, others @ ..] = tables {
        let mut lines: &Costs = table;
        while let [(known, cost), rest @ ..] = lines {
            if is_same(known.as_bytes(), name.as_bytes()) {
                return Some(*cost);
            }
            lines = rest;
        }
        tables = others;
    }
    None
}

const fn is_same(mut left: &[u8], mut right: &[u8]) -> bool {
    while let ([one, left_rest @ ..], [other, right_rest @ ..]) = (left, right) {
        if *one != *other {
            return false;
        }
        (left, right) = (left_rest, right_rest);
    }
    left.is_empty() && right.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &Costs = &[("P", Cost::new(100, 10)), ("PD", Cost::new(200, 20))];

    #[test]
    fn a_cost_is_a_straight_line() {
        assert_eq!([0, 1, 7].map(|dof| Cost::new(100, 10).cycles(dof)), [100, 110, 170]);
        assert_eq!(Cost::new(u16::MAX, u16::MAX).cycles(8), 9 * u32::from(u16::MAX));
    }

    #[test]
    fn a_kind_is_found_by_its_whole_name_or_is_unknown() {
        assert_eq!(cost_of("PD", &[&[], TABLE]), Some(Cost::new(200, 20)));
        assert_eq!(
            cost_of("P", &[&[("P", Cost::new(1, 1))], TABLE]),
            Some(Cost::new(1, 1)),
            "the first table"
        );
        for unknown in ["", "D", "PID", "p"] {
            assert_eq!(cost_of(unknown, &[TABLE]), None, "{unknown}");
        }
    }
}
