//! A fast event, caught on the device in its tick and read over a slow line.

use std::io::{Read, Write};
use std::time::Duration;

use serde::Serialize;

use super::command::ANY_SIDE;
use super::{ConnectError, Device, Recorded};
use hil_sim::schemes::SchemeText;

/// From one look whether it was caught to the next.
const A_MOMENT: Duration = Duration::from_millis(20);

/// What is waited for.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// The signal, such as `POSITION`.
    pub signal: String,
    /// Which of its words has the edge, from 0.
    pub word: u32,
    /// What the word goes beyond, in its unit.
    pub level: f32,
    /// Whether it goes below, and not above.
    pub is_falling: bool,
    /// Rows kept from before the edge.
    pub rows_before: u32,
    /// Rows taken behind it.
    pub rows_after: u32,
    /// Ticks from one row to the next.
    pub every_ticks: u32,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Captured {
    /// The rows around the edge; none when it was not waited for any longer.
    pub recorded: Option<Recorded>,
    /// Why the recorder is still plugged in, if it is.
    pub stays: Option<String>,
}

impl<S: Read + Write> Device<S> {
    /// Plugs a recorder of its own in, waits until it has caught the edge, reads it and takes it away again. `is_over` says
    /// that the edge is not waited for any longer. Somebody else may take the lease meanwhile: then the recorder stays.
    ///
    /// # Errors
    /// [`ConnectError`] when the device refuses the recorder, as for want of memory: nothing has changed then.
    pub fn capture(
        &mut self,
        capture: &Capture,
        mut is_over: impl FnMut() -> bool,
    ) -> Result<Captured, ConnectError> {
        let Capture { signal, word, level, is_falling, rows_before, rows_after, every_ticks } = capture;
        let values =
            self.signals(std::slice::from_ref(signal))?.first().map_or(0, |report| report.values.len());
        if usize::try_from(*word).is_ok_and(|word| word >= values) {
            let reason = format!("{signal} has no value {word}: they count from 0, and there are {values}");
            return Err(ConnectError::Word(reason));
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
            true => self.recorded(Some(&name)).map(Some),
            false => Ok(None),
        });
        let away =
            self.send_rows_as_one(&format!("all MOD_ENG MOD_OFF {name}\nall MOD_ENG MOD_CLOSE {name}\n"));
        let stays = away.err().map(|error| format!("{name} stays plugged in: {error}"));
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
        self.send_scheme(&scheme, ANY_SIDE).map(drop)
    }
}
