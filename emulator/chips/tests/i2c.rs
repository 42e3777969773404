//! I²C 4 and a device, tested by register writes.

#![expect(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    reason = "allowed in test helpers as in tests; small cycle counts"
)]

use chips::stm32g4::{I2cDevice, I2cEvent};
use chips::{ChipModel, Stm32g4};
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus as _};

const AHB1ENR: u32 = 0x4002_1048;
const AHB2ENR: u32 = 0x4002_104C;
const APB1ENR2: u32 = 0x4002_105C;
const GPIOC: u32 = 0x4800_0800;
const DMA1: u32 = 0x4002_0000;
const DMAMUX: u32 = 0x4002_0800;
const CR1: u32 = 0x4000_8400;
const CR2: u32 = CR1 + 4;
const TIMINGR: u32 = CR1 + 0x10;
const ISR: u32 = CR1 + 0x18;
const ICR: u32 = CR1 + 0x1C;
const RXDR: u32 = CR1 + 0x24;
const TXDR: u32 = CR1 + 0x28;

const ON: u32 = 1;
const RXDMAEN: u32 = 1 << 15;
/// At 16 MHz: clock low for 30 cycles, high for 20, data 16 cycles before the clock.
const TIMING: u32 = 15 << 20 | 19 << 8 | 29;
/// Including the detection of both edges: 4.16 cycles of the filter plus 2 cycles, each.
const BIT_CYCLES: f64 = 50.0 + 2.0 * (4.16 + 2.0);

const READ: u32 = 1 << 10;
const START: u32 = 1 << 13;
const AUTOEND: u32 = 1 << 25;

const TXE: u32 = 1;
const TXIS: u32 = 1 << 1;
const RXNE: u32 = 1 << 2;
const NACKF: u32 = 1 << 4;
const STOPF: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const BUSY: u32 = 1 << 15;

/// Sends bytes that count up from the last received byte, and does not acknowledge 0xFF.
const COUNTER: I2cDevice = I2cDevice {
    name: "counter",
    address: 0x36,
    max_clock_hz: 4e5,
    min_low_s: 1.3e-6,
    min_high_s: 0.6e-6,
    min_setup_s: 0.4e-6,
    state: [0; 4],
    on_event: |[next, ..], event| match event {
        I2cEvent::Started { .. } => 1,
        I2cEvent::Written { byte } => {
            *next = byte.into();
            u32::from(byte != 0xFF)
        }
        I2cEvent::Read => {
            *next += 1;
            *next - 1
        }
    },
};

struct Lab {
    chip: Stm32g4,
    cycle: u64,
}

impl Lab {
    /// I²C 4 with its clock and pins, and the device.
    fn new() -> Self {
        let mut lab = Self { chip: Stm32g4::new(ChipModel::G474re, &Image::default(), None), cycle: 0 };
        lab.chip.connect_i2c("I2C4", Some(COUNTER));
        lab.write(AHB1ENR, 0x105);
        lab.write(AHB2ENR, 0b100);
        lab.write(APB1ENR2, 1 << 1);
        lab.write(GPIOC + 4, 0b11 << 6);
        lab.write(GPIOC + 0x20, 0x8800_0000);
        // Pulled up.
        lab.write(GPIOC + 0x0C, 0b0101 << 12);
        lab.write(GPIOC, 0xFFFF_AFFF);
        lab
    }

    fn ready() -> Self {
        let mut lab = Self::new();
        lab.write(TIMINGR, TIMING);
        lab.write(CR1, ON);
        lab
    }

    fn wait(&mut self, cycles: u64) {
        self.cycle += cycles;
        self.chip.advance(self.cycle);
    }

    /// Waits for the duration of this number of bits, rounded down.
    fn wait_bits(&mut self, bits: f64) {
        self.wait((bits * BIT_CYCLES) as u64);
    }

    fn write(&mut self, address: u32, value: u32) {
        let at = AccessPoint { cycle: self.cycle, code: 0 };
        self.chip.store(address, Width::Word, value, at).unwrap();
    }

    fn read(&mut self, address: u32) -> u32 {
        self.chip.load(address, Width::Word, AccessPoint { cycle: self.cycle, code: 0 }).unwrap()
    }

