//! Tests the switch on a model of the chip that detects violations of RM0440.

use std::vec::Vec;

use super::{CAN_4_MBIT_CLOCK_HZ, CAN_5_MBIT_CLOCK_HZ, Register, Registers, switch_clock};

/// A model of an STM32G4 after reset, running from its crystal. Written from ST's header and RM0440, with its
/// own bit numbers.
struct Chip {
    crystal_hz: u64,
    registers: [u32; 5],
    /// Picoseconds since the system clock was switched.
    since_switch_ps: u64,
    violations: Vec<&'static str>,
    writes: Vec<(Register, u32)>,
}

/// In the order of [`Register`].
const RESET: [u32; 5] = [0x0003_0500, 0x0000_1000, 0x0000_000A, 0x0000_0100, 0x0004_0600];

impl Chip {
    fn new(crystal_hz: u64) -> Self {
        Self {
            crystal_hz,
            registers: RESET,
            since_switch_ps: u64::MAX,
            violations: Vec::new(),
            writes: Vec::new(),
        }
    }

    fn field(&self, register: Register, begin: u32, bits: u32) -> u64 {
        let value = self.registers[register as usize] >> begin & ((1 << bits) - 1);
        u64::from(value)
    }

    fn pll_hz(&self) -> u64 {
        let field = |begin, bits| self.field(Register::PllConfiguration, begin, bits);
        assert_eq!((field(0, 2), field(24, 1)), (3, 1), "the crystal is its source, and its output R is on");
        let input = self.crystal_hz / (field(4, 4) + 1);
        assert!((2_660_000..=16_000_000).contains(&input), "PLL input of {input} Hz");
        let oscillator = input * field(8, 7);
        assert!((96_000_000..=344_000_000).contains(&oscillator), "PLL oscillator of {oscillator} Hz");
        oscillator / (2 * field(25, 2) + 2)
    }

    fn system_hz(&self) -> u64 {
        match self.field(Register::ClockConfiguration, 2, 2) {
            1 => 16_000_000,
            2 => self.crystal_hz,
            3 => self.pll_hz(),
            other => panic!("unexpected clock: {other}"),
        }
    }

    /// Frequency of the processor.
    fn ahb_hz(&self) -> u64 {
        let divider = match self.field(Register::ClockConfiguration, 4, 4) {
            0..=7 => 1,
            8 => 2,
            other => panic!("unexpected prescaler: {other}"),
        };
        self.system_hz() / divider
    }

    fn is_boosted(&self) -> bool {
        self.field(Register::PowerControl5, 8, 1) == 0
    }

    fn pass(&mut self, cycles: u64) {
        let ps = cycles * 1_000_000_000_000 / self.ahb_hz();
        self.since_switch_ps = self.since_switch_ps.saturating_add(ps);
    }

    /// Checks the invariants.
    fn check(&mut self) {
        let (system, ahb) = (self.system_hz(), self.ahb_hz());
        let per_wait_state = if self.is_boosted() { 34_000_000 } else { 30_000_000 };
        let wait_states = self.field(Register::FlashAccessControl, 0, 4);
        if system > 150_000_000 && !self.is_boosted() {
            self.violations.push("more than 150 MHz without boost");
        }
        if ahb > (wait_states + 1) * per_wait_state {
            self.violations.push("too few wait states");
        }
    }
}

impl Registers for Chip {
    fn read(&mut self, register: Register) -> u32 {
        self.pass(1);
        self.registers[register as usize]
    }

