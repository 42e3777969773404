//! What the manual forbids is told: each rule broken once, by register writes.

#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use chips::{Part, Stm32g4};
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{At, Bus as _, Reset};

const RCC: u32 = 0x4002_1000;
const PWR: u32 = 0x4000_7000;
const FLASH: u32 = 0x4002_2000;
const GPIOB: u32 = 0x4800_0400;
const TIM3: u32 = 0x4000_0400;
const IWDG: u32 = 0x4000_3000;

/// Of a crystal of 24 MHz: 168 MHz.
const PLL: u32 = 3 | 5 << 4 | 84 << 8 | 1 << 24;

/// A chip whose registers are written one after the other, a thousand cycles apart.
struct Bench {
    chip: Stm32g4,
    cycle: u64,
}

impl Bench {
    fn new() -> Self {
        Self { chip: Stm32g4::new(Part::G474re, &Image::default(), Some(24e6)), cycle: 0 }
    }

    fn wait(&mut self, cycles: u64) {
        self.cycle += cycles;
        self.chip.advance(self.cycle);
    }

    fn write(&mut self, address: u32, value: u32) {
        self.wait(1_000);
        let at = At { cycle: self.cycle, code: 0 };
        self.chip.store(address, Width::Word, value, at).unwrap();
    }

    fn read(&mut self, address: u32) -> u32 {
        self.chip.load(address, Width::Word, At { cycle: self.cycle, code: 0 }).unwrap()
    }

    fn told(&self) -> Vec<&str> {
        self.chip.violations().iter().map(|violation| violation.what.as_str()).collect()
    }

    /// The crystal and the PLL on, everything that 168 MHz wants but the switch.
    fn prepare(&mut self, boosts: bool, wait_states: u32) {
        self.write(RCC + 0x58, 1 << 28 | 0x400);
        self.write(RCC, 0x1_0500);
        self.wait(100_000);
        self.write(RCC + 0x0C, PLL);
        self.write(RCC, 0x101_0500);
        self.wait(10_000);
        if boosts {
            self.write(PWR + 0x80, 0);
        }
        self.write(FLASH, 0x4_0600 | wait_states);
    }

    /// To the PLL with the AHB divided, then undivided.
    fn switch(&mut self, pause_cycles: u64) {
        self.write(RCC + 0x08, 0x83);
        self.cycle += pause_cycles;
        let at = At { cycle: self.cycle, code: 0 };
        self.chip.store(RCC + 0x08, Width::Word, 0x03, at).unwrap();
    }
}

#[test]
fn the_switch_as_the_manual_has_it_breaks_no_rule() {
    let mut bench = Bench::new();
    bench.prepare(true, 4);
    bench.switch(168);
    assert_eq!(bench.told(), [] as [&str; 0]);
    assert!((bench.chip.clock().hz() - 168e6).abs() < 1.0);
}

#[test]
fn the_core_without_its_boost_is_told() {
    let mut bench = Bench::new();
    bench.prepare(false, 4);
    bench.switch(168);
    assert!(bench.told().contains(&"the processor runs at 168 MHz, and range 1 without boost allows 150"));
    // As a register crate has the bit: in another place.
    let mut bench = Bench::new();
    bench.prepare(false, 4);
    bench.write(PWR + 0x80, 0x101);
    assert_eq!(bench.told(), ["PWR_CR5 gets 0x00000101: bits 0x00000001 are reserved"]);
}

#[test]
fn a_clock_in_one_step_without_a_pause_or_without_wait_states_is_told() {
    let mut bench = Bench::new();
    bench.prepare(true, 4);
    bench.write(RCC + 0x08, 0x03);
    assert_eq!(bench.told(), ["the system clock goes to 168 MHz in one step: divide the AHB by 2 before"]);

    let mut bench = Bench::new();
    bench.prepare(true, 4);
    bench.switch(20);
    assert_eq!(
        bench.told(),
        ["the AHB stops dividing less than 1 us after the switch to a fast system clock"]
    );

    let mut bench = Bench::new();
    bench.prepare(true, 3);
    bench.switch(168);
    assert_eq!(bench.told(), ["flash with 3 wait states at 168 MHz in range 1 with boost, which needs 4"]);
}

