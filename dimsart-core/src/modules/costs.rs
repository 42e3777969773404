//! What the modules cost, by the machine code. Written by `cargo xtask costs`.
//!
//! Each is the smallest line above the bounds on all boards' images for 1 to 8 degrees of freedom, with every choice of
//! its parameters; what the engine takes to call it is in it. `cargo xtask long` holds the table to the images. A new
//! kind of module has no line and is refused where a tick may take so long only: run `cargo xtask costs`.

use crate::cost::{Cost, Costs};

/// A tick without modules: the device's signals in and out, and the engine.
pub const TICK: Cost = Cost::new(825, 73);

/// What each kind of module adds.
pub const COSTS: &Costs = &[
    ("COMM_RXMOD", Cost::new(858, 504)),
    ("COMM_TXMOD", Cost::new(554, 172)),
    ("WTRANSF_MOD", Cost::new(404, 173)),
    ("WIMPEDANCE_MOD", Cost::new(128, 35)),
    ("TIMEDELAY_MOD", Cost::new(166, 14)),
    ("PCTRL_MOD", Cost::new(106, 29)),
    ("PDCTRL_MOD", Cost::new(198, 82)),
    ("PIDCTRL_MOD", Cost::new(142, 91)),
    ("VWALL_MOD", Cost::new(134, 70)),
    ("SUM_MOD", Cost::new(118, 33)),
    ("NORMALIZER_MOD", Cost::new(87, 38)),
    ("INTEGRATOR_MOD", Cost::new(102, 65)),
    ("DIFFERENTIATOR_MOD", Cost::new(107, 36)),
    ("VEL2POS_MOD", Cost::new(119, 38)),
    ("SIGGEN_MOD", Cost::new(184, 23)),
    ("RECORDER_MOD", Cost::new(152, 11)),
];
