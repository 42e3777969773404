//! Data of ST's NUCLEO-G474RE.

use dimsart_core::limits::Capacities;

use super::ihm08m1;
use super::pins::{DEBUG_PORT, HEARTBEATS, QUADRATURE, RECESSIVE};
use super::{CodeMemory, DEFAULT_GROUPS, Pin, PinGroup, PinPlan, SMALL_MOTORS, ToolData};
use crate::clock_switch;
#[cfg(all(target_os = "none", feature = "moteus"))]
use crate::moteus::Moteus;
use crate::motor::Motor;

/// The motor of every axis. Adjust it to the connected hardware with the data sheets of motor and supply.
pub(crate) const MOTOR: Motor = Motor {
    torque_constant_nm_per_a: 0.05,
    resistance_ohm: 1.0,
    max_current_a: 2.0,
    supply_v: 12.0,
    counts_per_turn: 4096,
    pole_pairs: 1,
};

/// The drives of the axes (feature `moteus`). Adjust them to the drives' `id.id`, `servo.max_current_A` and
/// `servo.max_velocity`.
#[cfg(all(target_os = "none", feature = "moteus"))]
pub(crate) const MOTEUS: Moteus<{ TOOLING.axes }> = Moteus {
    host: 0,
    ids: [1, 2, 3],
    timeout_s: 0.02,
    missing_ticks: 3,
    max_torque_nm: 1.0,
    max_speed_rad_per_s: 100.0,
}
.checked();

/// See [`ToolData`].
pub(crate) const TOOLING: ToolData = ToolData {
    clock_hz: clock_switch::CLOCK_HZ,
    tick_hz: 1_000,
    axes: 3,
    sizes: Capacities {
        modules: 32,
        wires: 240,
        bindings: 64,
        slots: 64,
        links: 2,
        programs: 4,
        words: 3_072,
    },
    memory: CodeMemory::Stm32G4,
    chip: Some("STM32G474RETx"),
    modules: &DEFAULT_GROUPS,
    variants: &["classic-can", "uart-link", "measure", "by-hand", "auth", "online", "moteus", "ihm08m1"],
    pins: PINS,
    interrupts: INTERRUPTS,
    motor: Some(MOTOR),
    drive: None,
    scheme: SMALL_MOTORS,
};

/// Connectors as in ST UM2505: CN7 and CN10 are the morpho connectors, `A0` and `D7` labels of the Arduino
/// connectors.
const PINS: &[PinPlan] = &[
    PinPlan {
        variants: &["", "classic-can", "measure", "by-hand", "auth", "online"],
        groups: &[ENCODERS, BRUSHED, COMMAND_LINE, CAN, DEBUG_PORT],
    },
    PinPlan { variants: &["uart-link"], groups: &[ENCODERS, BRUSHED, COMMAND_LINE, UART_LINK, DEBUG_PORT] },
    PinPlan { variants: &["moteus"], groups: &[COMMAND_LINE, CAN, UART_LINK, DEBUG_PORT] },
    PinPlan {
        variants: &["ihm08m1"],
        groups: &[
            ihm08m1::GATES,
            ihm08m1::MEASURED,
            ihm08m1::INCREMENTAL_ENCODER,
            ihm08m1::ABSOLUTE_ENCODER,
            COMMAND_LINE,
            CAN,
            DEBUG_PORT,
        ],
    },
];

const ENCODERS: PinGroup = PinGroup {
    title: "Encoders, pull-ups on",
    pins: &[
        Pin::input("PA0", 1, "axis 1: A", "CN7-28, A0").noting("timer 2").showing(QUADRATURE),
        Pin::input("PA1", 1, "axis 1: B", "CN7-30, A1").noting("timer 2").showing(QUADRATURE),
        Pin::input("PA6", 2, "axis 2: A", "CN10-13, D12").noting("timer 3").showing(QUADRATURE),
        Pin::input("PA7", 2, "axis 2: B", "CN10-15, D11").noting("timer 3").showing(QUADRATURE),
        Pin::input("PB6", 2, "axis 3: A", "CN10-17, D10").noting("timer 4").showing(QUADRATURE),
        Pin::input("PB7", 2, "axis 3: B", "CN7-21").noting("timer 4").showing(QUADRATURE),
    ],
};

