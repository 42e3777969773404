//! Tells a signal that grows exponentially from all that a stable loop does.
//!
//! Looked at is the change from tick to tick: of a slow motion little is left in it, of an oscillation much. Its
//! largest size in a window of `W` ticks is compared with that in the window before. **A signal grows without bound
//! when [`RISES`] windows in a row are each at least [`RISE`] times as high as the one before, starting above a
//! floor.** A mode that grows by `g` per tick raises every window by `g^W`, for ever. An impact raises one window and
//! dies out in the next ones; what grows with the power `n` of time raises its `k`-th window by `(1 + 1/k)^n` only.
//!
//! Windows of 16, 32, ... 4096 ticks are watched side by side: the short ones see fast growth before the signal has
//! left its range, the long ones slow growth, and growth from one round trip of a long delay to the next.

/// Windows in a row that rise before it counts as growth.
const RISES: u32 = 8;
/// How many times as high as the one before a window is, at least, to be rising.
const RISE: f64 = 1.3;
/// Length of the shortest window, ticks; each further one is twice as long.
const SHORTEST_TICKS: u64 = 16;
/// Lengths of windows.
const LENGTHS: usize = 9;

/// Watches one signal.
#[derive(Debug, Clone)]
pub struct Growth {
    /// Smallest change per tick that counts.
    floor: f64,
    last: Option<f64>,
    ticks: u64,
    windows: [Window; LENGTHS],
}

/// The windows of one length.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    /// Largest change in the window that is not over yet.
    peak: f64,
    /// Largest change in the one before.
    previous: f64,
    /// Windows that have risen in a row, and the height they rose from.
    rises: u32,
    from: f64,
    pub most: u32,
}

impl Growth {
    /// A watch for changes above `floor` per tick.
    #[must_use]
    pub fn new(floor: f64) -> Self {
        Self { floor, last: None, ticks: 0, windows: [Window::default(); LENGTHS] }
    }

    /// Adds the present tick's value. Gives the growth per tick (`1.04`) in the tick in which it has been seen for
    /// long enough.
    pub fn add(&mut self, value: f64) -> Option<f64> {
        let mut peak = self.last.map_or(0.0, |last| (value - last).abs());
        self.last = Some(value);
        self.ticks += 1;
        let mut length = 1;
        let mut next_length = SHORTEST_TICKS;
        let mut found = None;
        for window in &mut self.windows {
            window.peak = window.peak.max(peak);
            length = next_length;
            if !self.ticks.is_multiple_of(length) {
                break;
            }
            peak = window.peak;
            found = found.or(window.close(self.floor, length));
            next_length = 2 * length;
        }
        found
    }
    /// x
    pub fn most(&self) -> (u32, usize) {
        self.windows.iter().enumerate().map(|(i, w)| (w.most, i)).max().unwrap()
    }
}

impl Window {
    /// Compares the window that is over with the one before it.
    fn close(&mut self, floor: f64, length: u64) -> Option<f64> {
        let rises = self.previous >= floor && self.peak >= RISE * self.previous;
        if !rises {
            self.rises = 0;
            self.from = self.peak;
        } else {
            self.rises += 1;
        }
        self.most = self.most.max(self.rises);
        let height = self.peak;
        self.previous = self.peak;
        self.peak = 0.0;
        let ticks = u64::from(self.rises) * length;
        (self.rises >= RISES).then(|| libm::pow(height / self.from, 1.0 / ticks as f64))
    }
}
