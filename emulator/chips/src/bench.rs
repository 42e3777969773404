//! An emulated board: a chip that runs an image, the parts around the chip, and simulated time.

use std::sync::Arc;

use cycles::AccessError;
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::machine::MachineError;
use cycles::processor::{AccessPoint, Bus as _, Processor, Reset};
use cycles::timing::{Column, Flash, Profile, Timing};

use crate::stm32g4::{GateDriver, Violation};
use crate::{ChipModel, Stm32g4};

/// A board: its chip and the parts around the chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Name of the board and of its image.
    pub name: &'static str,
    /// Name of the board whose firmware it runs, as in `boards`; differs from `name` for a board with a
    /// shield.
    pub firmware: &'static str,
    /// Its chip.
    pub part: ChipModel,
    /// Frequency of its crystal.
    pub crystal_hz: f64,
    /// The UART of its command line.
    pub command_uart: &'static str,
    /// Transceiver between the chip and the CAN bus.
    pub transceiver: Transceiver,
    /// Gate driver between timer 1 and the bridge.
    pub gate_driver: GateDriver,
    /// Voltages at analog pins at standstill: port, pin, `V`.
    pub voltages: &'static [(char, u32, f64)],
}

/// A CAN transceiver, by its data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transceiver {
    /// Its name.
    pub name: &'static str,
    /// Maximum specified bit rate, `bit/s`.
    pub max_bits_per_s: f64,
    /// Maximum loop delay from transmit input to receive output, `s`.
    pub loop_delay_s: f64,
    /// Chip pin that switches the transceiver off at a high level: port and number.
    pub off: Option<(char, u32)>,
}

/// Data sheet SLLSEQ7E: up to 1 Mbit/s. The TCAN330G supports 5 Mbit/s.
const TCAN330: Transceiver =
    Transceiver { name: "TCAN330", max_bits_per_s: 1e6, loop_delay_s: 135e-9, off: Some(('C', 11)) };
/// Limits of ISO 11898-2:2016 for a 5 Mbit/s transceiver, for a board without a transceiver.
const EXTERNAL: Transceiver =
    Transceiver { name: "external transceiver", max_bits_per_s: 5e6, loop_delay_s: 255e-9, off: None };

/// For the L6387 and for drivers that generate the low side themselves.
const NOT_INVERTED: GateDriver = GateDriver { is_low_side_inverted: false };
/// L6398 data sheet: the low side is on at a low level.
const L6398: GateDriver = GateDriver { is_low_side_inverted: true };

/// Boards whose images the emulator boots.
pub const BOARDS: &[Board] = &[
    Board {
        name: "nucleo-g474re",
        firmware: "nucleo-g474re",
        part: ChipModel::G474re,
        crystal_hz: 24e6,
        command_uart: "LPUART1",
        transceiver: EXTERNAL,
        gate_driver: NOT_INVERTED,
        voltages: &[],
    },
    Board {
        name: "nucleo-g474re-ihm08m1",
        firmware: "nucleo-g474re",
        part: ChipModel::G474re,
        crystal_hz: 24e6,
        command_uart: "LPUART1",
        transceiver: EXTERNAL,
        gate_driver: L6398,
        voltages: SHIELD_AT_REST,
    },
    Board {
        name: "b-g431b-esc1",
        firmware: "b-g431b-esc1",
        part: ChipModel::G431cb,
        crystal_hz: 8e6,
        command_uart: "USART2",
        transceiver: TCAN330,
        gate_driver: NOT_INVERTED,
        voltages: AT_REST,
    },
];

/// Voltages without shunt current, at a 12 V supply and a bridge temperature of 25 °C (ST UM2516).
const AT_REST: &[(char, u32, f64)] = &[
    ('A', 1, 0.12857),
    ('A', 7, 0.12857),
    ('B', 0, 0.12857),
    ('A', 3, 0.0),
    ('A', 5, 0.0),
    ('B', 2, 0.0),
    ('A', 0, 1.15508),
    ('B', 14, 1.05510),
];

/// Amplifier voltages without current, at a 12 V supply and a bridge temperature of 25 °C (X-NUCLEO-IHM08M1).
const SHIELD_AT_REST: &[(char, u32, f64)] =
    &[('A', 0, 1.71), ('C', 1, 1.71), ('C', 0, 1.71), ('A', 1, 0.62656), ('C', 2, 1.05510)];

impl Board {
    /// Returns the board with this name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}

/// Known violations by drivers of `embassy-stm32` 0.6: they write ones to reserved bits of these registers.
pub const KNOWN_VIOLATIONS: [&str; 4] = [
    "FDCAN1_TXBTIE is set to 0xffffffff",
    "LPUART1_ICR is set to",
    "USART2_ICR is set to",
    "USART3_ICR is set to",
];

/// Maximum interval between two checks for a changed clock frequency, `s`.
const PIECE_S: f64 = 1e-3;

/// A running board.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Description of the board.
    pub board: &'static Board,
    /// The processor, with the chip as its bus.
    pub processor: Processor<Stm32g4>,
    time_s: f64,
    /// Violations of the data sheets of the board's parts.
    faults: Vec<String>,
}

