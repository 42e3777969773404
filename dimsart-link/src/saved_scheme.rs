//! Saved schemes: a scheme as bytes that are verified before the first command is executed.
//!
//! ```text
//! version u8 | fingerprint u32 | commands | CRC-32 (poly 0xF4ACFB13) u32     at most 512 bytes, with laws 920
//! ```
//! Little endian; the commands follow each other in postcard's format, `MATCHING_CHECK` last. The fingerprint
//! identifies the image's modules and data types: commands refer to them by number.

use heapless::Vec;
use heapless::vec::VecView;
use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

use crate::encode::encode_into;
use dimsart_core::checksum::{CRC, Table};
use dimsart_core::{Command, CommandError, Dimsart, Engine, ModuleRef, ParameterDescription, types};

/// Version of the layout.
pub const SAVED_SCHEME_VERSION: u8 = 2;
/// Maximum length of a scheme. A module with one gain takes 18 bytes, a law about 7 per word of its program.
/// A flash page of 2048 bytes holds two such schemes and a motor configuration.
pub const MAX_SCHEME_BYTES: usize = 920;
/// Maximum length of a scheme without laws.
pub const MAX_BYTES_WITHOUT_LAWS: usize = 512;

const CRC_BYTES: usize = 4;

/// The bytes of a scheme.
pub type SchemeBytes = Vec<u8, MAX_SCHEME_BYTES>;

/// The scheme exceeds [`MAX_SCHEME_BYTES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLong;

/// Reasons why a scheme was not loaded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum LoadError {
    /// The bytes are corrupt.
    Damaged,
    /// Unknown version of the layout.
    Version {
        /// The version found.
        found: u8,
    },
    /// Saved by an image with other modules or data types.
    IncompatibleImage,
    /// A command was refused.
    Refused {
        /// Index of the command, from 0.
        command: u16,
        /// The reason.
        error: CommandError,
    },
}

impl core::fmt::Display for LoadError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Damaged => write!(f, "saved data corrupt: save the scheme again"),
            Self::Version { found } => {
                write!(
                    f,
                    "saved in layout {found}, but this image reads {SAVED_SCHEME_VERSION}: save the scheme again"
                )
            }
            Self::IncompatibleImage => {
                write!(
                    f,
                    "saved by an image with other modules, parameters or data types: save the scheme again"
                )
            }
            Self::Refused { command, error } => {
                write!(f, "command {command} of the saved scheme refused: {error}")
            }
        }
    }
}

impl core::error::Error for LoadError {}

/// Assembles the commands of a scheme.
#[derive(Debug)]
pub struct Writer<'b> {
    bytes: &'b mut VecView<u8>,
}

impl<'b> Writer<'b> {
    /// Clears `bytes` and starts a scheme for images with this [`fingerprint`].
    #[must_use]
    pub fn new(bytes: &'b mut VecView<u8>, fingerprint: u32) -> Self {
        bytes.clear();
        // Both fit: `bytes` is empty.
        let _ = bytes.push(SAVED_SCHEME_VERSION);
        let _ = bytes.extend_from_slice(&fingerprint.to_le_bytes());
        Self { bytes }
    }

    /// Appends a command.
    ///
    /// # Errors
    /// [`TooLong`] if it does not fit; the scheme is unchanged.
    pub fn push(&mut self, command: &Command) -> Result<(), TooLong> {
        let mut buffer = [0; MAX_COMMAND_BYTES];
        let bytes = encode_into(command, &mut buffer).ok_or(TooLong)?;
        self.bytes.extend_from_slice(bytes).map_err(|_| TooLong)
    }

    /// Appends the command that starts the scheme.
    ///
    /// # Errors
    /// [`TooLong`] if it does not fit; the bytes are then invalid.
    pub fn finish(mut self) -> Result<(), TooLong> {
        self.push(&Command::Check)?;
        let crc = CRC.checksum(self.bytes).to_le_bytes();
        self.bytes.extend_from_slice(&crc).map_err(|_| TooLong)
    }
}

/// Maximum length of a command in postcard's format: each of its numbers takes at most 5 bytes.
const MAX_COMMAND_BYTES: usize = 24;

/// Encodes the current scheme.
///
/// # Errors
/// [`TooLong`] if it exceeds [`MAX_SCHEME_BYTES`].
pub fn save(engine: &mut Engine) -> Result<SchemeBytes, TooLong> {
    let mut bytes = SchemeBytes::new();
    let mut writer = Writer::new(&mut bytes, fingerprint(engine));
    engine.rebuild_commands().try_for_each(|command| writer.push(&command))?;
    writer.finish()?;
    Ok(bytes)
}

