//! A board on the bench: an emulated chip that runs an image, and time.

use std::sync::Arc;

use cycles::AccessError;
use cycles::image::Image;
use cycles::instruction::Width;
use cycles::machine::MachineError;
use cycles::processor::{At, Bus as _, Processor, Reset};
use cycles::timing::{Column, Flash, Profile, Timing};

use crate::stm32g4::{GateDriver, Violation};
use crate::{Part, Stm32g4};

/// What a board has around its chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Its name: that of its image.
    pub name: &'static str,
    /// The board whose firmware it runs, as in `boards`: its name, but for a shield.
    pub firmware: &'static str,
    /// Its chip.
    pub part: Part,
    /// Of its crystal.
    pub crystal_hz: f64,
    /// The UART of its command line.
    pub command_uart: &'static str,
    /// Between its chip and the CAN bus.
    pub transceiver: Transceiver,
    /// Between timer 1 and its bridge.
    pub gate_driver: GateDriver,
    /// At analog pins while nothing moves: port, pin, `V`.
    pub voltages: &'static [(char, u32, f64)],
}

/// A CAN transceiver, by its data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transceiver {
    /// Its name.
    pub name: &'static str,
    /// Highest bit rate that it is specified for, `bit/s`.
    pub max_bits_per_s: f64,
    /// From what is sent to the same read back, at most; `s`.
    pub loop_delay_s: f64,
    /// Pin of the chip that switches it off when it is high: port and number.
    pub off: Option<(char, u32)>,
}

/// SLLSEQ7E: up to 1 Mbit/s; it is the TCAN330G that has 5 Mbit/s.
const TCAN330: Transceiver =
    Transceiver { name: "TCAN330", max_bits_per_s: 1e6, loop_delay_s: 135e-9, off: Some(('C', 11)) };
/// What ISO 11898-2:2016 lets a transceiver for 5 Mbit/s be, for a board that has none.
const EXTERNAL: Transceiver =
    Transceiver { name: "an external transceiver", max_bits_per_s: 5e6, loop_delay_s: 255e-9, off: None };

/// Of L6387, and of drivers that make the low side themselves.
const NOT_INVERTED: GateDriver = GateDriver { is_low_side_inverted: false };
/// Its data sheet: the low side is on at a low level.
const L6398: GateDriver = GateDriver { is_low_side_inverted: true };

/// Boards whose images boot here.
pub const BOARDS: &[Board] = &[
    Board {
        name: "nucleo-g474re",
        firmware: "nucleo-g474re",
        part: Part::G474re,
        crystal_hz: 24e6,
        command_uart: "LPUART1",
        transceiver: EXTERNAL,
        gate_driver: NOT_INVERTED,
        voltages: &[],
    },
    Board {
        name: "nucleo-g474re-ihm08m1",
        firmware: "nucleo-g474re",
        part: Part::G474re,
        crystal_hz: 24e6,
        command_uart: "LPUART1",
        transceiver: EXTERNAL,
        gate_driver: L6398,
        voltages: SHIELD_AT_REST,
    },
    Board {
        name: "b-g431b-esc1",
        firmware: "b-g431b-esc1",
        part: Part::G431cb,
        crystal_hz: 8e6,
        command_uart: "USART2",
        transceiver: TCAN330,
        gate_driver: NOT_INVERTED,
        voltages: AT_REST,
    },
];

/// The shunts' resistors without current; a supply of 12 V; a bridge of 25 °C (ST UM2516).
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

/// The shield's amplifiers without current; a supply of 12 V; a bridge of 25 °C (X-NUCLEO-IHM08M1).
const SHIELD_AT_REST: &[(char, u32, f64)] =
    &[('A', 0, 1.71), ('C', 1, 1.71), ('C', 0, 1.71), ('A', 1, 0.62656), ('C', 2, 1.05510)];

