//! Replaces the key service in an image without authentication: accepts all requests at no cost.

use boards::{Selected, Storage};
use dimsart_link::protocol::{DecodeError, MAX_FRAME_BYTES, Refusal, Request, decode_request};

type Flash = <Selected as boards::Board>::Flash;

/// Nothing.
pub(crate) type KeysToTake = ();

/// Nothing.
pub(crate) type KeyRange = ();

/// Nothing.
pub(crate) fn range(_: &Storage<Flash>) {}

/// Nothing.
pub(crate) fn start(_: Option<()>, _: Option<&mut Flash>) -> (KeyService, KeysToTake) {
    (KeyService, ())
}

/// Accepts all requests.
pub(crate) struct KeyService;

#[expect(clippy::unused_self, reason = "the key service has a state")]
impl KeyService {
    /// Decodes the request in a frame. A [`Unsupported`](DecodeError::Unsupported) request is refused.
    pub(crate) fn take(&mut self, content: &[u8]) -> Result<(u16, Request), DecodeError> {
        decode_request(content)
    }

    /// Returns why the last request was refused.
    pub(crate) fn refusal(&self) -> Refusal {
        Refusal::Unsupported
    }

    /// None.
    pub(crate) fn handshake(&mut self, _: &mut [u8; MAX_FRAME_BYTES]) -> Option<usize> {
        None
    }
}
