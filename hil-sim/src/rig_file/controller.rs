//! `[[controller]]`, and `[[link]]` between two controllers.

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
    /// Name; default: the device's name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its device.
    pub device: String,
    /// Axes of the device that it controls, from 0; default: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Vec<usize>>,
    /// Scheme file or built-in scheme.
    pub scheme: String,
    /// [Law](crate::law) files, numbered 1, 2, ..., for `ONLINE_MOD` of its scheme.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<String>,
    /// Side whose rows of the scheme apply, in addition to rows for `all`; default: its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<String>,
    /// Ticks of the rig per tick of the controller.
    #[serde(default = "one")]
    pub every_ticks: u32,
    /// Parameters that override the scheme's rows, by module and name: `set.PDCTRL_MOD.K_PARAM = 3000.0`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub set: BTreeMap<String, BTreeMap<String, Value>>,
}

impl ControllerSection {
    /// Returns its name.
    #[must_use]
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.device)
    }

    /// Returns the side whose rows of the scheme apply.
    #[must_use]
    pub fn side(&self) -> &str {
        self.side.as_deref().unwrap_or_else(|| self.name())
    }

    /// Returns the parameters that override the scheme's rows.
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

    /// Returns the axes of its device that it controls.
    #[must_use]
    pub fn axes(&self, device: &DeviceSection) -> Vec<usize> {
        self.axes.clone().unwrap_or_else(|| (0..device.axes.len()).collect())
    }
}

/// `[[link]]`: one direction between two controllers.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSection {
    /// Sending controller.
    pub from: String,
    /// Receiving controller.
    pub to: String,
    /// Link number at the sender, as in `CTX_LINK`.
    #[serde(default)]
    pub from_link: u8,
    /// Link number at the receiver, as in `CRX_LINK`.
    #[serde(default)]
    pub to_link: u8,
    /// Its bus; default: no delay except `carrier`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bus: Option<String>,
    /// File with the key that authenticates packets, for two controllers with one link in each direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key_file: Option<PathBuf>,
    /// Address of the receiver if it is a separate process: `IP:PORT`, `serial:PATH[@BAUD]`, `can:INTERFACE` or
    /// `canfd:INTERFACE`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<Address>,
    /// Delay, jitter and loss of packets, after the bus.
    #[serde(default)]
    pub carrier: InProcessParameters,
}

const fn one() -> u32 {
    1
}
