//! Data of ST's X-NUCLEO-IHM08M1 on a NUCLEO-G474RE.

use drive::{Configuration, Limits};

use super::b_g431b_esc1::{self, HALF_BRIDGE, THERMISTOR_C};
use super::pins::QUADRATURE;
use super::{Pin, PinDirection, PinGroup, ThreePhaseDrive};
use crate::current_loop::Scaling;

/// Motor, encoder and limits: those of b-g431b-esc1 with the shield's voltages. Adjust them to the connected
/// hardware with the data sheets of motor and supply.
const CONFIGURATION: Configuration = Configuration {
    // The shield's range, with a margin.
    limits: Limits { min_bus_v: 10.0, max_bus_v: 45.0, ..b_g431b_esc1::CONFIGURATION.limits },
    ..b_g431b_esc1::CONFIGURATION
};
/// Motor, encoder and scaling.
pub const DRIVE: ThreePhaseDrive = ThreePhaseDrive { configuration: CONFIGURATION, scaling: SCALING };
/// 10 mOhm shunts; amplifiers with a gain of 5.18 and 1.71 V at zero current; supply divider of 9.31 and
/// 178.31 kOhm. Sources: `nucleo_g474re/ihm08m1.rs`.
const SCALING: Scaling = Scaling {
    a_per_count: -3.3 / 4095.0 / (0.01 * 5.7 * 6.8 / 7.48),
    zero_current_counts: 2122.0,
    zero_current_tolerance_counts: 200.0,
    v_per_count: 3.3 / 4095.0 * 178.31 / 9.31,
    temperature_c: THERMISTOR_C,
};

const LOWER: &str = "high until armed (active low); then 20 kHz";

pub(super) const GATES: PinGroup = PinGroup {
    title: "Gate drivers, 20 kHz, 0.8 us dead time: timer 1",
    pins: &[
        Pin::output("PA8", 6, "U, high", "CN10-23, D7").showing(HALF_BRIDGE),
        Pin::output("PA7", 6, "U, low, inverted", "CN10-15, D11").showing(LOWER),
        Pin::output("PA9", 6, "V, high", "CN10-21, D8").showing(HALF_BRIDGE),
        Pin::output("PB0", 6, "V, low, inverted", "CN7-34, A3").showing(LOWER),
        Pin::output("PA10", 6, "W, high", "CN10-33, D2").showing(HALF_BRIDGE),
        Pin::output("PB1", 6, "W, low, inverted", "CN10-24").showing(LOWER),
    ],
};

const CURRENT: &str = "about 1.71 V at zero current, -52 mV/A into the motor";

pub(super) const MEASURED: PinGroup = PinGroup {
    title: "Currents, supply, temperature",
    pins: &[
        Pin::analog("PA0", "shunt of U, amplified", "CN7-28, A0").noting("10 mOhm").showing(CURRENT),
        Pin::analog("PC1", "shunt of V, amplified", "CN7-36, A4").noting("10 mOhm").showing(CURRENT),
        Pin::analog("PC0", "shunt of W, amplified", "CN7-38, A5").noting("10 mOhm").showing(CURRENT),
        Pin::analog("PA1", "supply, divider of 169 and 9.31 kOhm", "CN7-30, A1").showing("1.25 V at 24 V"),
        Pin::analog("PC2", "temperature of the bridge", "CN7-35").showing("about 1.06 V at 25 degrees C"),
    ],
};

pub(super) const INCREMENTAL_ENCODER: PinGroup = PinGroup {
    title: "Incremental encoder, pull-ups on: timer 2",
    pins: &[
        Pin::input("PA15", 1, "A", "CN7-17; J3 of the shield").showing(QUADRATURE).by_configuration(),
        Pin::input("PB3", 1, "B", "CN10-31; J3 of the shield").showing(QUADRATURE).by_configuration(),
    ],
};

pub(super) const ABSOLUTE_ENCODER: PinGroup = PinGroup {
    title: "or an absolute encoder: an AS5047P or MT6701 on SPI 3, an AS5600 on I²C 4",
    pins: &[
        Pin::output("PC10", 6, "clock", "CN7-1").showing("bursts every 50 us").by_configuration(),
        Pin::input("PC11", 6, "encoder output", "CN7-2").noting("pull-up on").by_configuration(),
        Pin::output("PC12", 6, "encoder input", "CN7-3").noting("AS5047P only").by_configuration(),
        Pin::driven("PD2", "select", "CN7-4").showing("low while the clock runs").by_configuration(),
        Pin { direction: PinDirection::Both, ..Pin::input("PC6", 8, "I²C clock", "CN10-4") }
            .noting("2.2 kOhm to 3.3 V")
            .showing("bursts of 19 and 38 bits every 100 us")
            .by_configuration(),
        Pin { direction: PinDirection::Both, ..Pin::input("PC7", 8, "I²C data", "CN10-19") }
            .noting("2.2 kOhm to 3.3 V")
            .by_configuration(),
    ],
};
