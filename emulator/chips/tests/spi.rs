//! SPI 3 and a device, tested by register writes.

#![expect(clippy::unwrap_used, reason = "allowed in test helpers as in tests")]

use chips::stm32g4::{SpiDevice, SpiEvent};
use chips::{ChipModel, Stm32g4};
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus as _};

const AHB2ENR: u32 = 0x4002_104C;
const APB1ENR1: u32 = 0x4002_1058;
const GPIOC: u32 = 0x4800_0800;
const GPIOD: u32 = 0x4800_0C00;
const CR1: u32 = 0x4000_3C00;
const CR2: u32 = CR1 + 4;
const SR: u32 = CR1 + 8;
const DR: u32 = CR1 + 12;

/// Master (MSTR, SSM, SSI), mode 1, a quarter of 16 MHz.
const MODE_1: u32 = 1 << 9 | 1 << 8 | 1 << 3 | 1 << 2 | 1;
const ON: u32 = 1 << 6;
const FRAME_16: u32 = 15 << 8;
const FRAME_12: u32 = 11 << 8;

const RXNE: u32 = 1;
const TXE: u32 = 1 << 1;
const OVR: u32 = 1 << 6;
const BSY: u32 = 1 << 7;
/// Cycles of a frame of 16 bits.
const FRAME_CYCLES: u64 = 64;

/// Sends the content of the previous frame, and counts its selects.
const ECHO: SpiDevice = SpiDevice {
    name: "echo",
    mode: 1,
    max_clock_hz: 5e6,
    min_select_s: 1e-6,
    min_release_s: 1e-6,
    state: [0xABCD, 0, 0, 0],
    on_event: |state, event| match event {
        SpiEvent::Frame { sent, .. } => std::mem::replace(&mut state[0], sent),
        SpiEvent::Selected => {
            state[1] += 1;
            0
        }
        SpiEvent::Released => 0,
    },
};

struct Lab {
    chip: Stm32g4,
    cycle: u64,
}

impl Lab {
    /// SPI 3 with its clock and pins, and a device that PD2 selects.
    fn new() -> Self {
        let mut lab = Self { chip: Stm32g4::new(ChipModel::G474re, &Image::default(), None), cycle: 0 };
        lab.chip.connect_spi("SPI3", ('D', 2), Some(ECHO));
        lab.write(AHB2ENR, 0b1100);
        lab.write(APB1ENR1, 1 << 15 | 0x400);
        lab.write(GPIOC + 0x24, 0x6_6600);
        lab.write(GPIOC, 0xFEAF_FFFF);
        // PC11 is pulled up.
        lab.write(GPIOC + 0x0C, 1 << 22);
        lab.write(GPIOD + 0x18, 1 << 2);
        lab.write(GPIOD, 0xFFFF_FFDF);
        lab
    }

    fn ready(frame: u32) -> Self {
        let mut lab = Self::new();
        lab.write(CR2, frame);
        lab.write(CR1, MODE_1);
        lab.write(CR1, MODE_1 | ON);
        lab
    }

    fn wait(&mut self, cycles: u64) {
        self.cycle += cycles;
        self.chip.advance(self.cycle);
    }

    fn access(&mut self, address: u32, value: u32, width: Width) {
        let at = AccessPoint { cycle: self.cycle, code: 0 };
        self.chip.store(address, width, value, at).unwrap();
    }

    fn write(&mut self, address: u32, value: u32) {
        self.wait(100);
        self.access(address, value, Width::Word);
    }

    fn send(&mut self, frame: u32) {
        self.access(DR, frame, Width::Half);
    }

    fn read(&mut self, address: u32, width: Width) -> u32 {
        self.chip.load(address, width, AccessPoint { cycle: self.cycle, code: 0 }).unwrap()
    }

    fn flags(&mut self) -> u32 {
        self.read(SR, Width::Word)
    }

    fn select(&mut self, is_selected: bool) {
        self.write(GPIOD + 0x18, if is_selected { 1 << 18 } else { 1 << 2 });
        self.wait(20);
    }

    fn violations(&self) -> Vec<&str> {
        self.chip.violations().iter().map(|violation| violation.description.as_str()).collect()
    }
}