const BRUSHED: PinGroup = PinGroup {
    title: "Motor drivers",
    pins: &[
        Pin::output("PA8", 6, "axis 1: PWM", "CN10-23, D7")
            .noting("20 kHz, timer 1")
            .showing("no pulses until armed; then 20 kHz, duty cycle proportional to torque"),
        Pin::output("PA9", 6, "axis 2: PWM", "CN10-21, D8")
            .noting("20 kHz, timer 1")
            .showing("no pulses until armed; then 20 kHz, duty cycle proportional to torque"),
        Pin::output("PA10", 6, "axis 3: PWM", "CN10-33, D2")
            .noting("20 kHz, timer 1")
            .showing("no pulses until armed; then 20 kHz, duty cycle proportional to torque"),
        Pin::driven("PC0", "axis 1: direction", "CN7-38, A5")
            .noting("high for positive torque")
            .showing("low until armed"),
        Pin::driven("PC1", "axis 2: direction", "CN7-36, A4")
            .noting("high for positive torque")
            .showing("low until armed"),
        Pin::driven("PC2", "axis 3: direction", "CN7-35")
            .noting("high for positive torque")
            .showing("low until armed"),
        Pin::driven("PC3", "enable of all drivers", "CN7-37")
            .noting("high when on; floats during reset: add a pull-down")
            .showing("low until armed, then high"),
    ],
};

const COMMAND_LINE: PinGroup = PinGroup {
    title: "Command line, 921 600 baud",
    pins: &[
        Pin::output("PA2", 12, "to the host", "ST-LINK's serial port").noting("LPUART 1").showing(HEARTBEATS),
        Pin::input("PA3", 12, "from the host", "ST-LINK's serial port")
            .noting("LPUART 1")
            .showing("high; bytes during requests"),
    ],
};

const CAN: PinGroup = PinGroup {
    title: "CAN, needs a transceiver",
    pins: &[
        Pin::input("PA11", 9, "CAN RX", "CN10-14")
            .noting("FDCAN 1")
            .showing("as CAN TX, and frames of other nodes; without a transceiver, high only with a pull-up"),
        Pin::output("PA12", 9, "CAN TX", "CN10-12").noting("FDCAN 1").showing(RECESSIVE),
    ],
};

const UART_LINK: PinGroup = PinGroup {
    title: "Link 0, 921 600 baud",
    pins: &[
        Pin::output("PC10", 7, "to the peer", "CN7-1")
            .noting("USART 3")
            .showing("high; packets while the scheme runs"),
        Pin::input("PC11", 7, "from the peer", "CN7-2")
            .noting("USART 3")
            .showing("high if the peer is connected"),
    ],
};

/// All variants together. `ADC1_2` needs a three-phase motor, `FDCAN1` a link over CAN, `USART3` and its DMA
/// a link over UART; moteus drives use FDCAN 1 without interrupts.
const INTERRUPTS: &[(&str, i16)] = &[
    // Current loop.
    ("ADC1_2", 0),
    // Time.
    ("TIM5", 1),
    // Tick.
    ("CORDIC", 2),
    // Command line.
    ("LPUART1", 4),
    ("DMA1_CHANNEL1", 4),
    ("DMA1_CHANNEL2", 4),
    // Link.
    ("FDCAN1_IT0", 4),
    ("FDCAN1_IT1", 4),
    ("USART3", 4),
    ("DMA1_CHANNEL3", 4),
    ("DMA1_CHANNEL4", 4),
    // Stored schemes.
    ("FLASH", 4),
    // Background.
    ("FMAC", 6),
];