#[test]
fn a_peripheral_without_a_clock_and_a_pin_without_a_use_are_told() {
    let mut bench = Bench::new();
    bench.write(TIM3, 1);
    assert_eq!(bench.told(), ["TIM3_CR1 is accessed without a clock"]);

    let mut bench = Bench::new();
    bench.write(RCC + 0x4C, 2);
    bench.write(GPIOB + 0x20, 5 << 24);
    bench.write(GPIOB, 0xFFFF_EEBF);
    assert_eq!(bench.told(), ["PB6 gets alternate function 5, which the board has no use for"]);
}

#[test]
fn the_watchdog_s_window_is_that_of_its_reset_until_it_was_fed() {
    // 10 ms: a prescaler of 4 and 80 counts of 32 kHz.
    let set_up = |feeds: bool| {
        let mut bench = Bench::new();
        bench.write(IWDG, 0x5555);
        bench.write(IWDG + 8, 79);
        bench.write(IWDG, 0xCCCC);
        if feeds {
            bench.write(IWDG, 0xAAAA);
        }
        let bites_in_s = |bench: &mut Bench, cycles: u64| {
            bench.wait(cycles);
            bench.chip.wants_reset(bench.cycle)
        };
        // At 16 MHz: 9 ms, 11 ms, 500 ms, 520 ms.
        [144_000, 32_000, 7_824_000, 320_000].map(|cycles| bites_in_s(&mut bench, cycles))
    };
    assert_eq!(set_up(true), [false, true, true, true]);
    assert_eq!(set_up(false), [false, false, false, true]);
}

#[test]
fn flash_takes_its_time_and_what_it_is_not_asked_rightly_is_told() {
    let mut bench = Bench::new();
    let word = 0x0804_0000;
    bench.write(word, 1);
    assert_eq!(bench.told(), ["flash at 0x08040000 is written without FLASH_CR.PG"]);
    bench.write(FLASH + 8, 0x4567_0123);
    bench.write(FLASH + 8, 0xCDEF_89AB);
    bench.write(FLASH + 0x10, 0xFFFF);
    bench.write(FLASH + 0x14, 1);
    bench.write(word, 0x1234_5678);
    bench.write(word + 4, 0x9ABC_DEF0);
    assert_eq!(bench.read(FLASH + 0x10) >> 16 & 1, 1, "busy");
    assert!(bench.chip.wait(word, bench.cycle) > 0);
    assert_eq!(bench.chip.wait(0x0800_0000, bench.cycle), 0, "the other bank is read meanwhile");
    bench.wait(16 * 82);
    assert_eq!(
        [bench.read(FLASH + 0x10), bench.read(word), bench.read(word + 4)],
        [0, 0x1234_5678, 0x9ABC_DEF0]
    );
    // Not erased.
    bench.write(word, 0);
    bench.write(word + 4, 1);
    bench.wait(2_000);
    assert_eq!(bench.read(FLASH + 0x10), 1 << 3);
    // The first page of the second bank.
    bench.write(FLASH + 0x10, 1 << 3);
    bench.write(FLASH + 0x14, 1 << 11 | 1 << 1 | 1 << 16);
    bench.wait(16 * 22_100);
    assert_eq!([bench.read(FLASH + 0x10), bench.read(word)], [0, u32::MAX]);
}

#[test]
fn a_reset_leaves_memory_and_says_why() {
    let mut bench = Bench::new();
    bench.write(0x2000_0000, 7);
    bench.write(RCC + 0x94, 1 << 23);
    let cycle = bench.cycle;
    bench.chip.reset(Reset::Chip, cycle);
    assert_eq!(bench.read(0x2000_0000), 7);
    assert_eq!(bench.read(RCC + 0x94) >> 24, 0x24, "the watchdog, and with it the pin");
    assert!((bench.chip.clock().hz() - 16e6).abs() < 1.0);
}
