//! The configuration of a device: read as far as it is understood, and exchanged for another one.

use std::io::{Read, Write};

use dimsart_core::Command;
use hil_sim::schemes::SchemeText;

use super::command::ANY_SIDE;
use super::scheme::Sending;
use super::{ConnectError, Device, Sent};
use crate::config::{Configuration, text};

/// A configuration for a device that has another one.
#[derive(Debug, Clone, Copy)]
pub struct Exchange<'a> {
    /// Its rows.
    pub scheme: &'a SchemeText,
    /// Side whose rows are meant.
    pub side: &'a str,
    /// Leaves out rows that the device does not know.
    pub skips_unknown: bool,
    /// Has the device check the whole, and changes nothing.
    pub is_dry_run: bool,
}

impl<S: Read + Write> Device<S> {
    /// The whole configuration as text, as long as nothing changes always of the same bytes; and how much of it this program
    /// does not know: a comment stands in its place.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when the device does not answer.
    pub fn configuration_text(&mut self) -> Result<(String, usize), ConnectError> {
        let commands = self.commands_known()?;
        let all = commands.len();
        let commands: Vec<Command> = commands.into_iter().flatten().collect();
        let rows = self.rows_of(&commands, ANY_SIDE)?;
        // The last row lets the scheme run.
        let unknown = all - (rows.lines().count() - 1).min(all);
        let note = match unknown {
            0 => String::new(),
            _ => format!("# {unknown} of its commands are not known here and left out\n"),
        };
        Ok((text(self.identity(), &(note + &rows)), unknown))
    }

    /// Reads a configuration by this device's names, and those of its laws.
    ///
    /// # Errors
    /// As [`configuration_text`](Self::configuration_text).
    pub fn read_configuration(&mut self, rows: &str, side: &str) -> Result<Configuration, ConnectError> {
        let laws = self.laws_for(rows)?;
        self.know(|known| Configuration::read(rows, side, known, &laws))
    }

    /// Puts a configuration in the place of the one that is there, in one transaction. Modules that are in both go on,
    /// with their state.
    ///
    /// # Errors
    /// As [`send_scheme`](Self::send_scheme).
    pub fn exchange(&mut self, exchange: Exchange<'_>) -> Result<Sent, ConnectError> {
        let Exchange { scheme, side, skips_unknown, is_dry_run } = exchange;
        let wanted = self.read_configuration(&scheme.text, side)?;
        let mut first = Vec::new();
        for instance in self.instances()? {
            let name = self.module_name(instance.module)?;
            if wanted.modules.iter().any(|module| module.name == name) {
                // Unplugged and plugged in again, it goes on.
                first.extend(instance.place.map(|_| Command::Unplug(instance.module)));
                first.push(Command::InitModule(instance.module));
            } else {
                first.push(Command::CloseModule(instance.module));
            }
        }
        self.send(scheme, side, Sending { first, skips_unknown, is_dry_run })
    }
}
