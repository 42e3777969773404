//! Captures a fast event on the device and reads it over a slow line.

use std::io::{Read, Write};
use std::time::Duration;

use serde::Serialize;

use super::command::ALL_DESTINATIONS;
use super::{ConnectError, Device, RecorderRows};
use hil_sim::schemes::SchemeText;

/// Polling interval.
const A_MOMENT: Duration = Duration::from_millis(20);

/// Trigger and length of a capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// The signal, such as `POSITION`.
    pub signal: String,
    /// Word with the edge, from 0.
    pub word: u32,
    /// Trigger level, in the unit of the word.
    pub level: f32,
    /// Whether the trigger fires on a falling edge.
    pub is_falling: bool,
    /// Rows before the trigger.
    pub rows_before: u32,
    /// Rows after the trigger.
    pub rows_after: u32,
    /// Ticks from one row to the next.
    pub every_ticks: u32,
}

/// Result of a capture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Captured {
    /// Rows around the trigger; `None` if the wait was cancelled.
    pub recorded: Option<RecorderRows>,
    /// Why the recorder could not be removed.
    pub stays: Option<String>,
}

impl<S: Read + Write> Device<S> {
    /// Plugs in a temporary recorder, waits for its trigger, reads it and removes it. `is_over` cancels the wait. If another
    /// client takes the lease meanwhile, the recorder stays.
    ///
    /// # Errors
    /// [`ConnectError`] when the device refuses the recorder, for example for lack of memory: nothing has changed then.
    pub fn capture(
        &mut self,
        capture: &Capture,
        mut is_over: impl FnMut() -> bool,
    ) -> Result<Captured, ConnectError> {
        let Capture { signal, word, level, is_falling, rows_before, rows_after, every_ticks } = capture;
        let values =
            self.signals(std::slice::from_ref(signal))?.first().map_or(0, |report| report.values.len());
        if usize::try_from(*word).is_ok_and(|word| word >= values) {
            let reason =
                format!("{signal} has no word {word}: the signal has {values} words, counted from 0");
            return Err(ConnectError::InvalidWord(reason));
        }
        let (name, number) = self.free_recorder()?;
        let length = rows_before.saturating_add(*rows_after).saturating_add(1);
        let trigger = if *is_falling { "FALLING" } else { "RISING" };
        let settings = [
            ("LENGTH", length.to_string()),
            ("EVERY", every_ticks.to_string()),
            ("TRIGGER", trigger.to_owned()),
            ("LEVEL", level.to_string()),
            ("WORD", word.to_string()),
            ("AFTER", rows_after.to_string()),
            ("PORT_SIGNAL_IN", signal.clone()),
            (
                "PORT_ROWS",
                if number == 1 { "RECORDED_ROWS".to_owned() } else { format!("RECORDED_ROWS.{number}") },
            ),
        ];
        let rows = settings.map(|(parameter, value)| format!("all {name} {parameter} {value}\n")).concat();
        self.send_rows_as_one(&format!("{rows}all MOD_ENG MOD_ON {name}\n"))?;
        let waited = self.wait_for(&name, *rows_after, &mut is_over);
        let recorded = waited.and_then(|is_caught| match is_caught {
            true => self.read_recorder(Some(&name)).map(Some),
            false => Ok(None),
        });
        let away =
            self.send_rows_as_one(&format!("all MOD_ENG MOD_OFF {name}\nall MOD_ENG MOD_CLOSE {name}\n"));
        let stays = away.err().map(|error| format!("recorder {name} stays plugged in: {error}"));
        Ok(Captured { recorded: recorded?, stays })
    }

    fn wait_for(
        &mut self,
        recorder: &str,
        rows_after: u32,
        is_over: &mut impl FnMut() -> bool,
    ) -> Result<bool, ConnectError> {
        let watched = self.watched(recorder)?;
        while !is_over() {
            if self.has_caught(&watched, rows_after)? {
                return Ok(true);
            }
            self.listen(A_MOMENT)?;
        }
        Ok(false)
    }

    fn send_rows_as_one(&mut self, rows: &str) -> Result<(), ConnectError> {
        let scheme = SchemeText { name: "capture".to_owned(), text: rows.to_owned() };
        self.send_scheme(&scheme, ALL_DESTINATIONS).map(drop)
    }
}