impl Bench {
    /// Returns a board after power-on. Code fetches include the flash wait states, as on the chip.
    ///
    /// # Errors
    /// [`MachineError::NoSymbol`].
    pub fn new(board: &'static Board, image: Arc<Image>) -> Result<Self, MachineError> {
        let mut chip = Stm32g4::new(board.part, &image, Some(board.crystal_hz));
        chip.set_gate_driver(board.gate_driver);
        for (port, pin, volts) in board.voltages {
            chip.set_voltage(*port, *pin, *volts);
        }
        let timing = Timing::new(Profile::Flash(Flash::STM32G4), Column::Likely);
        Ok(Self { board, processor: Processor::new(image, chip, timing)?, time_s: 0.0, faults: Vec::new() })
    }

    /// The chip.
    #[must_use]
    pub fn chip(&mut self) -> &mut Stm32g4 {
        &mut self.processor.bus
    }

    /// Time since power-on, `s`.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Runs for this time.
    ///
    /// # Errors
    /// [`MachineError::Stopped`] if the program does something that is not modelled.
    pub fn run_for(&mut self, duration_s: f64) -> Result<(), MachineError> {
        let end_s = self.time_s + duration_s;
        while self.time_s < end_s {
            self.time_s = (self.time_s + PIECE_S).min(end_s);
            while self.processor.bus.clock().seconds_at(self.processor.cycles()) < self.time_s {
                // Too late or too early if the clock frequency changes meanwhile: the next iteration corrects
                // it.
                let end = self.processor.bus.clock().cycle_at(self.time_s);
                self.processor.run_until(end.max(self.processor.cycles() + 1))?;
            }
        }
        Ok(())
    }

    /// Runs until processor cycle `cycle` has passed. Only [`run_for`](Self::run_for) advances
    /// [`time_s`](Self::time_s).
    ///
    /// # Errors
    /// As [`run_for`](Self::run_for).
    pub fn run_until(&mut self, cycle: u64) -> Result<(), MachineError> {
        self.processor.run_until(cycle)
    }

    /// Resets the chip by its reset pin.
    pub fn reset(&mut self) {
        self.processor.reset(Reset::Pin);
    }

    /// Writes a word of memory or a register, as a debug probe does.
    ///
    /// # Errors
    /// [`AccessError`] if the address is neither memory nor a register.
    pub fn write_word(&mut self, address: u32, word: u32) -> Result<(), AccessError> {
        let at = AccessPoint { cycle: self.processor.cycles(), code: 0 };
        self.processor.bus.store(address, Width::Word, word, at)?;
        self.processor.update_after_external_change();
        Ok(())
    }

    /// Reads a word of memory or a register, including the side effects of the read.
    ///
    /// # Errors
    /// [`AccessError`] if the address is neither memory nor a register.
    pub fn read_word(&mut self, address: u32) -> Result<u32, AccessError> {
        let at = AccessPoint { cycle: self.processor.cycles(), code: 0 };
        self.processor.bus.load(address, Width::Word, at)
    }

    /// Sends bytes to the board's command line.
    pub fn send(&mut self, bytes: &[u8]) {
        let now = self.processor.cycles();
        self.processor.bus.receive(self.board.command_uart, bytes, now);
    }

    /// Takes the bytes that the board has sent on its command line since the last call.
    pub fn take_received(&mut self) -> Vec<u8> {
        let sent = self.processor.bus.take_sent(self.board.command_uart);
        sent.into_iter().map(|(_, byte)| byte).collect()
    }

    /// Records a violation by the board, once.
    pub(crate) fn note_fault(&mut self, what: String) {
        if !self.faults.contains(&what) {
            self.faults.push(what);
        }
    }

    /// Violations by the program, one line each with the place in the code, then violations of the data
    /// sheets of the board's other parts. [`KNOWN_VIOLATIONS`] violations are excluded.
    #[must_use]
    pub fn violations(&self) -> Vec<String> {
        let image = self.processor.image();
        let is_known = |violation: &&Violation| {
            KNOWN_VIOLATIONS.iter().any(|known| violation.description.contains(known))
        };
        let line = |violation: &Violation| {
            format!("{}: {}", image.location(violation.at.code), violation.description)
        };
        let by_chip =
            self.processor.bus.violations().iter().filter(|violation| !is_known(violation)).map(line);
        by_chip.chain(self.faults.iter().cloned()).collect()
    }
}