    fn flags(&mut self) -> u32 {
        self.read(ISR)
    }

    fn start(&mut self, address: u32, bytes: u32, more: u32) {
        self.write(CR2, address << 1 | bytes << 16 | more | START);
    }

    fn violations(&self) -> Vec<&str> {
        self.chip.violations().iter().map(|violation| violation.description.as_str()).collect()
    }
}

#[test]
fn a_write_and_a_read_after_a_repeated_start_take_the_correct_time() {
    let mut lab = Lab::ready();
    assert_eq!(lab.flags(), TXE);
    lab.write(TXDR, 0x40);
    assert_eq!(lab.flags(), 0);
    lab.start(0x36, 1, 0);
    lab.wait_bits(18.4);
    assert_eq!(lab.flags() & (TC | BUSY), BUSY);
    lab.wait_bits(0.2);
    assert_eq!(lab.flags(), TXE | TC | BUSY);
    lab.start(0x36, 2, READ | AUTOEND);
    assert_eq!(lab.flags(), TXE | BUSY);
    lab.wait_bits(18.6);
    assert_eq!(lab.flags(), TXE | RXNE | BUSY);
    assert_eq!(lab.read(RXDR), 0x40);
    lab.wait_bits(9.0);
    assert_eq!(lab.flags(), TXE | RXNE | BUSY);
    lab.wait_bits(0.5);
    assert_eq!(lab.flags(), TXE | RXNE | STOPF);
    assert_eq!(lab.read(RXDR), 0x41);
    lab.write(ICR, STOPF);
    assert_eq!(lab.flags(), TXE);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn the_clock_is_held_low_while_a_byte_is_missing_or_unread() {
    let mut lab = Lab::ready();
    lab.start(0x36, 2, AUTOEND);
    lab.wait(100_000);
    assert_eq!(lab.flags(), TXE | TXIS | BUSY);
    lab.write(TXDR, 1);
    assert_eq!(lab.flags(), TXE | TXIS | BUSY, "the first byte is being sent");
    lab.write(TXDR, 2);
    assert_eq!(lab.flags(), BUSY);
    lab.wait_bits(18.6);
    assert_eq!(lab.flags(), TXE | STOPF);
    assert_eq!(lab.chip.i2c_device("I2C4").unwrap().state[0], 2);
    lab.write(ICR, STOPF);
    lab.start(0x36, 3, READ | AUTOEND);
    for byte in 2..5 {
        lab.wait(100_000);
        assert_eq!(lab.read(RXDR), byte);
    }
    lab.wait_bits(1.0);
    assert_eq!(lab.flags(), TXE | STOPF);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn the_dma_takes_received_bytes() {
    let mut lab = Lab::ready();
    lab.write(DMAMUX + 8, 22);
    lab.write(DMA1 + 0x34, 3);
    lab.write(DMA1 + 0x38, RXDR);
    lab.write(DMA1 + 0x3C, 0x2000_0100);
    lab.write(DMA1 + 0x30, 1 << 7 | 1);
    lab.write(CR1, ON | RXDMAEN);
    lab.start(0x36, 3, READ | AUTOEND);
    // The program reads no register.
    (0..40).for_each(|_| lab.wait_bits(1.0));
    assert_eq!(lab.flags(), TXE | STOPF);
    assert_eq!(lab.read(0x2000_0100) & 0xFF_FFFF, 0x02_0100);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn a_missing_acknowledge_ends_a_transfer_and_a_low_line_blocks_it() {
    let mut lab = Lab::ready();
    lab.start(0x37, 1, 0);
    lab.wait_bits(10.1);
    assert_eq!(lab.flags(), TXE | NACKF | STOPF);
    lab.write(ICR, NACKF | STOPF);
    lab.write(TXDR, 0xFF);
    lab.start(0x36, 2, 0);
    lab.wait_bits(19.1);
    assert_eq!(lab.flags(), TXE | NACKF | STOPF);
    // Without a device, then also without pull-ups.
    lab.write(ICR, NACKF | STOPF);
    lab.chip.connect_i2c("I2C4", None);
    lab.start(0x36, 1, 0);
    lab.wait(100_000);
    assert_eq!(lab.flags(), TXE | NACKF | STOPF);
    lab.write(ICR, NACKF | STOPF);
    lab.write(GPIOC + 0x0C, 0);
    lab.start(0x36, 1, 0);
    lab.wait(100_000);
    assert_eq!(lab.flags(), TXE);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn an_aborted_device_holds_the_data_line_until_nine_clock_pulses() {
    let mut lab = Lab::ready();
    lab.start(0x36, 3, READ | AUTOEND);
    lab.wait_bits(14.0);
    lab.write(CR1, 0);
    assert_eq!(lab.read(CR1), 0);
    lab.write(CR1, ON);
    lab.start(0x36, 3, READ | AUTOEND);
    lab.wait(100_000);
    assert_eq!(lab.flags(), TXE);
    for pulses in [8, 9] {
        lab.write(CR1, 0);
        lab.write(GPIOC, 0xFFFF_9FFF);
        for _ in 0..pulses {
            lab.write(GPIOC + 0x18, 1 << 22);
            lab.write(GPIOC + 0x18, 1 << 6);
        }
        lab.write(GPIOC, 0xFFFF_AFFF);
        lab.write(CR1, ON);
        lab.start(0x36, 1, READ | AUTOEND);
        lab.wait(100_000);
        assert_eq!(lab.flags() & RXNE == RXNE, pulses == 9);
    }
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn violations_of_peripheral_and_device_are_reported() {
    let violations = |timing: u32, act: &dyn Fn(&mut Lab)| {
        let mut lab = Lab::new();
        lab.write(TIMINGR, timing);
        lab.write(CR1, ON);
        act(&mut lab);
        lab.wait(10_000);
        lab.violations().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    type Act<'a> = &'a dyn Fn(&mut Lab);
    let rules: [(&str, Act<'_>); 10] = [
        ("I2C4_CR1 is accessed while its clock is off", &|lab| {
            lab.write(APB1ENR2, 0);
            lab.write(CR1, ON);
        }),
        ("I2C4_TIMINGR is written while the I²C is on", &|lab| lab.write(TIMINGR, TIMING)),
        ("the filters of I2C4 are changed while it is on", &|lab| lab.write(CR1, ON | 1 << 8)),
        ("I2C4_CR1 is set to 0x00000041: not modelled", &|lab| lab.write(CR1, ON | 1 << 6)),
        ("I2C4_CR2 is changed while a START is pending", &|lab| {
            lab.start(0x36, 1, READ);
            lab.write(CR2, 0);
        }),
        ("I2C4 is started during a transfer", &|lab| {
            lab.start(0x36, 1, 0);
            lab.wait(10_000);
            lab.start(0x36, 1, 0);
        }),
        ("I2C4 is started or stopped while it is off", &|lab| {
            lab.write(CR1, 0);
            lab.start(0x36, 1, 0);
        }),
        ("I2C4_TXDR is written while it is full", &|lab| (0..2).for_each(|byte| lab.write(TXDR, byte))),
        ("I2C4_RXDR is read while it is empty", &|lab| {
            lab.read(RXDR);
        }),
        ("a pin of I2C4 is not open-drain", &|lab| lab.write(GPIOC + 4, 1 << 6)),
    ];
    for (rule, act) in rules {
        assert_eq!(violations(TIMING, act), [rule]);
    }
    let start = |lab: &mut Lab| lab.start(0x36, 1, 0);
    let cases = [
        (TIMING - 10, vec!["counter: clock low time is 1250 ns, but must be at least 1300 ns"]),
        (TIMING - (12 << 8), vec!["counter: clock high time is 500 ns, but must be at least 600 ns"]),
        (TIMING - (10 << 20), vec!["counter: data setup time is 375 ns, but must be at least 400 ns"]),
        (
            TIMING - (10 << 8) - 10,
            vec![
                "counter is clocked at 449 kHz, but allows at most 400 kHz",
                "counter: clock low time is 1250 ns, but must be at least 1300 ns",
            ],
        ),
    ];
    for (timing, expected) in cases {
        assert_eq!(violations(timing, &start), expected);
    }
}
