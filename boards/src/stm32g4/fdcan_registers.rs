//! Functions missing in the driver of FDCAN 1.

use embassy_stm32::pac;
use embassy_stm32::pac::can::regs::Txbcr;

/// Polls of pending frames until they are cancelled: a few microseconds.
const CANCEL_LOOKS: u8 = 30;

/// Enables the transmitter delay compensation: a transceiver's delay is about one data bit, so the read-back
/// is compared `to_sample` clock cycles after the measured delay.
pub(crate) fn compensate_delay(to_sample: u8) {
    let can = pac::FDCAN1;
    can.cccr().modify(|control| control.set_init(true));
    while !can.cccr().read().init() {}
    can.cccr().modify(|control| control.set_cce(true));
    can.tdcr().write(|delay| delay.set_tdco(to_sample));
    can.dbtp().modify(|timing| timing.set_tdc(true));
    can.cccr().modify(|control| control.set_init(false));
}

/// Cancels the pending frames; the frame being sent is not retried. Cancels the oldest first, because only
/// then the FIFO advances. Its element is reused two frames later, when it has certainly left the line.
pub(crate) fn take_away() {
    let can = pac::FDCAN1;
    for _ in 0..CANCEL_LOOKS {
        let oldest = 1 << can.txfqs().read().tfgi();
        can.txbcr().write_value(Txbcr(can.txbrp().read().0 & oldest));
    }
}
