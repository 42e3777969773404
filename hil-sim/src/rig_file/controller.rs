//! `[[controller]]`, and `[[link]]` between two of them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use toml::Value;

use super::DeviceSection;
use crate::link::{Address, InProcessParameters};
use crate::schemes::Setting;

/// `[[controller]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerSection {
    /// What it is called; left out, its device's name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The device that it controls.
    pub device: String,
    /// The axes of it, from 0, that it alone controls; left out, all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Vec<usize>>,
    /// Scheme file, or a built-in one.
    pub scheme: String,
    /// [Law](crate::law) files, which are its laws 1, 2, ...: what `ONLINE_MOD` of its scheme runs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<String>,
    /// Whose rows of the scheme it takes beside those for `all`; left out, those for its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<String>,
    /// It is stepped in every so many ticks of the rig.
    #[serde(default = "one")]
    pub every_ticks: u32,
    /// Parameters that go over the scheme's rows, by module and name: `set.PDCTRL_MOD.K_PARAM = 3000.0`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub set: BTreeMap<String, BTreeMap<String, Value>>,
}

impl ControllerSection {
    /// What it is called.
    #[must_use]
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.device)
    }

    /// Whose rows of the scheme it takes.
    #[must_use]
    pub fn side(&self) -> &str {
        self.side.as_deref().unwrap_or_else(|| self.name())
    }

    /// What goes over its scheme's rows.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let of_module = |(module, values): (&String, &BTreeMap<String, Value>)| {
            let setting = |(command, value): (&String, &Value)| Setting {
                module: module.clone(),
                command: command.clone(),
                value: match value {
                    Value::String(text) => text.clone(),
                    Value::Float(number) => number.to_string(),
                    other => other.to_string(),
                },
                key: format!("controller.{}.set.{module}.{command}", self.name()),
            };
            values.iter().map(setting).collect::<Vec<_>>()
        };
        self.set.iter().flat_map(of_module).collect()
    }

    /// The axes of its device that it controls.
    #[must_use]
    pub fn axes(&self, device: &DeviceSection) -> Vec<usize> {
        self.axes.clone().unwrap_or_else(|| (0..device.axes.len()).collect())
    }
}

/// `[[link]]`: one way from a controller to another.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSection {
    /// The controller that sends.
    pub from: String,
    /// The controller that receives.
    pub to: String,
    /// Number of the link at the sender, as `CTX_LINK` says.
    #[serde(default)]
    pub from_link: u8,
    /// Number of the link at the receiver, as `CRX_LINK` says.
    #[serde(default)]
    pub to_link: u8,
    /// The bus that it goes over; left out, it takes no time but what `carrier` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bus: Option<String>,
    /// File with a key that both ends authenticate packets with, of two controllers with one link each way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key_file: Option<PathBuf>,
    /// Where its receiver is, when that is a process of its own: `IP:PORT`, `serial:PATH[@BAUD]`, `can:INTERFACE` or
    /// `canfd:INTERFACE`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<Address>,
    /// What happens to packets, behind the bus.
    #[serde(default)]
    pub carrier: InProcessParameters,
}

const fn one() -> u32 {
    1
}
