//! Motor of a board with a drive: configuration and identification.

use std::io::{Read, Write};

use dimsart_link::protocol::{
    Identification, IdentificationFailure, IdentifiedMotor, MotorAction, MotorFallback, MotorReport, Refusal,
    Request, Response, StoreError, motor_checksum,
};
use drive::Configuration;

use super::device::take;
use super::{ConnectError, Device};

/// Maximum number of polls of an identification, a few milliseconds each; twice the longest identification.
const MAX_LOOKS: u32 = 20_000;

/// Motor configuration in use.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorState {
    /// Configuration with the board's inverter.
    pub configuration: Configuration,
    /// Whether it was loaded from storage instead of the image.
    pub is_stored: bool,
    /// Why the stored configuration was not loaded.
    pub fallback: Option<&'static str>,
    /// Whether the next start loads another configuration.
    pub is_restart_pending: bool,
}

impl<S: Read + Write> Device<S> {
    /// Reads the motor configuration.
    ///
    /// # Errors
    /// [`ConnectError::NoDrive`], also of an older image; [`ConnectError::MotorLayout`].
    pub fn motor(&mut self) -> Result<MotorState, ConnectError> {
        let report = self.motor_report(MotorAction::Read)?;
        if report.layout != Configuration::LAYOUT {
            return Err(ConnectError::MotorLayout(report.layout));
        }
        let configuration =
            Configuration::from_words(&report.words).ok_or(ConnectError::MotorLayout(report.layout))?;
        let fallback = report.fallback.map(|fallback| match fallback {
            MotorFallback::Storage => "the storage cannot be read",
            MotorFallback::Layout => "an image with another configuration layout wrote the configuration",
            MotorFallback::Value => "a value is out of range, or invalid for this board",
            MotorFallback::Damaged => {
                "a damaged storage entry may be a newer configuration: set the configuration again"
            }
            _ => "unknown reason of a newer version",
        });
        Ok(MotorState {
            configuration,
            is_stored: report.is_stored,
            fallback,
            is_restart_pending: report.is_restart_pending,
        })
    }

    /// Stores a configuration for the next start of the board. Stops the scheme if the write would delay the tick, and returns
    /// whether it did.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] while a client holds the lease, or for an invalid configuration; [`ConnectError::NoDrive`].
    pub fn store_motor(&mut self, told: &Configuration) -> Result<bool, ConnectError> {
        let words = told.to_words();
        for (place, word) in (0..).zip(words) {
            self.motor_report(MotorAction::PutWord { place, word })?;
        }
        let count = u8::try_from(words.len()).unwrap_or(u8::MAX);
        let checksum = motor_checksum(&words);
        self.write_motor(MotorAction::Store { layout: Configuration::LAYOUT, count, checksum })
    }

    /// Deletes the stored configuration: the next start loads the image's. May stop the scheme as
    /// [`store_motor`](Self::store_motor) does.
    ///
    /// # Errors
    /// As [`store_motor`](Self::store_motor).
    pub fn delete_motor(&mut self) -> Result<bool, ConnectError> {
        self.write_motor(MotorAction::Delete)
    }

    /// Takes the lease, lets the board identify its motor with `current_a`, and releases the lease. Calls `pause` between two
    /// polls. THE MOTOR TURNS.
    ///
    /// # Errors
    /// [`ConnectError::Identification`] with the board's reason; [`ConnectError::Refused`]; [`ConnectError::NoDrive`].
    pub fn identify_motor(
        &mut self,
        current_a: f32,
        mut pause: impl FnMut(),
    ) -> Result<IdentifiedMotor, ConnectError> {
        self.hold_lease()?;
        let found = self.wait_for_motor(current_a, &mut pause);
        let given_back = self.release_lease();
        let found = found?;
        given_back?;
        found.map_err(ConnectError::Identification)
    }

    fn wait_for_motor(
        &mut self,
        current_a: f32,
        pause: &mut impl FnMut(),
    ) -> Result<Result<IdentifiedMotor, IdentificationFailure>, ConnectError> {
        let mut action = MotorAction::Identify { current_a };
        for _ in 0..MAX_LOOKS {
            let found = self.ask(&Request::Motor(action), take!(Identification));
            match no_drive(found)? {
                Identification::Found(found) => return Ok(Ok(found)),
                Identification::Failed(failure) => return Ok(Err(failure)),
                _ => {}
            }
            action = MotorAction::ReadIdentification;
            pause();
        }
        Ok(Err(IdentificationFailure::Ended))
    }

    fn write_motor(&mut self, action: MotorAction) -> Result<bool, ConnectError> {
        match self.motor_report(action) {
            Err(ConnectError::Refused(Refusal::Store(StoreError::SchemeIsRunning))) => {
                self.stop()?;
                self.motor_report(action).map(|_| true)
            }
            done => done.map(|_| false),
        }
    }

    fn motor_report(&mut self, action: MotorAction) -> Result<MotorReport, ConnectError> {
        no_drive(self.ask(&Request::Motor(action), take!(Motor)))
    }
}

fn no_drive<T>(answer: Result<Option<T>, ConnectError>) -> Result<T, ConnectError> {
    match answer {
        Ok(None) | Err(ConnectError::Refused(Refusal::Unsupported)) => Err(ConnectError::NoDrive),
        answer => answer?.ok_or(ConnectError::NoDrive),
    }
}
