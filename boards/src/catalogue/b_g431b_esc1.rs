//! Data of ST's B-G431B-ESC1.

use dimsart_core::limits::Capacities;
use drive::{Configuration, Encoder, Inverter, Joint, Limits};

use super::pins::{DEBUG_PORT, HEARTBEATS, QUADRATURE, RECESSIVE};
use super::{CodeMemory, Pin, PinDirection, PinGroup, PinPlan, SMALL_MOTORS, ThreePhaseDrive, ToolData};
use crate::clock_switch;
use crate::current_loop::Scaling;
use crate::motor::Motor;

/// Motor, encoder and limits. Adjust them to the connected hardware with the data sheets of motor and supply.
pub(super) const CONFIGURATION: Configuration = Configuration {
    motor: drive::Motor {
        resistance_ohm: 0.6,
        direct_inductance_h: 2.5e-4,
        quadrature_inductance_h: 2.5e-4,
        // 0.05 N·m/A.
        flux_linkage_vs: 0.05 / (1.5 * 7.0),
        pole_pairs: 7,
        is_encoder_reversed: false,
        // An incremental encoder is aligned after every start.
        encoder_offset_rad: 0.0,
    },
    limits: Limits {
        current_a: 5.0,
        trip_current_a: 10.0,
        min_bus_v: 8.0,
        max_bus_v: 28.0,
        derating_c: 80.0,
        trip_c: 100.0,
        speed_rad_per_s: 400.0,
        stall_s: 20.0,
    },
    bandwidth_rad_per_s: 6_283.0,
    aligning_current_a: 2.0,
    encoder: Encoder::Incremental { counts_per_turn: 4096 },
    joint: Joint { gear_ratio: 1.0, zero_rad: 0.0 },
    inverter: Inverter {
        period_s: 50e-6,
        // 0.8 us.
        dead_time_share: 0.016,
        dead_time_current_a: 0.3,
        // The lower switches must be on for 1.7 us before the phases are sampled: the amplifiers settle in
        // 1.3 us.
        max_duty: 0.9,
    },
};
/// Motor, encoder and scaling.
pub(crate) const DRIVE: ThreePhaseDrive = ThreePhaseDrive { configuration: CONFIGURATION, scaling: SCALING };
/// From the board's schematic (ST UM2516) and public firmware for the board: 3 mOhm shunts, gain 64/7
/// including the resistors, offset 0.129 V at the amplifier's input; supply divider of 18 and 187 kOhm;
/// thermistor of 10 kOhm (B 3425 K) above 4.7 kOhm; reference 3.3 V.
const SCALING: Scaling = Scaling {
    a_per_count: -3.3 / 4095.0 / (0.003 * 64.0 / 7.0),
    zero_current_counts: 2553.0,
    zero_current_tolerance_counts: 200.0,
    v_per_count: 3.3 / 4095.0 * 187.0 / 18.0,
    temperature_c: THERMISTOR_C,
};

/// Thermistor of 10 kOhm (B 3425 K) above 4.7 kOhm, at every 128th count.
pub(crate) const THERMISTOR_C: &[f32; 33] = &[
    -60.0, -31.4, -18.3, -9.7, -3.0, 2.6, 7.6, 12.1, 16.3, 20.3, 24.1, 27.8, 31.5, 35.1, 38.7, 42.3, 46.0,
    49.8, 53.6, 57.7, 61.9, 66.5, 71.3, 76.6, 82.4, 89.0, 96.5, 105.5, 116.7, 131.6, 153.9, 196.6, 300.0,
];

/// The motor for schemes.
pub(crate) const MOTOR: Motor = Motor {
    torque_constant_nm_per_a: CONFIGURATION.motor.torque_constant_nm_per_a(),
    resistance_ohm: CONFIGURATION.motor.resistance_ohm,
    max_current_a: CONFIGURATION.limits.current_a,
    supply_v: 12.0,
    counts_per_turn: 4096,
    pole_pairs: CONFIGURATION.motor.pole_pairs,
};
const _: () = assert!(MOTOR.counts_per_turn as u32 == CONFIGURATION.encoder.counts_per_turn());

/// See [`ToolData`].
pub(crate) const TOOLING: ToolData = ToolData {
    clock_hz: clock_switch::CLOCK_HZ,
    tick_hz: 1_000,
    axes: 1,
    // Half of the other boards' capacity: less memory, and one joint.
    sizes: Capacities { modules: 16, wires: 120, bindings: 32, slots: 48, links: 1, programs: 2, words: 480 },
    memory: CodeMemory::Stm32G4,
    chip: Some("STM32G431CBUx"),
    modules: &["control", "teleoperation"],
    variants: &[],
    pins: &[PinPlan {
        variants: &[""],
        groups: &[HALF_BRIDGES, MEASURED, ENCODER, COMMAND_LINE, CAN, DEBUG_PORT],
    }],
    interrupts: INTERRUPTS,
    motor: Some(MOTOR),
    drive: Some(DRIVE),
    scheme: SMALL_MOTORS,
};

