//! When to feed a board's watchdog.

/// Feeds the watchdog in ticks that are on time while the communication is alive.
#[derive(Debug)]
pub struct Watchdog {
    heartbeat: u32,
    silent_ticks: u32,
    patience_ticks: u32,
}

impl Watchdog {
    /// Creates a watchdog that tolerates less than `patience_ticks` ticks without a heartbeat.
    #[must_use]
    pub const fn new(patience_ticks: u32) -> Self {
        Self { heartbeat: 0, silent_ticks: 0, patience_ticks }
    }

    /// Records a tick; returns whether to feed the watchdog. `heartbeat` must change while the communication
    /// is alive.
    #[must_use]
    pub fn tick(&mut self, is_in_time: bool, heartbeat: u32) -> bool {
        self.silent_ticks = if heartbeat == self.heartbeat { self.silent_ticks.saturating_add(1) } else { 0 };
        self.heartbeat = heartbeat;
        is_in_time && self.silent_ticks < self.patience_ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_tick_in_time_feeds() {
        let mut watchdog = Watchdog::new(3);
        assert!(watchdog.tick(true, 1));
        assert!(!watchdog.tick(false, 2));
        assert!(watchdog.tick(true, 3));
    }

    #[test]
    fn a_silent_communication_starves_it_and_a_heartbeat_saves_it() {
        let mut watchdog = Watchdog::new(3);
        let fed = [7, 7, 7, 7, 7, 8, 8].map(|heartbeat| watchdog.tick(true, heartbeat));
        assert_eq!(fed, [true, true, true, false, false, true, true]);
        let mut never_alive = Watchdog::new(3);
        assert_eq!([0; 4].map(|heartbeat| never_alive.tick(true, heartbeat)), [true, true, false, false]);
    }
}
