//! Memories that an image can run from.

use ::cycles::timing::{Column, Flash, Profile, Timing};
use clap::ValueEnum;
use serde::Deserialize;

/// Memory of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
pub enum Memory {
    /// Every access without waiting.
    #[value(name = "0ws")]
    #[serde(rename = "0ws")]
    ZeroWait,
    /// Flash of an STM32G4 at full speed, 4 wait states, with its caches; for the bound everything misses them.
    #[serde(rename = "flash")]
    Flash,
}

impl Memory {
    /// Its name, as it is written.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ZeroWait => "0ws",
            Self::Flash => "flash",
        }
    }

    /// The model's.
    #[must_use]
    pub fn profile(self) -> Profile {
        match self {
            Self::ZeroWait => Profile::ZeroWait,
            Self::Flash => Profile::Flash(Flash::STM32G4),
        }
    }

    /// Of bounds.
    #[must_use]
    pub fn upper(self) -> Timing {
        Timing::new(self.profile(), Column::Upper)
    }
}