/// Connected on the board (schematic in ST UM2516).
const ON_BOARD: &str = "on the board";

pub(super) const HALF_BRIDGE: &str = "no pulses until armed; then 20 kHz, high and low with 0.8 us dead time";

const HALF_BRIDGES: PinGroup = PinGroup {
    title: "Half bridges, 20 kHz, 0.8 us dead time: timer 1",
    pins: &[
        Pin::output("PA8", 6, "U, high", ON_BOARD).showing(HALF_BRIDGE),
        Pin::output("PC13", 4, "U, low", ON_BOARD).showing(HALF_BRIDGE),
        Pin::output("PA9", 6, "V, high", ON_BOARD).showing(HALF_BRIDGE),
        Pin::output("PA12", 6, "V, low", ON_BOARD).showing(HALF_BRIDGE),
        Pin::output("PA10", 6, "W, high", ON_BOARD).showing(HALF_BRIDGE),
        Pin::output("PB15", 4, "W, low", ON_BOARD).showing(HALF_BRIDGE),
    ],
};

const CURRENT: &str = "about 2.06 V at zero current, -27 mV/A into the motor";

const MEASURED: PinGroup = PinGroup {
    title: "Currents, supply, temperature",
    pins: &[
        Pin::analog("PA1", "shunt of U", ON_BOARD).noting("3 mOhm, amplifier 1"),
        Pin::analog("PA3", "shunt of U, other end", ON_BOARD),
        Pin {
            direction: PinDirection::Out,
            ..Pin::analog("PA2", "shunt of U, amplified", ON_BOARD).showing(CURRENT)
        },
        Pin::analog("PA7", "shunt of V", ON_BOARD).noting("3 mOhm, amplifier 2"),
        Pin::analog("PA5", "shunt of V, other end", ON_BOARD),
        Pin {
            direction: PinDirection::Out,
            ..Pin::analog("PA6", "shunt of V, amplified", ON_BOARD).showing(CURRENT)
        },
        Pin::analog("PB0", "shunt of W", ON_BOARD).noting("3 mOhm, amplifier 3"),
        Pin::analog("PB2", "shunt of W, other end", ON_BOARD),
        Pin {
            direction: PinDirection::Out,
            ..Pin::analog("PB1", "shunt of W, amplified", ON_BOARD).showing(CURRENT)
        },
        Pin::analog("PA0", "supply", ON_BOARD)
            .noting("divider, 18 of 187 kOhm")
            .showing("0.0963 V per volt of supply: 1.16 V at 12 V"),
        Pin::analog("PB14", "temperature of the bridge", ON_BOARD)
            .noting("thermistor")
            .showing("1.06 V at 25 °C, rising with temperature"),
    ],
};

const ENCODER: PinGroup = PinGroup {
    title: "Encoder, pull-ups on: timer 4",
    pins: &[
        Pin::input("PB6", 2, "encoder A", "pad A+/H1").showing(QUADRATURE),
        Pin::input("PB7", 2, "encoder B", "pad B+/H2").showing(QUADRATURE),
    ],
};

const COMMAND_LINE: PinGroup = PinGroup {
    title: "Command line, 921 600 baud: USART 2",
    pins: &[
        Pin::output("PB3", 7, "to the host", "ST-LINK's serial port, J3").showing(HEARTBEATS),
        Pin::input("PB4", 7, "from the host", "ST-LINK's serial port, J3")
            .showing("high; bytes during requests"),
    ],
};

const CAN: PinGroup = PinGroup {
    title: "CAN FD, 1 Mbit/s nominal and data",
    pins: &[
        Pin::input("PA11", 9, "CAN RX", "CANH and CANL after the transceiver")
            .noting("FDCAN 1")
            .showing("as CAN TX, and frames of other nodes"),
        Pin::output("PB9", 9, "CAN TX", "CANH and CANL after the transceiver")
            .noting("FDCAN 1")
            .showing(RECESSIVE),
        Pin::driven("PC11", "transceiver's shutdown", ON_BOARD).noting("low when on").showing("low"),
        Pin::driven("PC14", "120 ohm termination", ON_BOARD)
            .noting("high when on, see `IS_TERMINATED`")
            .showing("high"),
    ],
};

const INTERRUPTS: &[(&str, i16)] = &[
    // Current loop.
    ("ADC1_2", 0),
    // Time.
    ("TIM3", 1),
    // Tick.
    ("CORDIC", 2),
    // Command line.
    ("USART2", 4),
    ("DMA1_CHANNEL1", 4),
    ("DMA1_CHANNEL2", 4),
    // Link.
    ("FDCAN1_IT0", 4),
    ("FDCAN1_IT1", 4),
    // Stored schemes.
    ("FLASH", 4),
    // Background.
    ("FMAC", 6),
];
