//! Scenario files: the paper's bilateral experiment, in SI units.
//!
//! Settings are laid over each other in this order: the shipped scenario, then a file, then each `--set`.
//! Every one is checked as it comes, so an error names the line or the argument that is wrong. What a scheme says for
//! itself, such as its gains, is in none of them unless somebody gives it: it then goes over the scheme's rows.

mod carrier;
mod change;
mod error;
mod range;
mod reference;

pub use carrier::{CanSection, CarrierKind, DelayKind, UartSection, UdpSection};
pub use error::{Origin, ScenarioError};
pub use reference::{Key, SHIPPED};

use crate::link::Address;
use crate::observer::watch::Ranges;
use crate::plant::{
    DeviceParameters, EnvironmentKind, Environments, MotorParameters, Obstacle, ParameterError,
};
use change::Change;
use dimsart_core::limits::MAX_DOF;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::Table;

/// Everything that decides a run. Meanings, units and defaults: [`Scenario::keys`] or [`SHIPPED`].
///
/// A scenario from [`load`](Self::load) holds only numbers in their ranges.
// Without deny_unknown_fields, which does not go with flatten: every key is first looked up in the shipped file.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub struct Scenario {
    pub seed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    pub sample_period_s: f64,
    pub dof: usize,
    /// Which of the environments the slave meets.
    pub environment: EnvironmentKind,
    pub link: LinkSection,
    pub uart: UartSection,
    pub can: CanSection,
    pub udp: UdpSection,
    pub wave: WaveSection,
    pub master: SideSection,
    pub slave: SideSection,
    pub hand: HandSection,
    /// `[wall]`, `[spring]`, ...: of what the slave can meet.
    #[serde(flatten)]
    pub environments: Environments,
    pub limits: LimitsSection,
    pub record: RecordSection,
}

/// `[link]`: what carries the waves.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSection {
    pub carrier: CarrierKind,
    pub forward_delay_ticks: u32,
    pub backward_delay_ticks: u32,
    pub jitter_ticks: u32,
    pub loss: f64,
    pub duplication: f64,
    pub reordering: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stale: Option<Stale>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub playout_ticks: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timeout_ticks: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_ticks: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key_file: Option<PathBuf>,
    pub master_address: Address,
    pub slave_address: Address,
}

/// What a receiver does in a tick that brings nothing new.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stale {
    /// The wave is 0: passive.
    Zero,
    /// The last wave again.
    Hold,
    /// What the wave integral says is missing, as far as the energy received allows: passive.
    Limited,
    /// What the wave integral says is missing, at once: no drift, not passive.
    Integral,
}

/// `[wave]`: the wave transformers of both sides, as far as the schemes are not to decide.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WaveSection {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub impedance_ns_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub form: Option<WaveForm>,
}

/// In which order wave transformer and controller compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaveForm {
    /// Decode, control, encode.
    Split,
    /// Transformer and controller solved together: turns the controller's `LAW_OUTPUT` on as well.
    Implicit,
    /// The paper's order: control first. Diverges with the paper's gains.
    Printed,
}

/// `[master]` or `[slave]`: a controller and its device. A gain or delay of none is the scheme's own.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SideSection {
    pub scheme: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness_n_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ns_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_delay_ticks: Option<u32>,
    pub device: DeviceParameters,
    /// None: the device is an ideal force source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor: Option<MotorParameters>,
}

/// `[hand]`: who holds the master.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct HandSection {
    pub mass_kg: f64,
    pub damping_ns_per_m: f64,
    pub stiffness_n_per_m: f64,
    pub path_amplitude_m: f64,
    /// Per axis; missing entries are 0, those beyond `dof` are not used.
    pub contact_force_n: Vec<f64>,
}

/// `[limits]`: declared ranges, symmetric around 0.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsSection {
    pub position_m: f64,
    pub force_n: f64,
    pub wave: f64,
}

