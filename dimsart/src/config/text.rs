//! Text of a configuration, and the sides of its rows.

use dimsart_core::{AxisKind, scheme};

use crate::connect::Identity;

/// Adds a header with the source to rows. The same rows of the same device give the same bytes.
#[must_use]
pub fn text(identity: &Identity, rows: &str) -> String {
    let Identity { protocol_version, device, image, axes, sample_period_s } = identity;
    let kind = |axis: &AxisKind| match axis {
        AxisKind::Linear => "linear",
        AxisKind::Rotary => "rotary",
    };
    let axes: Vec<_> = axes.iter().map(kind).collect();
    format!(
        "# Configuration of {device}, image {image}, protocol {protocol_version}\n# axes: {}; a tick every \
         {sample_period_s} s\n#\n# dest  module  command  value\n{rows}",
        axes.join(", ")
    )
}

/// Returns the line, from 1, and side of the first row that is for a single side.
#[must_use]
pub fn first_side(text: &str) -> Option<(usize, &str)> {
    let found = scheme::rows(text).find(|row| row.word(0) != "all")?;
    Some((found.line(), found.word(0)))
}
