//! The chip's operational amplifiers for the shunts, by registers (RM0440, 25).

use embassy_stm32::pac;
use embassy_stm32::pac::opamp::Opamp;
use embassy_stm32::pac::opamp::vals::{PgaGain, VmSel, VpSel};

/// Turns on amplifiers 1 to 3 with a gain of 16, inputs at `VINP0`, the feedback network at `VINM0`, and
/// output pins driven (RM0440, 25.3.5 and 25.5.1).
pub(super) fn start() {
    pac::RCC.apb2enr().modify(|clocks| clocks.set_syscfgen(true));
    let amplifiers: [Opamp; 3] = [pac::OPAMP1, pac::OPAMP2, pac::OPAMP3];
    for amplifier in amplifiers {
        amplifier.csr().write(|control| {
            control.set_vp_sel(VpSel::VINP0);
            control.set_vm_sel(VmSel::PGA);
            control.set_pga_gain(PgaGain::GAIN16_INPUT_VINM0);
            control.set_opahsm(true);
        });
        amplifier.csr().modify(|control| control.set_opampen(true));
    }
}
