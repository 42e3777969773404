//! The firmware image: path and validation.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use super::{BOARD, EmulatedError, IMAGE_FOLDER_VARIABLE};

/// Path of the image in the target folder, as built by [`BUILD_COMMAND`](super::BUILD_COMMAND).
const BUILT: &str = "thumbv7em-none-eabihf/firmware/firmware";

/// A firmware image for the emulated board.
#[derive(Debug, Clone)]
pub struct Image {
    path: PathBuf,
    bytes: Vec<u8>,
    is_authenticated: bool,
}

impl Image {
    /// Finds the image: at `given`, in the folder of the variable `DIMSART_FIRMWARE`, built next to this program, or
    /// in `target`, in this order.
    ///
    /// # Errors
    /// [`EmulatedError::ImageNotFound`], [`EmulatedError::UnreadableImage`] or [`EmulatedError::WrongImage`].
    pub fn find(given: Option<&Path>) -> Result<Self, EmulatedError> {
        let path = match (given, env::var_os(IMAGE_FOLDER_VARIABLE)) {
            (Some(path), _) => path.to_owned(),
            (None, Some(folder)) => Path::new(&folder).join(BOARD),
            (None, None) => built(),
        };
        if !path.is_file() {
            return Err(EmulatedError::ImageNotFound { path });
        }
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(EmulatedError::UnreadableImage { path, source }),
        };
        let version = env!("CARGO_PKG_VERSION");
        let (wanted, with_keys) =
            (format!("dimsart {version} {BOARD}"), format!("dimsart {version} auth+{BOARD}"));
        let has = |text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
        let is_authenticated = has(&with_keys);
        // An image with a timer tick does not wait for a host.
        if !(is_authenticated || has(&wanted)) || has("+timer-tick") {
            return Err(EmulatedError::WrongImage { path, wanted });
        }
        Ok(Self { path, bytes, is_authenticated })
    }

    /// Whether it supports authentication of links and requests.
    #[must_use]
    pub fn is_authenticated(&self) -> bool {
        self.is_authenticated
    }

    /// Returns its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the file with debug information.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Returns the path of a built image: in the build folder of this program, or in `target`.
pub fn built() -> PathBuf {
    let program = env::current_exe().unwrap_or_default();
    let beside = program.ancestors().map(|folder| folder.join(BUILT)).find(|path| path.is_file());
    beside.unwrap_or_else(|| Path::new("target").join(BUILT))
}
