//! Bytes of the command line: over UART 0, or in lockstep over the host's frames.

use core::convert::Infallible;

use embedded_io_async::{ErrorType, Read, Write};

use super::bytes::Bytes;
use super::{Interrupt, Register, unmask};

const DATA: Register = Register(0x4000_4000);
const STATE: Register = Register(0x4000_4004);
const CONTROL: Register = Register(0x4000_4008);
const CLEAR: Register = Register(0x4000_400C);
const BAUD_DIVIDER: Register = Register(0x4000_4010);
const SEND_FULL: u32 = 1 << 0;
const RECEIVE_FULL: u32 = 1 << 1;
const ENABLE_BOTH_WAYS_AND_INTERRUPTS: u32 = 0b1111;
const CLEAR_SENT: u32 = 1 << 0;
const CLEAR_RECEIVED: u32 = 1 << 1;
/// 25 MHz / 217: 115 200 baud.
const DIVIDER: u32 = 217;

/// Received bytes; lost if full.
pub(super) static RECEIVED: Bytes<512> = Bytes::new();
/// Bytes to send.
pub(super) static TO_SEND: Bytes<512> = Bytes::new();

/// The command line.
pub struct CommandPort;

impl crate::board::CommandPort for CommandPort {}

impl ErrorType for CommandPort {
    type Error = Infallible;
}

impl Read for CommandPort {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        Ok(RECEIVED.read(bytes).await)
    }
}

impl Write for CommandPort {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let written = TO_SEND.write(bytes).await;
        if cfg!(feature = "timer-tick") {
            cortex_m::peripheral::NVIC::pend(Interrupt::Uart0Send);
        }
        Ok(written)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Starts UART 0.
pub(super) fn start() {
    BAUD_DIVIDER.write(DIVIDER);
    CONTROL.write(ENABLE_BOTH_WAYS_AND_INTERRUPTS);
    unmask(Interrupt::Uart0Receive);
    unmask(Interrupt::Uart0Send);
}

pub(super) extern "C" fn received() {
    CLEAR.write(CLEAR_RECEIVED);
    while STATE.read() & RECEIVE_FULL != 0 {
        let [byte, ..] = DATA.read().to_le_bytes();
        RECEIVED.try_write(&[byte]);
    }
}

/// Continues sending: the UART is ready, or there are new bytes.
pub(super) extern "C" fn sent() {
    CLEAR.write(CLEAR_SENT);
    let mut byte = [0];
    while STATE.read() & SEND_FULL == 0 && TO_SEND.try_read(&mut byte) != 0 {
        let [byte] = byte;
        DATA.write(u32::from(byte));
    }
}
