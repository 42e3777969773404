//! A scheme as bytes that are kept: checked before the first of its commands is given.
//!
//! ```text
//! version u8 | fingerprint u32 | commands | CRC-32 (poly 0xF4ACFB13) u32     at most 512 bytes, with laws 920
//! ```
//! Little endian; the commands are one behind the other in postcard's format, `MATCHING_CHECK` last. The
//! fingerprint is that of the image's modules and data types: commands are numbers, and mean something
//! else in an image with other lists.

use heapless::Vec;
use heapless::vec::VecView;
use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

use crate::encode::encode_into;
use dimsart_core::checksum::{CRC, Table};
use dimsart_core::{Command, CommandError, Dimsart, Engine, ModuleRef, ParameterText, types};

/// Version of the layout.
pub const SAVED_SCHEME_VERSION: u8 = 2;
/// Most bytes of a scheme; one module with one gain takes 18, a law about 7 for each word of its program. Two such schemes
/// and a motor's configuration are what a page of 2048 bytes of flash holds.
pub const MAX_SCHEME_BYTES: usize = 920;
/// Most bytes of a scheme without a law.
pub const MAX_BYTES_WITHOUT_LAWS: usize = 512;

const CRC_BYTES: usize = 4;

/// The bytes of a scheme.
pub type SchemeBytes = Vec<u8, MAX_SCHEME_BYTES>;

/// The scheme takes more than [`MAX_SCHEME_BYTES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLong;

/// Why a scheme was not loaded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum LoadError {
    /// Its bytes are not what was saved.
    Damaged,
    /// Another version of the layout.
    Version {
        /// The version found.
        found: u8,
    },
    /// Saved by an image with other modules or data types.
    OtherImage,
    /// A command was refused.
    Refused {
        /// Which one, from 0.
        command: u16,
        /// Why.
        error: CommandError,
    },
}

impl core::fmt::Display for LoadError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Damaged => write!(f, "its bytes are damaged: save it again"),
            Self::Version { found } => {
                write!(f, "it has layout {found}, this image reads {SAVED_SCHEME_VERSION}: save it again")
            }
            Self::OtherImage => {
                write!(
                    f,
                    "it was saved by an image with other modules, parameters or data types: save it again"
                )
            }
            Self::Refused { command, error } => write!(f, "its command {command} was refused: {error}"),
        }
    }
}

impl core::error::Error for LoadError {}

/// Puts the commands of a scheme together.
#[derive(Debug)]
pub struct Writer<'b> {
    bytes: &'b mut VecView<u8>,
}

impl<'b> Writer<'b> {
    /// A scheme without commands in place of what `bytes` were, for images with this [`fingerprint`].
    #[must_use]
    pub fn new(bytes: &'b mut VecView<u8>, fingerprint: u32) -> Self {
        bytes.clear();
        // Both fit: nothing else is in yet.
        let _ = bytes.push(SAVED_SCHEME_VERSION);
        let _ = bytes.extend_from_slice(&fingerprint.to_le_bytes());
        Self { bytes }
    }

    /// Adds a command.
    ///
    /// # Errors
    /// [`TooLong`] when there is no room for it; the scheme is as before.
    pub fn push(&mut self, command: &Command) -> Result<(), TooLong> {
        let mut buffer = [0; MAX_COMMAND_BYTES];
        let bytes = encode_into(command, &mut buffer).ok_or(TooLong)?;
        self.bytes.extend_from_slice(bytes).map_err(|_| TooLong)
    }

    /// Ends the scheme with the command that starts it.
    ///
    /// # Errors
    /// [`TooLong`] when there is no room for it; the bytes are of no use then.
    pub fn finish(mut self) -> Result<(), TooLong> {
        self.push(&Command::Check)?;
        let crc = CRC.checksum(self.bytes).to_le_bytes();
        self.bytes.extend_from_slice(&crc).map_err(|_| TooLong)
    }
}