impl LimitsSection {
    /// The same for whoever watches a run.
    #[must_use]
    pub fn ranges(&self) -> Ranges {
        Ranges {
            position: self.position_m,
            force: self.force_n,
            max_force: [self.force_n; MAX_DOF],
            wave: self.wave,
        }
    }
}

/// `[record]`: what a run keeps.
#[expect(missing_docs, reason = "the shipped file has a line for every key")]
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RecordSection {
    #[serde(default = "every_tick")]
    pub every_ticks: u32,
    #[serde(default)]
    pub signals: Vec<String>,
}

fn every_tick() -> u32 {
    1
}

/// How far a slave is thought to be pressed at most, `m`: the surface of what it meets is then exact to 1e-12 m.
const FURTHEST_M: f64 = 1e3;

/// Puts `argument` (`link.loss=0.1`) over `settings`. The value is TOML; a bare word is a text. A section that
/// was left out (`master.motor`) comes with its defaults as soon as one of its keys is set.
///
/// # Errors
/// A key that does not exist, or a value that it does not take. `settings` are then as before.
pub fn apply(settings: &mut Table, argument: &str) -> Result<(), ScenarioError> {
    let mut changed = settings.clone();
    Change::from_argument(argument)?.into_iter().try_for_each(|change| change.apply(&mut changed))?;
    *settings = changed;
    Ok(())
}

impl Scenario {
    /// The shipped scenario with the file at `path` and then each of `sets` over it.
    ///
    /// # Errors
    /// A file that cannot be read or is not TOML; all keys that do not exist and all values that their keys do not take.
    pub fn load(path: Option<&Path>, sets: &[String]) -> Result<Self, ScenarioError> {
        let mut settings = reference::shipped();
        let changes = path.map(Change::from_file).transpose()?.unwrap_or_default();
        // What is refused leaves the settings as they were.
        let of_file = changes.into_iter().filter_map(|change| change.apply(&mut settings).err());
        let mut errors: Vec<ScenarioError> = of_file.collect();
        errors.extend(sets.iter().filter_map(|argument| apply(&mut settings, argument).err()));
        let scenario = from_checked(settings);
        let entries = scenario.hand.contact_force_n.len();
        if entries > scenario.dof && scenario.hand.contact_force_n != Self::default().hand.contact_force_n {
            errors.push(ScenarioError::TooManyForces { entries, dof: scenario.dof });
        }
        match errors.len() {
            0 => Ok(scenario),
            1 => Err(errors.remove(0)),
            _ => Err(ScenarioError::Several(errors)),
        }
    }

    /// The settings in effect, as a scenario file that gives the same scenario again.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_else(|error| format!("# not expressible in TOML: {error}\n"))
    }

    /// Every key there is, in the order of [`SHIPPED`].
    #[must_use]
    pub fn keys() -> Vec<Key> {
        reference::keys()
    }

    /// Constant push of the hand on `axis` in contact, `N`; 0 for an axis that has none, and on every axis when
    /// there is nothing to push against.
    #[must_use]
    pub fn contact_force_n(&self, axis: usize) -> f64 {
        match self.environment {
            EnvironmentKind::Nothing => 0.0,
            _ => self.hand.contact_force_n.get(axis).copied().unwrap_or(0.0),
        }
    }

    /// What the hand's push on `axis` presses the slave against; none when it meets nothing in its range.
    ///
    /// # Errors
    /// [`ParameterError`] for an environment that cannot exist.
    pub fn obstacle(&self, axis: usize) -> Result<Option<Obstacle>, ParameterError> {
        let pressed_m = self.limits.position_m.min(FURTHEST_M).copysign(self.contact_force_n(axis));
        self.environments.obstacle(self.environment, pressed_m)
    }
}

impl Default for Scenario {
    /// [`SHIPPED`].
    fn default() -> Self {
        from_checked(reference::shipped())
    }
}

#[expect(
    clippy::expect_used,
    reason = "each change was deserialised as it came; a test reads the shipped file"
)]
fn from_checked(settings: Table) -> Scenario {
    Scenario::deserialize(settings).expect("settings are checked one by one as they are applied")
}

#[cfg(test)]
mod tests;