/// Returns the fingerprint in a saved scheme; 0 if the bytes are too short.
///
/// An image reads its own fingerprint from its built-in scheme instead of computing it.
#[must_use]
pub fn saved_fingerprint(bytes: &[u8]) -> u32 {
    let found = bytes.get(1..).and_then(<[u8]>::first_chunk);
    found.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

/// Replaces the scheme with a saved one and starts it. `fingerprint` is the image's own.
///
/// # Errors
/// [`LoadError`] if it is corrupt, of another image, or does not match; the scheme is then empty.
pub fn load(bytes: &[u8], fingerprint: u32, dimsart: &mut Dimsart) -> Result<(), LoadError> {
    let refused = |error| LoadError::Refused { command: 0, error };
    // Discards an open transaction.
    let _ = dimsart.command(Command::Abort);
    dimsart.command(Command::Close).map_err(refused)?;
    let given = give(check(bytes, fingerprint)?, dimsart);
    if given.is_err() {
        dimsart.command(Command::Close).map_err(refused)?;
    }
    given
}

/// Executes all commands; the last one starts the scheme.
fn give(mut commands: &[u8], dimsart: &mut Dimsart) -> Result<(), LoadError> {
    let mut count = 0;
    while !commands.is_empty() {
        let (command, rest) = postcard::take_from_bytes(commands).map_err(|_| LoadError::Damaged)?;
        if matches!(command, Command::Begin | Command::Commit | Command::Abort) {
            // A saved scheme contains no transaction.
            return Err(LoadError::Damaged);
        }
        dimsart.command(command).map_err(|error| LoadError::Refused { command: count, error })?;
        commands = rest;
        count = count.saturating_add(1);
    }
    // A stopped scheme lost its last command.
    if dimsart.engine().is_running() { Ok(()) } else { Err(LoadError::Damaged) }
}

/// Returns the commands if the bytes are valid and saved by the same image.
fn check(bytes: &[u8], fingerprint: u32) -> Result<&[u8], LoadError> {
    let (content, crc) = bytes.split_last_chunk::<CRC_BYTES>().ok_or(LoadError::Damaged)?;
    if CRC.checksum(content) != u32::from_le_bytes(*crc) {
        return Err(LoadError::Damaged);
    }
    let (version, content) = content.split_first().ok_or(LoadError::Damaged)?;
    if *version != SAVED_SCHEME_VERSION {
        return Err(LoadError::Version { found: *version });
    }
    let (found, commands) = content.split_first_chunk().ok_or(LoadError::Damaged)?;
    if u32::from_le_bytes(*found) != fingerprint {
        return Err(LoadError::IncompatibleImage);
    }
    Ok(commands)
}

/// Computes a number that differs between images whose commands have different meanings.
///
/// Covers modules, parameters, their ranges and defaults, ports and data types, but not their descriptions.
#[must_use]
pub fn fingerprint(engine: &mut Engine) -> u32 {
    let mut digest = Fingerprint(CRC.digest());
    for found in engine.kinds().list() {
        let kind = found.id;
        digest = digest.with(&found.name);
        let parameters = (0..).map_while(|index| engine.kinds().describe_parameter(kind, index));
        for text in parameters.map(ParameterDescription::try_from) {
            let content = text
                .as_ref()
                .map(|text| (text.name, &text.accepts, text.entries, text.default, text.is_structural));
            digest = digest.with(&content.ok());
        }
        // Number 0 is not a module: returns the default ports.
        for port in engine.ports(ModuleRef { kind, number: 0 }).unwrap_or_default() {
            digest = digest.with(&(port.name, port.data_type.map(|(_, signal)| signal)));
        }
    }
    for found in &types::ALL {
        digest = digest.with(&(found.id, found.name, found.unit, found.format, found.shape));
    }
    digest.0.finalize()
}

/// Hashes descriptions.
struct Fingerprint(crc::Digest<'static, u32, Table>);

impl Fingerprint {
    fn with(self, content: &impl Serialize) -> Self {
        // Cannot fail: the flavor stores no bytes.
        postcard::serialize_with_flavor(content, self).unwrap_or_else(|_| Self(CRC.digest()))
    }
}

impl Flavor for Fingerprint {
    type Output = Self;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.update(&[byte]);
        Ok(())
    }

    fn finalize(self) -> postcard::Result<Self> {
        Ok(self)
    }
}
