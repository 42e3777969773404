//! Worst-case response times on a CAN bus.
//!
//! Davis, Burns, Bril and Lukkien, "Controller Area Network (CAN) schedulability analysis: refuted, revisited and
//! revised", Real-Time Systems 35, 2007: non-preemptive fixed priorities, evaluates every instance in the busy
//! period.

/// A periodic message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message {
    /// Period, `ns`.
    pub period_ns: u64,
    /// Release jitter, `ns`.
    pub jitter_ns: u64,
    /// Maximum frame time including the interframe space, `ns`.
    pub frame_ns: u64,
}

/// Worst-case time from the nominal release of `messages[index]` to the end of its frame and the interframe space,
/// `ns`. `messages` are in order of priority; a bit lasts `bit_ns`, at least 1. `None` if the bus is overloaded up to
/// this priority, or the message does not exist.
#[must_use]
pub fn worst_response_ns(messages: &[Message], index: usize, bit_ns: u64) -> Option<u64> {
    let message = messages.get(index)?;
    let (more_urgent, rest) = messages.split_at_checked(index)?;
    let less_urgent = rest.get(1..)?;
    let upto = messages.get(..=index)?;
    let utilization: f64 = upto.iter().map(|message| ratio(message.frame_ns, message.period_ns)).sum();
    if utilization >= 1.0 {
        return None;
    }
    let blocking_ns = less_urgent.iter().map(|message| message.frame_ns).max().unwrap_or(0);
    let busy_ns = fixed_point(message.frame_ns, |busy_ns| blocking_ns + demand_ns(upto, busy_ns, 0));
    let instances = (busy_ns + message.jitter_ns).div_ceil(message.period_ns);
    let response_ns = |instance: u64| {
        let before_ns = blocking_ns + instance * message.frame_ns;
        let waits_ns =
            fixed_point(before_ns, |waits_ns| before_ns + demand_ns(more_urgent, waits_ns, bit_ns));
        (message.jitter_ns + waits_ns + message.frame_ns).saturating_sub(instance * message.period_ns)
    };
    (0..instances).map(response_ns).max()
}

/// Worst-case demand of `messages` in a time interval.
fn demand_ns(messages: &[Message], time_ns: u64, bit_ns: u64) -> u64 {
    let frames = |message: &Message| (time_ns + message.jitter_ns + bit_ns).div_ceil(message.period_ns);
    messages.iter().map(|message| frames(message) * message.frame_ns).sum()
}

/// Fixed-point iteration from below.
fn fixed_point(start_ns: u64, next: impl Fn(u64) -> u64) -> u64 {
    let mut time_ns = start_ns;
    loop {
        let later_ns = next(time_ns);
        if later_ns <= time_ns {
            return time_ns;
        }
        time_ns = later_ns;
    }
}

#[expect(clippy::cast_precision_loss, reason = "times of a few seconds")]
fn ratio(time_ns: u64, of_ns: u64) -> f64 {
    time_ns as f64 / of_ns.max(1) as f64
}