    fn write(&mut self, register: Register, value: u32) {
        self.pass(1);
        self.writes.push((register, value));
        let (before, ahb_before) = (self.registers, self.ahb_hz());
        self.registers[register as usize] = value;
        match register {
            // Ready immediately.
            Register::ClockControl => self.registers[0] = value & !(1 << 25) | (value >> 24 & 1) << 25,
            Register::PllConfiguration => {
                assert_eq!(before[0] >> 24 & 1, 0, "the PLL is configured while it is off");
            }
            Register::ClockConfiguration => {
                let wanted = value & 3;
                assert!(wanted != 3 || before[0] >> 25 & 1 == 1, "the PLL is not ready");
                self.registers[2] = value & !12 | wanted << 2;
                let is_switched = before[2] & 3 != wanted;
                if is_switched && self.ahb_hz() > 85_000_000 {
                    self.violations.push("more than half of the frequency at once");
                }
                if is_switched {
                    self.since_switch_ps = 0;
                } else if self.ahb_hz() > ahb_before && self.since_switch_ps < 1_000_000 {
                    self.violations.push("less than 1 us at half of the frequency");
                }
            }
            Register::PowerControl5 | Register::FlashAccessControl => {}
        }
        self.check();
    }

    fn wait_cycles(&mut self, cycles: u32) {
        self.pass(cycles.into());
    }
}

#[test]
fn both_crystals_end_at_either_clock_with_boost_and_nothing_forbidden_on_the_way() {
    for (clock_hz, expected_hz) in [(CAN_4_MBIT_CLOCK_HZ, 168_000_000), (CAN_5_MBIT_CLOCK_HZ, 170_000_000)] {
        for crystal_hz in [8_000_000, 24_000_000] {
            let mut chip = Chip::new(crystal_hz);
            switch_clock(&mut chip, u32::try_from(crystal_hz).unwrap(), clock_hz);
            assert!(chip.violations.is_empty(), "{crystal_hz}: {:?}", chip.violations);
            assert_eq!((chip.system_hz(), chip.ahb_hz()), (expected_hz, expected_hz), "{crystal_hz}");
            assert!(chip.is_boosted());
        }
    }
}

#[test]
fn the_writes_come_in_the_manual_s_order_and_leave_other_bits_alone() {
    use Register::{ClockConfiguration, ClockControl, FlashAccessControl, PllConfiguration, PowerControl5};
    let mut chip = Chip::new(24_000_000);
    chip.registers[PowerControl5 as usize] |= 0x00A5_0001;
    switch_clock(&mut chip, 24_000_000, CAN_4_MBIT_CLOCK_HZ);
    let expected = [
        (PllConfiguration, 0x0100_5453),
        (ClockControl, 0x0103_0500),
        (ClockConfiguration, 0x0000_008A),
        (PowerControl5, 0x00A5_0001),
        (FlashAccessControl, 0x0004_0604),
        (ClockConfiguration, 0x0000_008B),
        (ClockConfiguration, 0x0000_000F),
    ];
    assert_eq!(chip.writes, expected);
}

/// The driver library's sequence: the model detects all of its faults.
#[test]
fn the_library_s_own_way_is_found_wrong() {
    let mut chip = Chip::new(24_000_000);
    chip.write(Register::PllConfiguration, 0x0100_5453);
    chip.write(Register::ClockControl, 0x0103_0500);
    chip.write(Register::ClockConfiguration, 0x0000_008A);
    // Clears the unused bit 0; 0x100 stays.
    chip.write(Register::PowerControl5, 0x0000_0100);
    chip.write(Register::FlashAccessControl, 0x0004_0604);
    chip.wait_cycles(16);
    chip.write(Register::ClockConfiguration, 0x0000_000B);
    // 150 MHz is also the limit for 4 wait states.
    let expected =
        ["more than half of the frequency at once", "more than 150 MHz without boost", "too few wait states"];
    assert_eq!(chip.violations, expected);
}

#[test]
fn a_prescaler_that_goes_back_too_early_is_found() {
    struct Hasty(Chip);
    impl Registers for Hasty {
        fn read(&mut self, register: Register) -> u32 {
            self.0.read(register)
        }
        fn write(&mut self, register: Register, value: u32) {
            self.0.write(register, value);
        }
        fn wait_cycles(&mut self, _cycles: u32) {}
    }
    let mut chip = Hasty(Chip::new(8_000_000));
    switch_clock(&mut chip, 8_000_000, CAN_4_MBIT_CLOCK_HZ);
    assert_eq!(chip.0.violations, ["less than 1 us at half of the frequency"]);
}
