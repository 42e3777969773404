//! General-purpose pins (RM0440, chapter 9).

use super::part::{ChipModel, Function};
use super::registers::Registers;
use super::violation::Access;

const MODER: u32 = 0x00;
const OTYPER: u32 = 0x04;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const AFRL: u32 = 0x20;
const BRR: u32 = 0x28;

// Values of the fields of MODER.
const OUTPUT: u32 = 1;
const ALTERNATE: u32 = 2;
const ANALOG: u32 = 3;

/// A port of 16 pins.
#[derive(Debug, Clone)]
pub(super) struct Gpio {
    letter: char,
    registers: Registers,
    functions: &'static [Function],
    /// External levels at the pins.
    inputs: u32,
}

impl Gpio {
    pub(super) fn new(part: ChipModel, letter: char) -> Self {
        let mut registers = Registers::new(part, "GPIO", &format!("GPIO{letter}"));
        // The register table has the reset values of port A. Port B has JTAG pins, too; all pins of the other
        // ports are analog.
        if letter != 'A' {
            registers.set(MODER, if letter == 'B' { 0xFFFF_FEBF } else { u32::MAX });
            registers.set(OSPEEDR, if letter == 'B' { 0xC0 } else { 0 });
            registers.set(PUPDR, if letter == 'B' { 0x100 } else { 0 });
        }
        Self { letter, registers, functions: part.functions(), inputs: 0 }
    }

    pub(super) fn reset(&mut self, part: ChipModel) {
        *self = Self { inputs: self.inputs, ..Self::new(part, self.letter) };
    }

    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    /// Sets the external level at a pin.
    pub(super) fn set_input(&mut self, pin: u32, is_high: bool) {
        self.inputs = self.inputs & !(1 << pin) | u32::from(is_high) << pin;
    }

    /// Level that the chip drives at a pin; `None` if the pin is not an output.
    pub(super) fn output(&self, pin: u32) -> Option<bool> {
        (self.mode(pin) == OUTPUT).then(|| self.registers.has(ODR, pin))
    }

    /// Names of the alternate functions that are selected at pins.
    pub(super) fn connected(&self) -> impl Iterator<Item = &'static str> {
        let mine = self.functions.iter().filter(|function| function.0 == self.letter);
        mine.filter(|Function(_, pin, number, _)| {
            self.mode(*pin) == ALTERNATE && self.alternate(*pin) == *number
        })
        .map(|function| function.3)
    }

    /// Level of the pull resistor at the pin of a selected alternate function; `None` without a pull
    /// resistor.
    pub(super) fn pull_of(&self, function: &str) -> Option<bool> {
        let pin = self.pin_of(function)?;
        self.connected().find(|connected| *connected == function)?;
        match self.registers.bits(PUPDR, 2 * pin, 2) {
            1 => Some(true),
            2 => Some(false),
            _ => None,
        }
    }

    /// Whether the pin of an alternate function is open-drain.
    pub(super) fn is_open_drain(&self, function: &str) -> bool {
        self.pin_of(function).is_some_and(|pin| self.registers.has(OTYPER, pin))
    }

    /// The pin of an alternate function.
    pub(super) fn pin_of(&self, function: &str) -> Option<u32> {
        let mut mine = self.functions.iter().filter(|one| one.0 == self.letter);
        Some(mine.find(|one| one.3 == function)?.1)
    }

    pub(super) fn is_analog(&self, pin: u32) -> bool {
        self.mode(pin) == ANALOG
    }

    fn mode(&self, pin: u32) -> u32 {
        self.registers.bits(MODER, 2 * pin, 2)
    }

    fn alternate(&self, pin: u32) -> u32 {
        self.registers.bits(AFRL + pin / 8 * 4, pin % 8 * 4, 4)
    }

    pub(super) fn read(&mut self, offset: u32, access: &mut Access<'_>) -> u32 {
        if offset == IDR {
            let driven: u32 = (0..16).filter(|pin| self.mode(*pin) == OUTPUT).map(|pin| 1 << pin).sum();
            return self.registers.get(ODR) & driven | self.inputs & !driven;
        }
        self.registers.read(offset, access)
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, access: &mut Access<'_>) {
        let output = self.registers.get(ODR);
        match offset {
            // Setting has priority over clearing.
            BSRR => self.registers.set(ODR, output & !(value >> 16) | value & 0xFFFF),
            BRR => self.registers.set(ODR, output & !(value & 0xFFFF)),
            _ => self.registers.write(offset, value, access),
        }
        if matches!(offset, MODER | 0x20 | 0x24) {
            self.check_functions(access);
        }
    }

    /// Checks that every pin in alternate mode has a known function.
    fn check_functions(&self, access: &mut Access<'_>) {
        for pin in (0..16).filter(|pin| self.mode(*pin) == ALTERNATE) {
            let number = self.alternate(pin);
            let is_known = self
                .functions
                .iter()
                .any(|function| (function.0, function.1, function.2) == (self.letter, pin, number));
            // JTAG pins after a reset.
            let is_debug = matches!((self.letter, pin, number), ('A', 13..=15, 0) | ('B', 3 | 4, 0));
            if !is_known && !is_debug {
                access.violates(format!(
                    "P{}{pin} is set to alternate function {number}, which the board does not use",
                    self.letter
                ));
            }
        }
    }
}
