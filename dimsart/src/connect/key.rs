//! The key that a device keeps: given, taken away, and used to seal what it asks for.

use std::fmt;
use std::io::{Read, Write};

use dimsart_link::auth::Key;
use dimsart_link::protocol::{KeyAction, KeyBytes, KeyState, Refusal, Request, RequestSealer, Response};
use serde::Serialize;

use super::{ConnectError, Device};

/// How a device stands to keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KeyReport {
    /// It holds none.
    Open,
    /// It holds one.
    Locked,
    /// It cannot read what it kept.
    Damaged,
}

impl fmt::Display for KeyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open => "it holds no key: it takes what anybody asks, and authenticates nothing",
            Self::Locked => "it holds a key: what changes or moves it, it takes with --key-file alone",
            Self::Damaged => {
                "it CANNOT READ ITS KEY and takes nothing that changes or moves it: erase its flash and flash it anew"
            }
        })
    }
}

impl<S: Read + Write> Device<S> {
    /// Seals with this key, from now on, what a locked device takes from who has it alone. Gives how the device
    /// stands: to one that is open everything is said as before.
    ///
    /// # Errors
    /// [`ConnectError::NoKeys`] when its image has no authentication; [`ConnectError::NoRandomness`].
    pub fn use_key(&mut self, key: &[u8; 16]) -> Result<KeyReport, ConnectError> {
        let state = self.key_action(KeyAction::Look)?;
        let sealer = (state == KeyReport::Locked).then(|| sealer(key)).transpose()?;
        self.line_mut().seal_with(sealer);
        Ok(state)
    }

    /// Gives the device a key and uses it from now on. The key goes over the line as it is.
    ///
    /// # Errors
    /// [`ConnectError::NoKeys`] when its image has no authentication; [`ConnectError::Refused`] when the device is not
    /// at rest, or is locked and this is not sealed with the key that it holds.
    pub fn set_key(&mut self, key: &[u8; 16]) -> Result<KeyReport, ConnectError> {
        let salt = random()?;
        let state = self.key_action(KeyAction::Set { key: KeyBytes(*key), salt })?;
        self.line_mut().seal_with(Some(sealer(key)?));
        Ok(state)
    }

    /// Has the device forget its key.
    ///
    /// # Errors
    /// As [`set_key`](Self::set_key).
    pub fn clear_key(&mut self) -> Result<KeyReport, ConnectError> {
        let state = self.key_action(KeyAction::Clear)?;
        self.line_mut().seal_with(None);
        Ok(state)
    }

    /// How the device stands to keys; none when its image has no authentication.
    pub(super) fn key_report(&mut self) -> Result<Option<KeyReport>, ConnectError> {
        match self.key_action(KeyAction::Look) {
            Err(ConnectError::NoKeys) => Ok(None),
            state => state.map(Some),
        }
    }

    fn key_action(&mut self, action: KeyAction) -> Result<KeyReport, ConnectError> {
        match self.ask(&Request::Key(action), state_of) {
            Err(ConnectError::Refused(Refusal::NotUnderstood)) => Err(ConnectError::NoKeys),
            state => Ok(match state?.ok_or(ConnectError::OtherAnswer)? {
                KeyState::Open => KeyReport::Open,
                KeyState::Locked => KeyReport::Locked,
                KeyState::Damaged => KeyReport::Damaged,
                _ => return Err(ConnectError::OtherAnswer),
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
