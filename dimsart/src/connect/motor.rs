//! The motor of a board that has a drive: its configuration, and what the board finds out about it.

use std::io::{Read, Write};

use dimsart_link::protocol::{
    FoundMotor, Identification, IdentificationFailure, MotorAction, MotorFallback, MotorReport, Refusal,
    Request, Response, StoreError, motor_checksum,
};
use drive::Configuration;

use super::device::take;
use super::{ConnectError, Device};

/// Looks at an identification that goes on, a few milliseconds each: none takes half as long.
const MOST_LOOKS: u32 = 20_000;

/// What a board's motor is run by.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorState {
    /// By this configuration, whose inverter is the board's.
    pub configuration: Configuration,
    /// Whether it was kept, and is not the image's.
    pub is_kept: bool,
    /// Why what is kept was not taken, if it was not.
    pub fallback: Option<&'static str>,
    /// Whether the next start takes another one.
    pub waits: bool,
}

impl<S: Read + Write> Device<S> {
    /// What the motor is run by.
    ///
    /// # Errors
    /// [`ConnectError::NoDrive`], also of an older image; [`ConnectError::MotorLayout`].
    pub fn motor(&mut self) -> Result<MotorState, ConnectError> {
        let report = self.motor_report(MotorAction::Look)?;
        if report.layout != Configuration::LAYOUT {
            return Err(ConnectError::MotorLayout(report.layout));
        }
        let configuration =
            Configuration::from_words(&report.words).ok_or(ConnectError::MotorLayout(report.layout))?;
        let fallback = report.fallback.map(|fallback| match fallback {
            MotorFallback::Storage => "it cannot be read",
            MotorFallback::Layout => "it is of an image with another layout of configurations",
            MotorFallback::Value => "a value of it is out of its range, or not for this board",
            MotorFallback::Damaged => {
                "a damaged entry of the storage may be a newer configuration: set it again"
            }
            _ => "for a reason that this version does not know",
        });
        Ok(MotorState { configuration, is_kept: report.is_kept, fallback, waits: report.waits })
    }

    /// Has the board keep a configuration for its next start. Where writing would hold up the tick, the scheme is stopped; true
    /// when it was.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] while somebody holds the lease, or when the board would not take it; [`ConnectError::NoDrive`].
    pub fn keep_motor(&mut self, told: &Configuration) -> Result<bool, ConnectError> {
        let words = told.to_words();
        for (place, word) in (0..).zip(words) {
            self.motor_report(MotorAction::Put { place, word })?;
        }
        let count = u8::try_from(words.len()).unwrap_or(u8::MAX);
        let checksum = motor_checksum(&words);
        self.write_motor(MotorAction::Keep { layout: Configuration::LAYOUT, count, checksum })
    }

    /// Has the board keep none: its next start takes the image's. As [`keep_motor`](Self::keep_motor) otherwise.
    ///
    /// # Errors
    /// As [`keep_motor`](Self::keep_motor).
    pub fn forget_motor(&mut self) -> Result<bool, ConnectError> {
        self.write_motor(MotorAction::Forget)
    }

    /// Takes the lease, has the board find out about its motor with `current_a`, and gives the lease back. `pause` is called
    /// between two looks. THE MOTOR TURNS.
    ///
    /// # Errors
    /// [`ConnectError::Identification`] with what the board says; [`ConnectError::Refused`]; [`ConnectError::NoDrive`].
    pub fn identify_motor(
        &mut self,
        current_a: f32,
        mut pause: impl FnMut(),
    ) -> Result<FoundMotor, ConnectError> {
        self.hold_lease()?;
        let found = self.wait_for_motor(current_a, &mut pause);
        let given_back = self.give_lease_back();
        let found = found?;
        given_back?;
        found.map_err(ConnectError::Identification)
    }

    fn wait_for_motor(
        &mut self,
        current_a: f32,
        pause: &mut impl FnMut(),
    ) -> Result<Result<FoundMotor, IdentificationFailure>, ConnectError> {
        let mut action = MotorAction::Identify { current_a };
        for _ in 0..MOST_LOOKS {
            let found = self.ask(&Request::Motor(action), take!(Identification));
            match no_drive(found)? {
                Identification::Found(found) => return Ok(Ok(found)),
                Identification::Failed(failure) => return Ok(Err(failure)),
                _ => {}
            }
            action = MotorAction::Found;
            pause();
        }
        Ok(Err(IdentificationFailure::Ended))
    }

    fn write_motor(&mut self, action: MotorAction) -> Result<bool, ConnectError> {
        match self.motor_report(action) {
            Err(ConnectError::Refused(Refusal::Store(StoreError::SchemeRuns))) => {
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
        Ok(None) | Err(ConnectError::Refused(Refusal::NotUnderstood)) => Err(ConnectError::NoDrive),
        answer => answer?.ok_or(ConnectError::NoDrive),
    }
}
