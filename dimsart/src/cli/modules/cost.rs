//! Cycles per module kind, from a board's table or an image's stamp.

use std::collections::BTreeMap;
use std::path::Path;

use boards::catalogue::{MODULE_COSTS, ModuleCost, module_costs};
use dimsart_core::{Cost, KindId};
use serde::Serialize;

use crate::stamp::StampedImage;

/// Upper bound of the cycles that a module adds to a tick.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub(super) struct KindCost {
    /// Base, and per axis; none if unknown.
    pub(super) cycles: Option<u16>,
    pub(super) cycles_per_axis: Option<u16>,
    /// Why it is unknown.
    pub(super) no_bound: Option<String>,
}

impl KindCost {
    fn known((cycles, per_axis): (u16, u16)) -> Self {
        Self { cycles: Some(cycles), cycles_per_axis: Some(per_axis), no_bound: None }
    }

    /// Cost on nucleo-g474re, from its table.
    pub(super) fn of_board(kind: &str) -> Self {
        match module_costs(MODULE_COSTS).find(|cost| cost.name == kind) {
            Some(ModuleCost { cycles, per_axis, reason: "", .. }) => Self::known((cycles, per_axis)),
            Some(cost) => Self { no_bound: Some(cost.reason.to_owned()), ..Self::default() },
            None => Self::default(),
        }
    }

    /// Costs of all kinds of an image, from its stamp.
    pub(super) fn of_image(image: &Path) -> Result<BTreeMap<KindId, Self>, Box<dyn std::error::Error>> {
        let unstamped = || format!("image {0} is not stamped: run `dimsart stamp {0}`", image.display());
        let stamp = StampedImage::read(image)?;
        let lines = stamp.costs().ok_or_else(unstamped)?;
        let cost = |cost: &Cost| match *cost {
            Cost::UNKNOWN => Self::default(),
            cost => Self::known(cost.coefficients()),
        };
        // The first line is the tick's.
        Ok(stamp.kinds().into_iter().zip(lines.iter().skip(1).map(cost)).collect())
    }

    /// Table cell.
    pub(super) fn cell(&self) -> String {
        match (self.cycles, self.cycles_per_axis) {
            (Some(cycles), Some(per_axis)) => format!("{cycles} + {per_axis}"),
            _ => "-".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use dimsart_modules::ALL;

    use super::*;

    #[test]
    fn the_board_s_table_says_of_every_kind_what_it_costs_or_why_that_is_not_known() {
        for kind in ALL.list() {
            let KindCost { cycles, cycles_per_axis, no_bound } = KindCost::of_board(kind.name);
            let is_known = cycles.is_some_and(|cycles| cycles > 0) && cycles_per_axis.is_some();
            assert!(is_known != no_bound.is_some(), "{}: run `cargo xtask write module-costs`", kind.name);
        }
    }
}
