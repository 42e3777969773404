//! What tools need to know of a board to build, check and flash its images: a file per board.

pub(crate) mod b_g431b_esc1;
pub mod ihm08m1;
pub(crate) mod mps2_an386;
pub(crate) mod nucleo_g474re;
mod pins;

pub use pins::{Pin, PinDirection, PinGroup, PinMode, PinPlan};

use dimsart_core::limits::Sizes;

use crate::current_loop::Scaling;
use crate::motor::Motor;

/// A scheme that images can start with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltInScheme {
    /// Its name, as in `builtin:NAME`.
    pub name: &'static str,
    /// Its rows.
    pub text: &'static str,
}

/// The paper's scheme as it is shipped, for devices of its size.
const BILATERAL: BuiltInScheme =
    BuiltInScheme { name: "bilateral", text: include_str!("../schemes/bilateral.scheme") };
/// The same for motors of a tenth of a newton metre or more.
const SMALL_MOTORS: BuiltInScheme =
    BuiltInScheme { name: "small_motors", text: include_str!("../schemes/small_motors.scheme") };

/// A board as it is registered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardInfo {
    /// Its name: its feature, and that of its files.
    pub name: &'static str,
    /// The linker's memory map that images for the board are laid out by.
    pub memory_map: &'static str,
    /// What firmware for it may take, as TOML: a tick of any scheme `tick_percent` of the time to the next one; the
    /// plain image `flash_bytes` and `ram_bytes`, unless there is room for any; and cycles and stack of the shipped
    /// scheme's parts.
    pub budget: &'static str,
    /// What tools need beyond that.
    pub tooling: Tooling,
}

impl BoardInfo {
    /// Whether its images have a group of modules; `basic` is in every one.
    #[must_use]
    pub fn has_group(&self, group: &str) -> bool {
        group == "basic" || self.tooling.modules.contains(&group)
    }
}

/// What is registered of a board beside its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tooling {
    /// Of the processor's clock.
    pub clock_hz: u32,
    /// Ticks per second.
    pub tick_hz: u32,
    /// Axes of its device; of a simulated one, those that it has when nobody says otherwise.
    pub axes: usize,
    /// What its images' controllers have room for; for programs only in images that can run them.
    pub sizes: Sizes,
    /// What its images run from.
    pub memory: CodeMemory,
    /// Name of the chip in probe-rs, for `probe-rs run --chip NAME`; none for an emulated board.
    pub chip: Option<&'static str>,
    /// Groups of modules that its images have, of [`MODULE_GROUPS`]: all that its flash has room for.
    pub modules: &'static [&'static str],
    /// Features that make further images of it, next to the plain one; of several for one image, a comma between.
    pub variants: &'static [&'static str],
    /// What its images have its pins for; nothing of an emulated board.
    pub pins: &'static [PinPlan],
    /// Interrupt handlers of its images, each with the priority that the board gives it; smaller is more urgent.
    pub interrupts: &'static [(&'static str, i16)],
    /// The motor of each of its axes; none where the device is a simulated one.
    pub motor: Option<Motor>,
    /// What makes its torque; none where that is a voltage, or simulated.
    pub drive: Option<ThreePhaseDrive>,
    /// The built-in scheme of its images, which a board starts with that keeps no other one. Its gains fit the
    /// motor: one count of the encoder asks for 1 % of the motor's largest torque at most.
    pub scheme: BuiltInScheme,
}

/// A three-phase motor under field-oriented control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreePhaseDrive {
    /// Of the image: what a board runs by that keeps no other one.
    pub configuration: drive::Configuration,
    /// How the board measures.
    pub scaling: Scaling,
}

/// The memory that code runs from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CodeMemory {
    /// Nothing waits.
    NoWait,
    /// Flash of an STM32G4 above 136 MHz, which waits, and its CCM SRAM, which does not.
    Stm32G4,
}

/// Groups of modules that an image can be built without, each a feature of the firmware.
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

/// Those that an image has unless others are named.
pub const SHIPPED_GROUPS: [&str; 3] = ["control", "signals", "teleoperation"];

/// What each kind of module adds to a tick at most on nucleo-g474re: a line for each, with its name, its cycles without axes
/// and for each axis, and why these are not known.
pub const MODULE_COSTS: &str = include_str!("../module-costs.txt");

/// What a kind of module adds to a tick at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModuleCost<'a> {
    /// Name of the kind.
    pub name: &'a str,
    /// Without axes.
    pub cycles: u16,
    /// For each axis.
    pub per_axis: u16,
    /// Why these are not known; empty where they are.
    pub reason: &'a str,
}

/// The lines of [`MODULE_COSTS`], or of what `dimsart stamp` leaves beside an image, that are of kinds of modules.
pub fn module_costs(text: &str) -> impl Iterator<Item = ModuleCost<'_>> {
    text.lines().filter_map(|line| {
        let mut words = line.splitn(4, ' ');
        let name = words.next().filter(|name| name.ends_with("MOD"))?;
        let (cycles, per_axis) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        Some(ModuleCost { name, cycles, per_axis, reason: words.next().unwrap_or_default() })
    })
}

/// Whom the firmware calls through pointers: what a tool that follows an image's calls cannot see.
pub const CALLS: &str = include_str!("../calls.txt");
