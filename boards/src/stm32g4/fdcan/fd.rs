//! CAN FD: a content of at most 63 bytes per frame.

use dimsart_link::carrier::can_fd;
use embassy_stm32::can::config::FrameTransmissionConfig;
use embassy_stm32::can::frame::{FdFrame, Header};
use embedded_can::Id;

/// Whether data uses the higher bit rate.
pub(super) const IS_FAST: bool = !cfg!(feature = "one-can-rate");
pub(super) const ALLOWED: FrameTransmissionConfig =
    if IS_FAST { FrameTransmissionConfig::AllowFdCanAndBRS } else { FrameTransmissionConfig::AllowFdCan };

/// Stateless: a content is a frame.
pub(super) struct Receiver;

impl Receiver {
    pub(super) fn new() -> Self {
        Self
    }

    #[expect(clippy::unused_self, reason = "the classic CAN receiver has a state")]
    pub(super) fn push<'d>(&mut self, data: &'d [u8], _: u16) -> Option<&'d [u8]> {
        can_fd::unpack(data)
    }
}

/// Returns a content's frame; none if it does not fit.
pub(super) fn frames(content: &[u8], _: u16, identifier: Id) -> impl Iterator<Item = FdFrame> {
    core::iter::once(content).filter_map(move |content| {
        let data = can_fd::pack(content)?;
        let header = Header::new_fd(identifier, u8::try_from(data.len()).ok()?, false, IS_FAST);
        FdFrame::new(header, &data).ok()
    })
}