/// Of any command in postcard's format: each of its numbers takes at most 5 bytes.
const MAX_COMMAND_BYTES: usize = 24;

/// The bytes of the scheme as it is now.
///
/// # Errors
/// [`TooLong`] when they are more than [`MAX_SCHEME_BYTES`].
pub fn save(engine: &mut Engine) -> Result<SchemeBytes, TooLong> {
    let mut bytes = SchemeBytes::new();
    let mut writer = Writer::new(&mut bytes, fingerprint(engine));
    engine.commands().try_for_each(|command| writer.push(&command))?;
    writer.finish()?;
    Ok(bytes)
}

/// The fingerprint that a scheme was saved with; 0 for what is too short to be one.
///
/// An image knows its own by its built-in scheme, and need not work it out.
#[must_use]
pub fn fingerprint_of(bytes: &[u8]) -> u32 {
    let found = bytes.get(1..).and_then(<[u8]>::first_chunk);
    found.map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

/// Replaces the scheme by a saved one and starts it. `fingerprint` is the image's own.
///
/// # Errors
/// [`LoadError`] when it is not whole, of another image, or does not match; no module exists then.
pub fn load(bytes: &[u8], fingerprint: u32, dimsart: &mut Dimsart) -> Result<(), LoadError> {
    let refused = |error| LoadError::Refused { command: 0, error };
    // What somebody was putting together is not to be mixed with it.
    let _ = dimsart.command(Command::Abort);
    dimsart.command(Command::Close).map_err(refused)?;
    let given = give(check(bytes, fingerprint)?, dimsart);
    if given.is_err() {
        dimsart.command(Command::Close).map_err(refused)?;
    }
    given
}

/// Gives all commands, the last of which starts the scheme.
fn give(mut commands: &[u8], dimsart: &mut Dimsart) -> Result<(), LoadError> {
    let mut count = 0;
    while !commands.is_empty() {
        let (command, rest) = postcard::take_from_bytes(commands).map_err(|_| LoadError::Damaged)?;
        if matches!(command, Command::Begin | Command::Commit | Command::Abort) {
            // No scheme is kept with one.
            return Err(LoadError::Damaged);
        }
        dimsart.command(command).map_err(|error| LoadError::Refused { command: count, error })?;
        commands = rest;
        count = count.saturating_add(1);
    }
    // One that does not run has lost its last command.
    if dimsart.engine().is_running() { Ok(()) } else { Err(LoadError::Damaged) }
}

/// The commands, if the bytes are whole and the image is the right one.
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
        return Err(LoadError::OtherImage);
    }
    Ok(commands)
}

/// A number that differs between images whose commands mean different things.
///
/// It covers modules, parameters, their ranges and defaults, ports and data types; not the texts that
/// explain them.
#[must_use]
pub fn fingerprint(engine: &mut Engine) -> u32 {
    let mut digest = Fingerprint(CRC.digest());
    for found in engine.kinds().list() {
        let kind = found.id;
        digest = digest.with(&found.name);
        let parameters = (0..).map_while(|index| engine.kinds().describe_parameter(kind, index));
        for text in parameters.map(ParameterText::try_from) {
            let content = text
                .as_ref()
                .map(|text| (text.name, &text.accepts, text.entries, text.default, text.is_structural));
            digest = digest.with(&content.ok());
        }
        // No module has number 0: these are the ports by default.
        for port in engine.ports(ModuleRef { kind, number: 0 }).unwrap_or_default() {
            digest = digest.with(&(port.name, port.data_type.map(|(_, signal)| signal)));
        }
    }
    for found in &types::ALL {
        digest = digest.with(&(found.id, found.name, found.unit, found.format, found.shape));
    }
    digest.0.finalize()
}

/// Takes the bytes of what is described.
struct Fingerprint(crc::Digest<'static, u32, Table>);

impl Fingerprint {
    fn with(self, content: &impl Serialize) -> Self {
        // Cannot fail: nothing is kept.
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
