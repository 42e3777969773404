//! What the modules cost, by the machine code. Written by `cargo xtask costs`.
//!
//! Each is the smallest line above the bounds on all boards' images for 1 to 8 degrees of freedom, with every choice of
//! its parameters; what the engine takes to call it is in it. `cargo xtask long` holds the table to the images. A new
//! kind of module has no line and is refused where a tick may take so long only: run `cargo xtask costs`.
//!
//! Images by rustc 1.95.0.

use crate::cost::{Cost, Costs};

/// A tick without modules: the device's signals in and out, and the engine.
pub const TICK: Cost = Cost::new(557, 69);

/// What each kind of module adds.
pub const COSTS: &Costs = &[
    ("COMM_RXMOD", Cost::new(772, 499)),
    ("COMM_TXMOD", Cost::new(513, 145)),
    ("WTRANSF_MOD", Cost::new(356, 142)),
    ("WIMPEDANCE_MOD", Cost::new(112, 35)),
    ("TIMEDELAY_MOD", Cost::new(168, 11)),
    ("PCTRL_MOD", Cost::new(106, 17)),
    ("PDCTRL_MOD", Cost::new(150, 61)),
    ("PIDCTRL_MOD", Cost::new(139, 83)),
    ("VWALL_MOD", Cost::new(135, 66)),
    ("SUM_MOD", Cost::new(106, 22)),
    ("NORMALIZER_MOD", Cost::new(91, 46)),
    ("INTEGRATOR_MOD", Cost::new(95, 59)),
    ("DIFFERENTIATOR_MOD", Cost::new(100, 33)),
    ("VEL2POS_MOD", Cost::new(116, 34)),
    ("SIGGEN_MOD", Cost::new(204, 16)),
    ("RECORDER_MOD", Cost::new(142, 9)),
];
