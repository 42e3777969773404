//! The module kinds of this image.

use dimsart_core::{KindId, ModuleKinds, join_kinds};
use dimsart_modules::{
    BASIC, CONTROL, ENERGY, FILTERS, JOINT_CONTROL, LIMITS, LOGIC, ONLINE, ROBOTS, SIGNALS, TELEOPERATION,
    TRAJECTORIES,
};
use own_modules::OWN;

/// The selected groups and the project's kinds.
pub(crate) const MODULES: ModuleKinds = join_kinds![
    BASIC,
    if cfg!(feature = "control") { CONTROL } else { ModuleKinds::NONE },
    if cfg!(feature = "joint-control") { JOINT_CONTROL } else { ModuleKinds::NONE },
    if cfg!(feature = "signals") { SIGNALS } else { ModuleKinds::NONE },
    if cfg!(feature = "filters") { FILTERS } else { ModuleKinds::NONE },
    if cfg!(feature = "trajectories") { TRAJECTORIES } else { ModuleKinds::NONE },
    if cfg!(feature = "limits") { LIMITS } else { ModuleKinds::NONE },
    if cfg!(feature = "logic") { LOGIC } else { ModuleKinds::NONE },
    if cfg!(feature = "robots") { ROBOTS } else { ModuleKinds::NONE },
    if cfg!(feature = "teleoperation") { TELEOPERATION } else { ModuleKinds::NONE },
    if cfg!(feature = "energy") { ENERGY } else { ModuleKinds::NONE },
    if cfg!(feature = "online") { ONLINE } else { ModuleKinds::NONE },
    OWN,
];

/// Whether a kind runs uploaded laws.
pub(crate) const RUNS_PROGRAMS: bool = cfg!(feature = "online");

/// Number of module kinds.
pub(crate) const COUNT: usize = MODULES.list().len();

/// Their ids.
pub(crate) const IDS: [KindId; COUNT] = MODULES.ids();
