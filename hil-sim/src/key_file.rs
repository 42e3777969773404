//! Key file of both ends of a link.

use std::fs;
use std::path::{Path, PathBuf};

/// Bytes of a key.
const KEY_BYTES: usize = 16;
/// Maximum size of a key file, including whitespace, bytes.
const MAX_BYTES: u64 = 4096;

/// Invalid key file. Messages never contain the key.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// The file cannot be read.
    #[error(
        "{}: cannot read the key ({source}); create one with `(umask 077; openssl rand -hex 16 > {})` and copy \
        it to both sides", path.display(), path.display()
    )]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A device, pipe or folder, which can block or never end, or a file that is too large.
    #[error(
        "{}: a key file must be a regular file of at most {MAX_BYTES} bytes; create a key with `openssl rand \
        -hex {KEY_BYTES}`",
        path.display()
    )]
    NotRegular {
        /// The file.
        path: PathBuf,
    },
    /// Too short or too long.
    #[error(
        "{}: key has {found} hexadecimal digits, must have {}; create one with `openssl rand -hex {KEY_BYTES}`",
        path.display(),
        2 * KEY_BYTES
    )]
    Length {
        /// The file.
        path: PathBuf,
        /// Number of characters, without surrounding whitespace.
        found: usize,
    },
    /// Not a hexadecimal digit.
    #[error(
        "{}: character {place} of the key is not a hexadecimal digit; create a key with `openssl rand -hex \
        {KEY_BYTES}`",
        path.display()
    )]
    Digit {
        /// The file.
        path: PathBuf,
        /// Its position, from 1.
        place: usize,
    },
}

/// Reads a key: 32 hexadecimal digits, with or without a final newline.
///
/// # Errors
/// [`KeyFileError`] if the file is unreadable or invalid.
pub fn read(path: &Path) -> Result<[u8; KEY_BYTES], KeyFileError> {
    let path_of = || path.to_owned();
    let unreadable = |source| KeyFileError::Unreadable { path: path_of(), source };
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() || metadata.len() > MAX_BYTES {
        return Err(KeyFileError::NotRegular { path: path_of() });
    }
    let text = fs::read_to_string(path).map_err(unreadable)?;
    let text = text.trim();
    let digit = |(index, character): (usize, char)| {
        let digit = character.to_digit(16).and_then(|digit| u8::try_from(digit).ok());
        digit.ok_or_else(|| KeyFileError::Digit { path: path_of(), place: index + 1 })
    };
    let digits = text.chars().enumerate().map(digit).collect::<Result<Vec<u8>, _>>()?;
    let (pairs, _) = digits.as_chunks::<2>();
    let bytes: Vec<u8> = pairs.iter().map(|[high, low]| high << 4 | low).collect();
    let key = bytes.try_into().ok().filter(|_| digits.len() == 2 * KEY_BYTES);
    key.ok_or(KeyFileError::Length { path: path_of(), found: digits.len() })
}

/// Warns if other users can read the file, if the system provides permissions.
#[must_use]
pub fn permission_warning(path: &Path) -> Option<String> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = fs::metadata(path).ok()?.permissions().mode();
        let path = path.display();
        (mode & 0o077 != 0)
            .then(|| format!("other users of this computer can read the key: run `chmod 600 {path}`"))
    }
    #[cfg(not(unix))]
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<[u8; KEY_BYTES], String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), text).unwrap();
        read(file.path()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_key_is_32_digits() {
        let key =
            [0, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x99, 0xaa, 0xbb, 0xcc, 0xdd, 0xee, 0xff];
        assert_eq!(read_text("00112233445566778899aabbccddeeff\n"), Ok(key));
        assert_eq!(read_text("00112233445566778899AABBCCDDEEFF"), Ok(key));
    }

    #[test]
    fn what_is_no_key_is_told_without_its_digits() {
        for (text, expected) in [
            ("", "key has 0 hexadecimal digits, must have 32"),
            ("5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5", "key has 31 hex"),
            ("5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a", "key has 34 hex"),
            ("5a5a5a5a 5a5a5a5a5a5a5a5a5a5a5a5a", "character 9 of the key is not a hexadecimal digit"),
        ] {
            let message = read_text(text).unwrap_err();
            assert!(message.contains(expected) && !message.contains("5a5a"), "{message}");
        }
        let message = read(Path::new("not/here.key")).unwrap_err().to_string();
        assert!(message.contains("openssl rand -hex 16 > not/here.key"), "{message}");
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_small_regular_file_is_no_key_and_is_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        // Opening a pipe blocks until a writer opens it.
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let large = folder.path().join("large.key");
        fs::write(&large, [b' '; 4097]).unwrap();
        for path in [Path::new("/dev/zero"), &pipe, &large, folder.path()] {
            let message = read(path).unwrap_err().to_string();
            let expected =
                format!("{}: a key file must be a regular file of at most 4096 bytes", path.display());
            assert!(message.starts_with(&expected), "{message}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_others_can_read_is_warned_of() {
        use std::os::unix::fs::PermissionsExt as _;
        let file = tempfile::NamedTempFile::new().unwrap();
        for (mode, is_exposed) in [(0o600, false), (0o400, false), (0o640, true), (0o644, true)] {
            fs::set_permissions(file.path(), fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(permission_warning(file.path()).is_some(), is_exposed, "{mode:o}");
        }
    }
}
