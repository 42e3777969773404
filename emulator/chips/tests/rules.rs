//! Violations of the reference manual are reported: each rule is broken once by register writes.

#![expect(clippy::unwrap_used, reason = "allowed in test helpers as in tests")]

use chips::{ChipModel, Stm32g4};
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus as _, Reset};

const RCC: u32 = 0x4002_1000;
const PWR: u32 = 0x4000_7000;
const FLASH: u32 = 0x4002_2000;
const GPIOB: u32 = 0x4800_0400;
const TIM3: u32 = 0x4000_0400;
const IWDG: u32 = 0x4000_3000;

/// 168 MHz from a crystal of 24 MHz.
const PLL: u32 = 3 | 5 << 4 | 84 << 8 | 1 << 24;

/// A chip with register writes at intervals of 1000 cycles.
struct Bench {
    chip: Stm32g4,
    cycle: u64,
}

impl Bench {
    fn new() -> Self {
        Self { chip: Stm32g4::new(ChipModel::G474re, &Image::default(), Some(24e6)), cycle: 0 }
    }

    fn wait(&mut self, cycles: u64) {
        self.cycle += cycles;
        self.chip.advance(self.cycle);
    }

    fn write(&mut self, address: u32, value: u32) {
        self.wait(1_000);
        let at = AccessPoint { cycle: self.cycle, code: 0 };
        self.chip.store(address, Width::Word, value, at).unwrap();
    }

    fn read(&mut self, address: u32) -> u32 {
        self.chip.load(address, Width::Word, AccessPoint { cycle: self.cycle, code: 0 }).unwrap()
    }

    fn violations(&self) -> Vec<&str> {
        self.chip.violations().iter().map(|violation| violation.description.as_str()).collect()
    }

    /// Enables the crystal and the PLL: everything that 168 MHz requires before the switch.
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

    /// Switches to the PLL with a divided AHB, then ends the division.
    fn switch(&mut self, pause_cycles: u64) {
        self.write(RCC + 0x08, 0x83);
        self.cycle += pause_cycles;
        let at = AccessPoint { cycle: self.cycle, code: 0 };
        self.chip.store(RCC + 0x08, Width::Word, 0x03, at).unwrap();
    }
}

#[test]
fn a_clock_switch_as_in_the_manual_breaks_no_rule() {
    let mut bench = Bench::new();
    bench.prepare(true, 4);
    bench.switch(168);
    assert_eq!(bench.violations(), [] as [&str; 0]);
    assert!((bench.chip.clock().hz() - 168e6).abs() < 1.0);
}

#[test]
fn a_missing_core_voltage_boost_is_a_violation() {
    let mut bench = Bench::new();
    bench.prepare(false, 4);
    bench.switch(168);
    assert!(bench.violations().contains(
        &"the processor runs at 168 MHz, but voltage range 1 without boost allows at most 150 MHz"
    ));
    // The bit position of a register crate, which is wrong.
    let mut bench = Bench::new();
    bench.prepare(false, 4);
    bench.write(PWR + 0x80, 0x101);
    assert_eq!(bench.violations(), ["PWR_CR5 is set to 0x00000101: bits 0x00000001 are reserved"]);
}

#[test]
fn a_clock_switch_without_steps_pause_or_wait_states_is_a_violation() {
    let mut bench = Bench::new();
    bench.prepare(true, 4);
    bench.write(RCC + 0x08, 0x03);
    assert_eq!(
        bench.violations(),
        ["the system clock switches to 168 MHz in one step: divide the AHB by 2 first"]
    );

    let mut bench = Bench::new();
    bench.prepare(true, 4);
    bench.switch(20);
    assert_eq!(
        bench.violations(),
        ["the AHB division ends less than 1 us after the switch to a fast system clock"]
    );

    let mut bench = Bench::new();
    bench.prepare(true, 3);
    bench.switch(168);
    assert_eq!(
        bench.violations(),
        ["flash has 3 wait states, but 168 MHz in voltage range 1 with boost needs 4"]
    );
}

#[test]
fn a_peripheral_without_a_clock_and_an_unused_pin_function_are_violations() {
    let mut bench = Bench::new();
    bench.write(TIM3, 1);
    assert_eq!(bench.violations(), ["TIM3_CR1 is accessed while its clock is off"]);

    let mut bench = Bench::new();
    bench.write(RCC + 0x4C, 2);
    bench.write(GPIOB + 0x20, 5 << 24);
    bench.write(GPIOB, 0xFFFF_EEBF);
    assert_eq!(bench.violations(), ["PB6 is set to alternate function 5, which the board does not use"]);
}

#[test]
fn the_watchdog_s_timeout_is_its_reset_value_until_the_first_feed() {
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
fn flash_operations_take_time_and_incorrect_writes_are_reported() {
    let mut bench = Bench::new();
    let word = 0x0804_0000;
    bench.write(word, 1);
    assert_eq!(
        bench.violations(),
        ["flash at 0x08040000 is written while FLASH_CR.PG is 0 or FLASH_CR is locked"]
    );
    bench.write(FLASH + 8, 0x4567_0123);
    bench.write(FLASH + 8, 0xCDEF_89AB);
    bench.write(FLASH + 0x10, 0xFFFF);
    bench.write(FLASH + 0x14, 1);
    bench.write(word, 0x1234_5678);
    bench.write(word + 4, 0x9ABC_DEF0);
    assert_eq!(bench.read(FLASH + 0x10) >> 16 & 1, 1, "busy");
    assert!(bench.chip.wait(word, bench.cycle) > 0);
    assert_eq!(bench.chip.wait(0x0800_0000, bench.cycle), 0, "the other bank can be read meanwhile");
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
fn a_reset_keeps_memory_and_sets_the_flags_of_its_cause() {
    let mut bench = Bench::new();
    bench.write(0x2000_0000, 7);
    bench.write(RCC + 0x94, 1 << 23);
    let cycle = bench.cycle;
    bench.chip.reset(Reset::Chip, cycle);
    assert_eq!(bench.read(0x2000_0000), 7);
    assert_eq!(bench.read(RCC + 0x94) >> 24, 0x24, "watchdog and pin");
    assert!((bench.chip.clock().hz() - 16e6).abs() < 1.0);
}
