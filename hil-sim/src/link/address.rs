//! Address of a station that is a separate process: medium and endpoint.

use std::fmt;
use std::net::SocketAddr;

use dimsart_link::protocol::DEFAULT_BAUD;
use serde::{Deserialize, Serialize};

/// Address of a station.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Address {
    /// A UDP socket: `IP:PORT`.
    Udp(SocketAddr),
    /// A serial port of this computer: `serial:PATH`, or `serial:PATH@BAUD`.
    Serial {
        /// The port, such as `/dev/ttyUSB0`.
        path: String,
        /// Bit rate, bit/s.
        baud: u32,
    },
    /// A CAN interface of this computer: `can:INTERFACE`, or `canfd:INTERFACE` for CAN FD frames.
    Can {
        /// The interface, such as `can0`.
        interface: String,
        /// Whether CAN FD frames are used.
        is_fd: bool,
    },
}

impl TryFrom<String> for Address {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let can = |interface: &str, is_fd| Self::Can { interface: interface.to_owned(), is_fd };
        let address = match text.split_once(':') {
            Some(("serial", port)) => serial(port),
            Some(("can", interface)) => Some(can(interface, false)),
            Some(("canfd", interface)) => Some(can(interface, true)),
            _ => text.parse().ok().map(Self::Udp),
        };
        let is_named = !text.ends_with(':');
        address
            .filter(|_| is_named)
            .ok_or("expected IP:PORT, serial:PATH, serial:PATH@BAUD, can:INTERFACE or canfd:INTERFACE")
    }
}

fn serial(port: &str) -> Option<Address> {
    let (path, baud) = match port.rsplit_once('@') {
        Some((path, baud)) => (path, baud.parse().ok()?),
        None => (port, DEFAULT_BAUD),
    };
    (!path.is_empty()).then(|| Address::Serial { path: path.to_owned(), baud })
}

impl From<Address> for String {
    fn from(address: Address) -> Self {
        address.to_string()
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Udp(address) => write!(f, "{address}"),
            Self::Serial { path, baud: DEFAULT_BAUD } => write!(f, "serial:{path}"),
            Self::Serial { path, baud } => write!(f, "serial:{path}@{baud}"),
            Self::Can { interface, is_fd: false } => write!(f, "can:{interface}"),
            Self::Can { interface, is_fd: true } => write!(f, "canfd:{interface}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> Option<Address> {
        Address::try_from(text.to_owned()).ok()
    }

    #[test]
    fn an_address_is_written_as_it_is_read() {
        for text in ["127.0.0.1:5000", "serial:/dev/ttyUSB0", "serial:COM3@115200", "can:can0", "canfd:vcan1"]
        {
            assert_eq!(address(text).unwrap().to_string(), text);
        }
        let path = "/dev/ttyS0".to_owned();
        assert_eq!(address("serial:/dev/ttyS0"), Some(Address::Serial { path, baud: 921_600 }));
    }

    #[test]
    fn what_is_no_address_is_refused() {
        for text in [
            "",
            "localhost",
            "127.0.0.1",
            "serial:",
            "serial:@9600",
            "serial:/dev/ttyS0@fast",
            "can:",
            "usb:1",
        ] {
            assert_eq!(address(text), None, "{text}");
        }
    }
}