impl Board {
    /// The board of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}

/// What drivers of `embassy-stm32` 0.6 do against the manual: they write ones to reserved bits of
/// these registers.
pub const KNOWN: [&str; 4] =
    ["FDCAN1_TXBTIE gets 0xffffffff", "LPUART1_ICR gets", "USART2_ICR gets", "USART3_ICR gets"];

/// Longest piece of a run in which the clock may change unnoticed, `s`.
const PIECE_S: f64 = 1e-3;

/// A board that runs.
#[derive(Debug, Clone)]
pub struct Bench {
    /// What it is.
    pub board: &'static Board,
    /// The processor, with the chip as its bus.
    pub processor: Processor<Stm32g4>,
    time_s: f64,
    /// What the board does not do as its parts' data sheets say.
    faults: Vec<String>,
}

impl Bench {
    /// A board that just got its power. Code is fetched as the chip does, with waiting for flash.
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

    /// Lets so much time pass.
    ///
    /// # Errors
    /// [`MachineError::Stopped`] where the program does what is not modelled.
    pub fn run_for(&mut self, duration_s: f64) -> Result<(), MachineError> {
        let end_s = self.time_s + duration_s;
        while self.time_s < end_s {
            self.time_s = (self.time_s + PIECE_S).min(end_s);
            while self.processor.bus.clock().seconds_at(self.processor.cycles()) < self.time_s {
                // At a clock that changes meanwhile, this is too late or too early: the next round mends it.
                let end = self.processor.bus.clock().cycle_at(self.time_s);
                self.processor.run_until(end.max(self.processor.cycles() + 1))?;
            }
        }
        Ok(())
    }

    /// Runs until `cycle` of the processor has passed; time is counted by [`run_for`](Self::run_for) alone.
    ///
    /// # Errors
    /// As [`run_for`](Self::run_for).
    pub fn run_until(&mut self, cycle: u64) -> Result<(), MachineError> {
        self.processor.run_until(cycle)
    }

    /// Pulls the reset pin for a moment.
    pub fn reset(&mut self) {
        self.processor.reset(Reset::Pin);
    }

    /// Writes a word of memory or a register, as a debug probe does.
    ///
    /// # Errors
    /// [`AccessError`] where neither is.
    pub fn write_word(&mut self, address: u32, word: u32) -> Result<(), AccessError> {
        let at = At { cycle: self.processor.cycles(), code: 0 };
        self.processor.bus.store(address, Width::Word, word, at)?;
        self.processor.look_again();
        Ok(())
    }

    /// Reads a word of memory or a register, with what reading it does.
    ///
    /// # Errors
    /// [`AccessError`] where neither is.
    pub fn read_word(&mut self, address: u32) -> Result<u32, AccessError> {
        let at = At { cycle: self.processor.cycles(), code: 0 };
        self.processor.bus.load(address, Width::Word, at)
    }

    /// Puts bytes on the board's command line.
    pub fn send(&mut self, bytes: &[u8]) {
        let now = self.processor.cycles();
        self.processor.bus.receive(self.board.command_uart, bytes, now);
    }

    /// What came over the board's command line since this was last asked.
    pub fn received(&mut self) -> Vec<u8> {
        let sent = self.processor.bus.take_sent(self.board.command_uart);
        sent.into_iter().map(|(_, byte)| byte).collect()
    }

    /// Notes what the board does wrong, once.
    pub(crate) fn note_fault(&mut self, what: String) {
        if !self.faults.contains(&what) {
            self.faults.push(what);
        }
    }

    /// Violations as lines: what, where in the code; then what the board's other parts are not made for. [`KNOWN`] ones
    /// are left out.
    #[must_use]
    pub fn violations(&self) -> Vec<String> {
        let image = self.processor.image();
        let is_known = |violation: &&Violation| KNOWN.iter().any(|known| violation.what.contains(known));
        let line = |violation: &Violation| format!("{}: {}", image.place(violation.at.code), violation.what);
        let by_chip =
            self.processor.bus.violations().iter().filter(|violation| !is_known(violation)).map(line);
        by_chip.chain(self.faults.iter().cloned()).collect()
    }
}
