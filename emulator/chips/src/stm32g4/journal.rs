//! Log of a program's register writes, in order.

/// Register writes from power-on until the journal is closed.
#[derive(Debug, Clone, Default)]
pub struct Journal {
    lines: Vec<String>,
    is_closed: bool,
}

impl Journal {
    pub(super) fn note(&mut self, register: String, value: u32) {
        if !self.is_closed {
            self.lines.push(format!("{register:<16} {value:#010x}"));
        }
    }

    /// Stops the recording.
    pub fn close(&mut self) {
        self.is_closed = true;
    }

    /// One line per write: the register and its new value.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        &self.lines
    }
}
