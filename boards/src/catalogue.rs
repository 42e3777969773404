//! Board data for building, checking and flashing images: a file per board.

pub(crate) mod b_g431b_esc1;
pub mod ihm08m1;
pub(crate) mod mps2_an386;
pub(crate) mod nucleo_g474re;
mod pins;

pub use pins::{Pin, PinDirection, PinGroup, PinMode, PinPlan};

use dimsart_core::limits::Capacities;

use crate::current_loop::Scaling;
use crate::motor::Motor;

/// A built-in scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltInScheme {
    /// Name, as in `builtin:NAME`.
    pub name: &'static str,
    /// The scheme's rows.
    pub text: &'static str,
}

/// The paper's bilateral scheme, for devices of its size.
const BILATERAL: BuiltInScheme =
    BuiltInScheme { name: "bilateral", text: include_str!("../schemes/bilateral.scheme") };
/// The same for motors of 0.1 N·m or more.
const SMALL_MOTORS: BuiltInScheme =
    BuiltInScheme { name: "small_motors", text: include_str!("../schemes/small_motors.scheme") };

/// A registered board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardInfo {
    /// Name, equal to its feature and file names.
    pub name: &'static str,
    /// The linker's memory map of its images.
    pub memory_map: &'static str,
    /// Budget as TOML: `tick_percent` of the period for a tick of any scheme; `flash_bytes` and `ram_bytes`
    /// of the default image, if limited; cycles and stack of the shipped scheme's parts.
    pub budget: &'static str,
    /// Further data for tools.
    pub tooling: ToolData,
}

impl BoardInfo {
    /// Returns whether its images contain a group of modules; every image contains `basic`.
    #[must_use]
    pub fn has_group(&self, group: &str) -> bool {
        group == "basic" || self.tooling.modules.contains(&group)
    }
}

/// Data of a board other than its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolData {
    /// Processor clock.
    pub clock_hz: u32,
    /// Ticks per second.
    pub tick_hz: u32,
    /// Axes of its device; the default for a simulated device.
    pub axes: usize,
    /// Capacity of its controllers; programs only in images that can run them.
    pub sizes: Capacities,
    /// Memory that its images run from.
    pub memory: CodeMemory,
    /// Name of the chip in probe-rs, for `probe-rs run --chip NAME`; `None` for an emulated board.
    pub chip: Option<&'static str>,
    /// Default groups of [`MODULE_GROUPS`], limited by its flash.
    pub modules: &'static [&'static str],
    /// Features of further images; several features of one image are separated by commas.
    pub variants: &'static [&'static str],
    /// Pin assignment; empty for an emulated board.
    pub pins: &'static [PinPlan],
    /// Interrupt handlers with their priorities; lower numbers have higher priority.
    pub interrupts: &'static [(&'static str, i16)],
    /// The motor of each axis; `None` for a simulated device.
    pub motor: Option<Motor>,
    /// The drive; `None` if the actuator is driven by a voltage or simulated.
    pub drive: Option<ThreePhaseDrive>,
    /// The scheme of its images, used without a stored scheme. Its gains fit the motor: one encoder count
    /// commands at most 1 % of the maximum torque.
    pub scheme: BuiltInScheme,
}

/// A three-phase motor with field-oriented control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreePhaseDrive {
    /// The image's configuration, used without a stored one.
    pub configuration: drive::Configuration,
    /// Scaling of the measurements.
    pub scaling: Scaling,
}

/// The memory that code runs from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CodeMemory {
    /// Without wait states.
    ZeroWaitStates,
    /// Flash of an STM32G4 above 136 MHz, with wait states, and CCM SRAM without.
    Stm32G4,
}

/// Optional groups of modules, each a feature of the firmware.
pub const MODULE_GROUPS: [&str; 11] = [
    "control",
    "energy",
    "filters",
    "joint-control",
    "limits",
    "logic",
    "online",
    "robots",
    "signals",
    "teleoperation",
    "trajectories",
];

/// The default groups.
pub const DEFAULT_GROUPS: [&str; 3] = ["control", "signals", "teleoperation"];

/// Upper bounds of the cost of each module kind on nucleo-g474re: a line per kind with name, cycles without
/// axes, cycles per axis, and the reason if unknown.
pub const MODULE_COSTS: &str = include_str!("../module-costs.txt");

/// Upper bound of a module kind's cost in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModuleCost<'a> {
    /// Name of the kind.
    pub name: &'a str,
    /// Cycles without axes.
    pub cycles: u16,
    /// Cycles per axis.
    pub per_axis: u16,
    /// Why the cost is unknown; empty if known.
    pub reason: &'a str,
}

/// Parses the lines of module kinds in [`MODULE_COSTS`] or in the output of `dimsart stamp`.
pub fn module_costs(text: &str) -> impl Iterator<Item = ModuleCost<'_>> {
    text.lines().filter_map(|line| {
        let mut words = line.splitn(4, ' ');
        let name = words.next().filter(|name| name.ends_with("MOD"))?;
        let (cycles, per_axis) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        Some(ModuleCost { name, cycles, per_axis, reason: words.next().unwrap_or_default() })
    })
}

/// Indirect calls of the firmware, which a tool cannot find in the machine code.
pub const INDIRECT_CALLS: &str = include_str!("../calls.txt");
