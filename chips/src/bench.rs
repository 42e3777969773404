//! A board on the bench: an emulated chip that runs an image, and time.

use std::sync::Arc;

use cycles::image::Image;
use cycles::instruction::Width;
use cycles::machine::MachineError;
use cycles::processor::{At, Bus as _, Processor, Reset};
use cycles::state::AccessError;
use cycles::timing::{Column, Flash, Profile, Timing};

use crate::stm32g4::Violation;
use crate::{Part, Stm32g4};

/// What a board has around its chip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Its name, as in `boards`.
    pub name: &'static str,
    /// Its chip.
    pub part: Part,
    /// Of its crystal.
    pub crystal_hz: f64,
    /// The UART of its command line.
    pub command_uart: &'static str,
}

/// Boards whose images boot here.
pub const BOARDS: &[Board] = &[
    Board { name: "nucleo-g474re", part: Part::G474re, crystal_hz: 24e6, command_uart: "LPUART1" },
    Board { name: "b-g431b-esc1", part: Part::G431cb, crystal_hz: 8e6, command_uart: "USART2" },
];

impl Board {
    /// The board of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}

/// What drivers of `embassy-stm32` 0.6 do against the manual: they write ones to reserved bits of these registers.
pub const KNOWN: [&str; 3] = ["FDCAN1_TXBTIE gets 0xffffffff", "LPUART1_ICR gets", "USART2_ICR gets"];

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
}

impl Bench {
    /// A board that just got its power. Code is fetched as the chip does, with waiting for flash.
    ///
    /// # Errors
    /// [`MachineError::NoSymbol`].
    pub fn new(board: &'static Board, image: Arc<Image>) -> Result<Self, MachineError> {
        let chip = Stm32g4::new(board.part, &image, Some(board.crystal_hz));
        let timing = Timing::new(Profile::Flash(Flash::STM32G4), Column::Likely);
        Ok(Self { board, processor: Processor::new(image, chip, timing)?, time_s: 0.0 })
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

    /// Pulls the reset pin for a moment.
    pub fn reset(&mut self) {
        self.processor.reset(Reset::Pin);
    }

    /// Writes a word of memory, as a debug probe does.
    ///
    /// # Errors
    /// [`AccessError`] where no memory is.
    pub fn write_word(&mut self, address: u32, word: u32) -> Result<(), AccessError> {
        let at = At { cycle: self.processor.cycles(), code: 0 };
        self.processor.bus.store(address, Width::Word, word, at)
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

    /// Violations as lines: what, where in the code. [`KNOWN`] ones are left out.
    #[must_use]
    pub fn violations(&self) -> Vec<String> {
        let image = self.processor.image();
        let is_known = |violation: &&Violation| KNOWN.iter().any(|known| violation.what.contains(known));
        let line = |violation: &Violation| format!("{}: {}", image.place(violation.at.code), violation.what);
        self.processor.bus.violations().iter().filter(|violation| !is_known(violation)).map(line).collect()
    }
}