#[test]
fn frames_take_the_correct_time_and_transfer_both_ways() {
    let mut lab = Lab::ready(FRAME_16);
    lab.select(true);
    assert_eq!(lab.flags() & (RXNE | TXE | BSY), TXE);
    lab.send(0x1234);
    assert_eq!(lab.flags() & (RXNE | BSY), BSY);
    lab.wait(FRAME_CYCLES - 1);
    assert_eq!(lab.flags() & (RXNE | BSY), BSY, "the last bit is still in transfer");
    lab.wait(1);
    assert_eq!(lab.flags() & (RXNE | BSY), RXNE);
    assert_eq!(lab.read(DR, Width::Half), 0xABCD);
    assert_eq!(lab.flags() & (RXNE | OVR), 0);
    // Two frames of 12 bits in the FIFO.
    let mut lab = Lab::ready(FRAME_12);
    lab.select(true);
    lab.send(0x123);
    lab.send(0x456);
    lab.wait(2 * 48);
    assert_eq!([lab.read(DR, Width::Half), lab.read(DR, Width::Half)], [0xBCD, 0x123]);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn an_undriven_line_has_the_level_of_its_pull_resistor() {
    let mut lab = Lab::ready(FRAME_16);
    lab.send(0x1234);
    lab.wait(FRAME_CYCLES);
    assert_eq!(lab.read(DR, Width::Half), 0xFFFF, "the device is not selected");
    lab.chip.connect_spi("SPI3", ('D', 2), None);
    lab.select(true);
    lab.write(GPIOC + 0x0C, 0);
    lab.send(0x1234);
    lab.wait(FRAME_CYCLES);
    assert_eq!(lab.read(DR, Width::Half), 0);
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn unread_frames_cause_an_overrun() {
    let mut lab = Lab::ready(FRAME_16);
    lab.select(true);
    for frame in 0..3 {
        lab.send(frame);
        lab.wait(FRAME_CYCLES);
    }
    assert_eq!(lab.flags() & OVR, OVR);
    assert_eq!(
        [lab.read(DR, Width::Half), lab.read(DR, Width::Half)],
        [0xABCD, 0],
        "the third frame is lost"
    );
    lab.flags();
    assert_eq!(lab.flags() & OVR, 0, "cleared by reading data and then flags");
    assert_eq!(lab.violations(), [] as [&str; 0]);
}

#[test]
fn violations_of_the_spi_are_reported() {
    let violations = |act: &dyn Fn(&mut Lab)| {
        let mut lab = Lab::ready(FRAME_16);
        act(&mut lab);
        lab.violations().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    type Act<'a> = &'a dyn Fn(&mut Lab);
    let rules: [(&str, Act<'_>); 8] = [
        ("SPI3_CR1 is accessed while its clock is off", &|lab| {
            lab.write(APB1ENR1, 0x400);
            lab.write(CR1, MODE_1 | ON);
        }),
        ("SPI3_CR1 is changed while the SPI is on", &|lab| lab.write(CR1, MODE_1 | ON | 1 << 5)),
        ("the frame size of SPI3 is changed while the SPI is on", &|lab| lab.write(CR2, FRAME_12)),
        ("SPI3_DR is written while the SPI is off", &|lab| {
            lab.write(CR1, MODE_1);
            lab.send(1);
        }),
        ("SPI3_DR is written while its TX FIFO is full", &|lab| (0..4).for_each(|frame| lab.send(frame))),
        ("SPI3_DR is read while its RX FIFO is empty", &|lab| {
            lab.read(DR, Width::Half);
        }),
        ("SPI3 is switched off during a frame", &|lab| {
            lab.send(1);
            lab.access(CR1, MODE_1, Width::Word);
        }),
        ("SPI3_DR is accessed with a width other than the frame width", &|lab| {
            lab.access(DR, 1, Width::Byte)
        }),
    ];
    for (rule, act) in rules {
        assert_eq!(violations(act), [rule]);
    }
    let reserved = violations(&|lab| lab.write(CR2, FRAME_16 | 1 << 15));
    assert_eq!(reserved, ["SPI3_CR2 is set to 0x00008f00: bits 0x00008000 are reserved"]);
}

#[test]
fn violations_of_the_device_are_reported() {
    let violations = |control: u32, act: &dyn Fn(&mut Lab)| {
        let mut lab = Lab::new();
        lab.write(CR2, FRAME_16);
        lab.write(CR1, control);
        lab.write(CR1, control | ON);
        act(&mut lab);
        lab.wait(1_000);
        lab.violations().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    let send = |lab: &mut Lab| {
        lab.select(true);
        lab.send(1);
    };
    assert_eq!(
        violations(MODE_1 & !(1 << 3), &send),
        ["echo is clocked at 8.0 MHz, but allows at most 5.0 MHz"]
    );
    assert_eq!(violations(MODE_1 & !1, &send), ["echo is clocked in mode 0, but requires mode 1"]);
    let early = violations(MODE_1, &|lab| {
        lab.access(GPIOD + 0x18, 1 << 18, Width::Word);
        lab.send(1);
    });
    assert_eq!(early, ["echo is clocked less than 1000 ns after its select"]);
    let cut = violations(MODE_1, &|lab| {
        send(lab);
        lab.access(GPIOD + 0x18, 1 << 2, Width::Word);
    });
    assert_eq!(cut, ["echo is selected or released during a frame"]);
    let again = violations(MODE_1, &|lab| {
        lab.select(true);
        lab.access(GPIOD + 0x18, 1 << 2, Width::Word);
        lab.access(GPIOD + 0x18, 1 << 18, Width::Word);
    });
    assert_eq!(again, ["echo is selected less than 1000 ns after its release"]);
}
