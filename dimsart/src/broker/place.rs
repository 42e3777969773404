//! Paths of a port's lock and socket: equal for all spellings of a port, different for different ports.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

/// Maximum characters of a port's name in file names: paths of sockets are short.
const READABLE: usize = 24;

/// Files of a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Place {
    /// The port in canonical spelling.
    name: String,
    /// Without an extension.
    path: PathBuf,
}

impl Place {
    pub(super) fn of(port: &str) -> io::Result<Self> {
        Ok(Self::within(&private_folder()?, port))
    }

    fn within(folder: &Path, port: &str) -> Self {
        let name = one_spelling(port);
        let plain = name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' });
        let plain: Vec<char> = plain.collect();
        let last = plain.len().saturating_sub(READABLE);
        let readable: String = plain.get(last..).unwrap_or_default().iter().collect();
        let path = folder.join(format!("{readable}-{:016x}", hash(&name)));
        Self { name, path }
    }

    pub(super) fn socket(&self) -> PathBuf {
        self.path.with_extension("sock")
    }

    /// Locks the port for its broker; none if another program holds the lock.
    pub(super) fn lock(&self) -> io::Result<Option<File>> {
        let path = self.path.with_extension("lock");
        let file = File::options().create(true).truncate(false).write(true).open(path)?;
        match file.try_lock() {
            Ok(()) => Ok(Some(file)),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// Writes the port's name to its lock, before listening.
    pub(super) fn write_name(&self, mut lock: &File) -> io::Result<()> {
        lock.set_len(0)?;
        lock.write_all(self.name.as_bytes())
    }

    /// Connects to the broker of the port.
    pub(super) fn connect(&self) -> io::Result<UnixStream> {
        let stream = UnixStream::connect(self.socket())?;
        let found = fs::read_to_string(self.path.with_extension("lock"))?;
        if found == self.name {
            return Ok(stream);
        }
        let file = self.path.display();
        Err(io::Error::new(
            ErrorKind::InvalidData,
            format!("lock file {file}.lock belongs to another port, {found}"),
        ))
    }
}

/// Canonical spelling of a port: resolves links such as `/dev/serial/by-id`. A missing file is reported when it is opened.
fn one_spelling(port: &str) -> String {
    let file = |path: &str| {
        let found = fs::canonicalize(path).ok().and_then(|found| found.into_os_string().into_string().ok());
        found.unwrap_or_else(|| path.to_owned())
    };
    match port.split_once(':') {
        Some(("sim", _)) => port.to_owned(),
        Some(("unix", path)) => format!("unix:{}", file(path)),
        Some(("tcp", address)) => match address.rsplit_once(':') {
            Some((host, number)) => {
                let number =
                    number.parse::<u16>().map_or_else(|_| number.to_owned(), |found| found.to_string());
                format!("tcp:{}:{number}", host.to_ascii_lowercase())
            }
            None => port.to_owned(),
        },
        // Paths in /dev/serial/by-path contain colons.
        _ => file(port),
    }
}

/// FNV-1a, stable across versions and computers.
fn hash(name: &str) -> u64 {
    name.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Returns the names of the ports shared by programs of this user, sorted, for [`open`](super::open).
///
/// # Errors
/// The folder of ports cannot be read.
pub fn shared_ports() -> io::Result<Vec<String>> {
    let files = fs::read_dir(private_folder()?)?.filter_map(|entry| Some(entry.ok()?.path()));
    let locks = files.filter(|file| file.extension().is_some_and(|extension| extension == "lock"));
    // Trying the lock would disturb a program that wants it.
    let shared = locks.filter(|lock| UnixStream::connect(lock.with_extension("sock")).is_ok());
    let mut ports: Vec<String> = shared.filter_map(|lock| fs::read_to_string(lock).ok()).collect();
    ports.sort();
    Ok(ports)
}

/// Returns a private folder of this user, kept until the computer restarts.
///
/// # Errors
/// The folder cannot be created; [`PermissionDenied`](ErrorKind::PermissionDenied) if other users can access it.
pub fn private_folder() -> io::Result<PathBuf> {
    let folder = match std::env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty()) {
        Some(folder) => PathBuf::from(folder).join("dimsart"),
        None => std::env::temp_dir().join(format!("dimsart-{}", rustix::process::getuid().as_raw())),
    };
    fs::DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
    // Other users could pose as the broker in a writable folder.
    let found = fs::metadata(&folder)?;
    if found.uid() != rustix::process::getuid().as_raw() || found.mode() & 0o077 != 0 {
        let message = format!(
            "folder {} is accessible to other users: set its owner to this user and its mode to 0700",
            folder.display()
        );
        return Err(io::Error::new(ErrorKind::PermissionDenied, message));
    }
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::os::unix::net::UnixListener;

    #[test]
    fn no_two_ports_have_the_same_files() {
        let tail = "a_long_name_of_a_folder_with_more_than_forty_eight_letters/port";
        let ports = [
            "sim:arm_1",
            "sim:arm-1",
            "sim:arm.1",
            "sim_arm_1",
            "sim:Arm_1",
            "tcp:arm:1",
            "tcp:arm:11",
            &format!("unix:/one/{tail}"),
            &format!("unix:/two/{tail}"),
            &format!("/one/{tail}"),
            &format!("/two/{tail}"),
        ];
        let paths: BTreeSet<_> = ports.map(|port| Place::within(Path::new("/"), port).path).into();
        assert_eq!(paths.len(), ports.len());
        assert!(paths.iter().all(|path| path.as_os_str().len() < 48), "{paths:?}");
    }

    #[test]
    fn every_spelling_of_a_device_has_the_same_files() {
        let folder = tempfile::tempdir().unwrap();
        let device = folder.path().join("ttyACM0");
        File::create(&device).unwrap();
        let links = ["usb-STLINK-if02", "pci-0000:00:14.0-usb-0:1:1.2"].map(|name| folder.path().join(name));
        for link in &links {
            std::os::unix::fs::symlink(&device, link).unwrap();
        }
        let place = |port: &str| Place::within(Path::new("/"), port);
        for link in &links {
            let [link, device] = [link, &device].map(|path| path.to_str().unwrap());
            assert_eq!(place(link), place(device));
            assert_eq!(place(&format!("unix:{link}")), place(&format!("unix:{device}")));
        }
        let dotted = folder.path().join("./../").join(folder.path().file_name().unwrap()).join("ttyACM0");
        assert_eq!(place(dotted.to_str().unwrap()), place(device.to_str().unwrap()));
        assert_eq!(place("tcp:LocalHost:04000"), place("tcp:localhost:4000"));
    }

    #[test]
    fn a_socket_whose_lock_is_of_another_port_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let place = Place::within(folder.path(), "sim:arm_1");
        let _listener = UnixListener::bind(place.socket()).unwrap();
        let lock = place.lock().unwrap().unwrap();
        place.write_name(&lock).unwrap();
        assert!(place.connect().is_ok());
        let other = Place { name: "sim:arm-1".to_owned(), ..place.clone() };
        assert!(other.connect().unwrap_err().to_string().contains("belongs to another port, sim:arm_1"));
    }
}
