//! The firmware image: where it is, and whether it is the right one.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use super::EmulatedError;

/// The board that is emulated, by the name that its image has.
pub const BOARD: &str = "mps2-an386";
/// Folder of images, each named after its board and variant.
pub const FOLDER_VARIABLE: &str = "DIMSART_FIRMWARE";
/// Builds the image.
pub const BUILD: &str = "cargo board mps2-an386";
/// Where [`BUILD`] leaves it in the folder of all that is built.
const BUILT: &str = "thumbv7em-none-eabihf/firmware/firmware";

/// A firmware image for the emulated board.
#[derive(Debug, Clone)]
pub struct Image {
    path: PathBuf,
    bytes: Vec<u8>,
    is_authenticated: bool,
}

impl Image {
    /// The image at `given`; without, the one in the folder that the variable `DIMSART_FIRMWARE` names,
    /// without that the one that was built beside this program or in `target`.
    ///
    /// # Errors
    /// [`EmulatedError::NoImage`], [`EmulatedError::Image`] or [`EmulatedError::WrongImage`].
    pub fn find(given: Option<&Path>) -> Result<Self, EmulatedError> {
        let path = match (given, env::var_os(FOLDER_VARIABLE)) {
            (Some(path), _) => path.to_owned(),
            (None, Some(folder)) => Path::new(&folder).join(BOARD),
            (None, None) => built(),
        };
        if !path.is_file() {
            return Err(EmulatedError::NoImage { path });
        }
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(EmulatedError::Image { path, source }),
        };
        let version = env!("CARGO_PKG_VERSION");
        let (wanted, with_keys) =
            (format!("dimsart {version} {BOARD}"), format!("dimsart {version} auth+{BOARD}"));
        let has = |text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
        let is_authenticated = has(&with_keys);
        // An image whose tick comes from a timer does not wait for a host.
        if !(is_authenticated || has(&wanted)) || has("+timer-tick") {
            return Err(EmulatedError::WrongImage { path, wanted });
        }
        Ok(Self { path, bytes, is_authenticated })
    }

    /// Whether it authenticates links and requests, once it is given a key.
    #[must_use]
    pub fn is_authenticated(&self) -> bool {
        self.is_authenticated
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The whole file, with what a debugger knows.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Where a build leaves the image: in the folder that this program was built in, or in `target`.
pub fn built() -> PathBuf {
    let program = env::current_exe().unwrap_or_default();
    let beside = program.ancestors().map(|folder| folder.join(BUILT)).find(|path| path.is_file());
    beside.unwrap_or_else(|| Path::new("target").join(BUILT))
}
