//! Sets and clears the key of a device, and authenticates requests with it.

use std::fmt;
use std::io::{Read, Write};

use dimsart_link::auth::Key;
use dimsart_link::protocol::{KeyAction, KeyBytes, KeyState, Refusal, Request, RequestSealer, Response};
use serde::Serialize;

use super::{ConnectError, Device};

/// Key state of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KeyReport {
    /// No key.
    Open,
    /// A key is set.
    Locked,
    /// The stored key cannot be read.
    Damaged,
}

impl fmt::Display for KeyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open => "no key is set: the device accepts every client without authentication",
            Self::Locked => "a key is set: changes and motion require --key-file",
            Self::Damaged => {
                "the device CANNOT READ ITS KEY and refuses changes and motion: erase its flash, then flash the image"
            }
        })
    }
}

impl<S: Read + Write> Device<S> {
    /// Authenticates the requests that a locked device accepts only with its key. Returns the key state; requests to an
    /// open device stay unauthenticated.
    ///
    /// # Errors
    /// [`ConnectError::NoKeys`] when its image has no authentication; [`ConnectError::NoRandomness`].
    pub fn use_key(&mut self, key: &[u8; 16]) -> Result<KeyReport, ConnectError> {
        let state = self.key_action(KeyAction::Read)?;
        let sealer = (state == KeyReport::Locked).then(|| sealer(key)).transpose()?;
        self.line_mut().seal_with(sealer);
        Ok(state)
    }

    /// Sets the key of the device and uses it from now on. The key is sent unencrypted.
    ///
    /// # Errors
    /// [`ConnectError::NoKeys`] when its image has no authentication; [`ConnectError::Refused`] when the device is not
    /// at rest, or is locked and the request is not authenticated with its present key.
    pub fn set_key(&mut self, key: &[u8; 16]) -> Result<KeyReport, ConnectError> {
        let salt = random()?;
        let state = self.key_action(KeyAction::Set { key: KeyBytes(*key), salt })?;
        self.line_mut().seal_with(Some(sealer(key)?));
        Ok(state)
    }

    /// Clears the key of the device.
    ///
    /// # Errors
    /// As [`set_key`](Self::set_key).
    pub fn clear_key(&mut self) -> Result<KeyReport, ConnectError> {
        let state = self.key_action(KeyAction::Clear)?;
        self.line_mut().seal_with(None);
        Ok(state)
    }

    /// Reads the key state; `None` when the image has no authentication.
    pub(super) fn key_report(&mut self) -> Result<Option<KeyReport>, ConnectError> {
        match self.key_action(KeyAction::Read) {
            Err(ConnectError::NoKeys) => Ok(None),
            state => state.map(Some),
        }
    }

    fn key_action(&mut self, action: KeyAction) -> Result<KeyReport, ConnectError> {
        match self.ask(&Request::Key(action), state_of) {
            Err(ConnectError::Refused(Refusal::Unsupported)) => Err(ConnectError::NoKeys),
            state => Ok(match state?.ok_or(ConnectError::UnexpectedAnswer)? {
                KeyState::Open => KeyReport::Open,
                KeyState::Locked => KeyReport::Locked,
                KeyState::Damaged => KeyReport::Damaged,
                _ => return Err(ConnectError::UnexpectedAnswer),
            }),
        }
    }
}

fn sealer(key: &[u8; 16]) -> Result<RequestSealer, ConnectError> {
    Ok(RequestSealer::new(&Key::new(key), random()?))
}

fn random() -> Result<u64, ConnectError> {
    getrandom::u64().map_err(|error| ConnectError::NoRandomness(error.to_string()))
}

fn state_of(response: Response<'_>) -> Option<KeyState> {
    match response {
        Response::Key(state) => Some(state),
        _ => None,
    }
}
