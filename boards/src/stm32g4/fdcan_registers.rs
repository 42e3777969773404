//! What the driver of FDCAN 1 leaves out.

use embassy_stm32::pac;
use embassy_stm32::pac::can::regs::Txbcr;

/// Looks at what waits until it is taken away: a few microseconds.
const CANCEL_LOOKS: u8 = 30;

/// A transceiver's delay is about as long as a bit of a CAN FD frame's data: what is sent is compared that much later
/// with what is read back, `to_sample` cycles of the clock behind the measured delay. The driver leaves this out.
pub(crate) fn compensate_delay(to_sample: u8) {
    let can = pac::FDCAN1;
    can.cccr().modify(|control| control.set_init(true));
    while !can.cccr().read().init() {}
    can.cccr().modify(|control| control.set_cce(true));
    can.tdcr().write(|delay| delay.set_tdco(to_sample));
    can.dbtp().modify(|timing| timing.set_tdc(true));
    can.cccr().modify(|control| control.set_init(false));
}

/// Takes away the frames that wait; the one that is on its way is not sent again. The oldest first: a FIFO goes on
/// only when that one is cancelled. Its place is used again two frames later, when it has left the line for sure.
pub(crate) fn take_away() {
    let can = pac::FDCAN1;
    for _ in 0..CANCEL_LOOKS {
        let oldest = 1 << can.txfqs().read().tfgi();
        can.txbcr().write_value(Txbcr(can.txbrp().read().0 & oldest));
    }
}
