//! The two ends of the line.

use crate::link::Address;
use crate::scenario::{Scenario, SideSection};

/// One of the two ends of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The operator's end.
    Master,
    /// The remote end.
    Slave,
}

impl Side {
    /// Its name in schemes and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Master => "master",
            Self::Slave => "slave",
        }
    }

    /// The other end.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Master => Self::Slave,
            Self::Slave => Self::Master,
        }
    }

    /// Its controller and device.
    #[must_use]
    pub fn section(self, scenario: &Scenario) -> &SideSection {
        match self {
            Self::Master => &scenario.master,
            Self::Slave => &scenario.slave,
        }
    }

    /// Where it listens when it is a process of its own.
    #[must_use]
    pub fn address(self, scenario: &Scenario) -> &Address {
        match self {
            Self::Master => &scenario.link.master_address,
            Self::Slave => &scenario.link.slave_address,
        }
    }

    /// Where it finds the other side then: at the other end of what it is at itself, or at another socket.
    #[must_use]
    pub fn meeting_place(self, scenario: &Scenario) -> &Address {
        match self.address(scenario) {
            Address::Udp(_) => self.other().address(scenario),
            own => own,
        }
    }
}
