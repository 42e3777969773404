//! Log of the tick's statistics.

use dimsart_core::{TickResult, Timing};

use crate::handover::QueueReceiver;

/// Whether the image has room for the log; `dimsart connect PORT show` prints the same figures.
pub(crate) const IS_LOGGED: bool = !cfg!(feature = "b-g431b-esc1");

/// A copy, made at intervals.
#[derive(Clone, Copy)]
pub(crate) struct Status {
    pub(crate) timing: Timing,
    pub(crate) tick: TickResult,
    pub(crate) refused_ticks: u32,
    /// Items dropped because of a full queue to or from the tick.
    pub(crate) dropped: u32,
}

#[embassy_executor::task]
pub(crate) async fn log(mut status: QueueReceiver<Status>) {
    loop {
        let Status { timing, tick, refused_ticks, dropped } = status.receive().await;
        defmt::info!(
            "tick {}: {}, {} late, {} overruns, {} refused, {} dropped",
            timing.ticks,
            tick,
            timing.late,
            timing.overruns,
            refused_ticks,
            dropped
        );
        if let Some(duration) = timing.duration {
            let (last, mean, max) = (duration.last_cycles, duration.mean_cycles(), duration.max_cycles);
            defmt::info!("cycles per tick: last {}, mean {}, max {}", last, mean, max);
        }
    }
}
