//! Link 0 over FDCAN 1.

use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::peripherals::{FDCAN1, PA11, PA12};
use embassy_stm32::{Peri, bind_interrupts};

use crate::stm32g4::fdcan;

pub(super) use fdcan::{CanReceiver as LinkIn, CanSender as LinkOut};

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

pub(super) fn start(
    can: Peri<'static, FDCAN1>,
    receive: Peri<'static, PA11>,
    send: Peri<'static, PA12>,
) -> (LinkIn, LinkOut) {
    fdcan::start(CanConfigurator::new(can, receive, send, Interrupts), 0)
}
