//! Timer 1's outputs with a gate driver: a short-circuited bridge, or a closed switch while the bridge is
//! off, is a violation.

#![expect(clippy::unwrap_used, reason = "allowed in test helpers as in tests")]

use chips::stm32g4::GateDriver;
use chips::{ChipModel, Stm32g4};
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus as _};

const TIM1: u32 = 0x4001_2C00;
const CR1: u32 = TIM1;
const CR2: u32 = TIM1 + 0x04;
const CCMR1: u32 = TIM1 + 0x18;
const CCER: u32 = TIM1 + 0x20;
const ARR: u32 = TIM1 + 0x2C;
const BDTR: u32 = TIM1 + 0x44;

/// Channel 1 and its complementary output on; inverted complementary output.
const BOTH: u32 = 0b101;
const INVERTED: u32 = 0b1000;
/// Complementary output high while the main output is off.
const IDLE_HIGH: u32 = 1 << 9;
const OSSI: u32 = 1 << 10;
const MOE: u32 = 1 << 15;
const SHORT: &str = "half bridge 1 of TIM1: both switches are closed at once";
const CLOSED: &str = "half bridge 1 of TIM1: a switch is closed while the bridge is off";

/// Violations of a chip whose first half bridge is connected to PA8 and PA7.
fn violations(is_low_side_inverted: bool, outputs: u32, idle: u32, switch: u32) -> Vec<String> {
    let mut chip = Stm32g4::new(ChipModel::G474re, &Image::default(), None);
    chip.set_gate_driver(GateDriver { is_low_side_inverted });
    let mut cycle = 0;
    let mut write = |address, value| {
        cycle += 100;
        chip.advance(cycle);
        chip.store(address, Width::Word, value, AccessPoint { cycle, code: 0 }).unwrap();
    };
    write(0x4002_104C, 1);
    write(0x4002_1060, 1 << 11);
    write(0x4800_0020, 6 << 28);
    write(0x4800_0024, 6);
    write(0x4800_0000, 0xABFE_BFFF);
    write(CR2, idle);
    write(ARR, 4_200);
    write(CCMR1, 0x68);
    write(BDTR, OSSI | 0x83);
    write(CCER, outputs);
    write(CR1, 1 << 5 | 1);
    write(BDTR, OSSI | 0x83 | switch);
    chip.violations().iter().map(|violation| violation.description.clone()).collect()
}

#[test]
fn an_inverted_low_side_needs_inverted_outputs_and_a_high_idle_level() {
    for switch in [0, MOE] {
        assert_eq!(violations(true, BOTH | INVERTED, IDLE_HIGH, switch), [] as [&str; 0]);
        assert_eq!(violations(false, BOTH, 0, switch), [] as [&str; 0]);
    }
}

#[test]
fn outputs_of_the_wrong_polarity_are_violations() {
    // The upper switch is closed while the lower switch's input is low: both are closed.
    assert_eq!(violations(true, BOTH, IDLE_HIGH, MOE).last().unwrap(), SHORT);
    assert_eq!(violations(false, BOTH | INVERTED, 0, MOE).last().unwrap(), SHORT);
}

#[test]
fn idle_levels_that_close_switches_are_violations() {
    const UPPER_IDLE_HIGH: u32 = 1 << 8;
    assert_eq!(violations(true, BOTH | INVERTED, UPPER_IDLE_HIGH, 0), [SHORT]);
    assert_eq!(violations(false, BOTH, UPPER_IDLE_HIGH | IDLE_HIGH, 0), [SHORT]);
    // The lower switch alone is closed, which brakes.
    assert_eq!(violations(true, BOTH | INVERTED, 0, 0), [CLOSED]);
    assert_eq!(violations(false, BOTH, IDLE_HIGH, 0), [CLOSED]);
}
