//! Reads the configuration of a device and replaces it.

use std::io::{Read, Write};

use dimsart_core::Command;
use hil_sim::schemes::SchemeText;

use super::command::ALL_DESTINATIONS;
use super::scheme::Sending;
use super::{ConnectError, Device, SendOutcome};
use crate::config::{Configuration, text};

/// A configuration that replaces the present one.
#[derive(Debug, Clone, Copy)]
pub struct ConfigurationReplacement<'a> {
    /// Its rows.
    pub scheme: &'a SchemeText,
    /// Side whose rows are sent.
    pub side: &'a str,
    /// Skips rows that are unknown to the device.
    pub skips_unknown: bool,
    /// Checks the configuration on the device without applying it.
    pub is_dry_run: bool,
}

impl<S: Read + Write> Device<S> {
    /// Reads the configuration as text, byte-identical while nothing changes, and counts the commands that are unknown to
    /// this program: a comment replaces them.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn configuration_text(&mut self) -> Result<(String, usize), ConnectError> {
        let commands = self.commands_known()?;
        let all = commands.len();
        let commands: Vec<Command> = commands.into_iter().flatten().collect();
        let rows = self.rows_of(&commands, ALL_DESTINATIONS)?;
        // The last row starts the scheme.
        let unknown = all - (rows.lines().count() - 1).min(all);
        let note = match unknown {
            0 => String::new(),
            _ => format!("# {unknown} commands of a newer version are omitted\n"),
        };
        Ok((text(self.identity(), &(note + &rows)), unknown))
    }

    /// Parses a configuration with the names of this device and of its laws.
    ///
    /// # Errors
    /// As [`configuration_text`](Self::configuration_text).
    pub fn read_configuration(&mut self, rows: &str, side: &str) -> Result<Configuration, ConnectError> {
        let laws = self.laws_for(rows)?;
        self.know(|known| Configuration::read(rows, side, known, &laws))
    }

    /// Replaces the configuration in one transaction. Modules in both configurations keep their state.
    ///
    /// # Errors
    /// As [`send_scheme`](Self::send_scheme).
    pub fn replace_configuration(
        &mut self,
        exchange: ConfigurationReplacement<'_>,
    ) -> Result<SendOutcome, ConnectError> {
        let ConfigurationReplacement { scheme, side, skips_unknown, is_dry_run } = exchange;
        let wanted = self.read_configuration(&scheme.text, side)?;
        let mut first = Vec::new();
        for instance in self.instances()? {
            let name = self.module_name(instance.module)?;
            if wanted.modules.iter().any(|module| module.name == name) {
                // A module that is unplugged and plugged in again keeps its state.
                first.extend(instance.place.map(|_| Command::Unplug(instance.module)));
                first.push(Command::InitModule(instance.module));
            } else {
                first.push(Command::CloseModule(instance.module));
            }
        }
        self.send(scheme, side, Sending { first, skips_unknown, is_dry_run })
    }
}
