//! What a program writes to registers, in order.

/// Writes while it is open, from power-on on.
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

    /// Notes nothing from now on.
    pub fn close(&mut self) {
        self.is_closed = true;
    }

    /// A line for each write: the register and its new value.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        &self.lines
    }
}
