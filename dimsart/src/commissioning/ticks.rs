//! Checks the timing of a board's ticks, by its own measurements and by an independent clock.

use std::io::{Read, Write};
use std::time::Duration;

use super::jitter::{self, Histogram};
use super::{BoardEnvironment, Check};
use crate::connect::{ConnectError, Device, LiveReport, Subscription, TickTimingReport};

/// Three heartbeats, `s`.
const SILENCE_S: f64 = 0.3;
/// Polling interval of the line.
const A_MOMENT: Duration = Duration::from_millis(20);
/// Tolerance of the tick rate, well above crystal errors of boards and computers.
const RATE_SHARE: f64 = 1e-3;
/// Ticks per sample: leaves room on the line for answers and heartbeats, and is not a divisor of periodic loads.
const SENT_EVERY: u32 = 7;
/// Optional measurements of every tick.
const MEASURED: [&str; 2] = ["TICK_CYCLES", "TICK_PERIOD"];

/// Counters of a board at a time.
struct Counted {
    ticks: u64,
    timing: Option<TickTimingReport>,
    live: LiveReport,
    /// Tick of the last heartbeat.
    heartbeat: Option<u64>,
    /// Time of `ticks` by the independent clock, and its uncertainty.
    at_s: f64,
    within_s: f64,
}

impl Counted {
    fn ask<S: Read + Write>(
        device: &mut Device<S>,
        around: &impl BoardEnvironment,
    ) -> Result<Self, ConnectError> {
        let timing = device.timing()?;
        let live = device.live()?;
        let heartbeat = device.heartbeat_ticks();
        let begun_s = around.now_s();
        let ticks = device.ticks()?;
        let took_s = around.now_s() - begun_s;
        Ok(Self { ticks, timing, live, heartbeat, at_s: begun_s + took_s / 2.0, within_s: took_s / 2.0 })
    }
}

/// Watches ticks for `duration_s`: rate, late ticks, jitter, execution time, and losses of the line.
///
/// # Errors
/// [`ConnectError`] if the device does not answer.
pub fn observe_ticks<S: Read + Write>(
    device: &mut Device<S>,
    around: &impl BoardEnvironment,
    duration_s: f64,
) -> Result<(Vec<Check>, Option<Histogram>), ConnectError> {
    let [measured, _] = device.measured_and_commanded()?;
    let sent: Vec<String> = measured.into_iter().filter(|name| MEASURED.contains(&name.as_str())).collect();
    let mut tap = Subscription::new(SENT_EVERY).with_signals(&sent);
    // The first heartbeat has the count of earlier losses.
    wait(device, around, 0.15)?;
    let before = Counted::ask(device, around)?;
    let (end_s, mut rows) = (around.now_s() + duration_s, Vec::new());
    while around.now_s() < end_s {
        if sent.is_empty() {
            device.listen(A_MOMENT)?;
        } else {
            rows.extend(device.receive_rows(&mut tap, A_MOMENT)?);
        }
    }
    let after = Counted::ask(device, around)?;
    if !sent.is_empty() {
        device.close_telemetry(&mut tap)?;
    }
    let [cycles, periods] = MEASURED.map(|name| {
        let column = sent.iter().position(|sent| sent == name);
        let values = rows.iter().filter_map(|row| row.values.get(column?).copied());
        values.filter(|value| value.is_finite()).collect::<Vec<f64>>()
    });
    let hz = 1.0 / f64::from(device.identity().sample_period_s);
    let over = format!(" over {duration_s} s");
    let (regular, histogram) = jitter::judge(&format!("jitter of the tick{over}"), &periods, hz);
    let checks = vec![
        rate(&format!("tick rate{over}"), around, &before, &after, hz),
        in_time(&format!("ticks in time{over}"), &before, &after),
        regular,
        duration(&format!("cycles of a tick{over}"), after.timing.as_ref(), &cycles),
        line(&format!("line{over}"), &before, &after, hz),
    ];
    Ok((checks, histogram))
}

/// Waits for a time of the board, and listens.
pub(super) fn wait<S: Read + Write>(
    device: &mut Device<S>,
    around: &impl BoardEnvironment,
    time_s: f64,
) -> Result<(), ConnectError> {
    let end_s = around.now_s() + time_s;
    while around.now_s() < end_s {
        device.listen(A_MOMENT)?;
    }
    Ok(())
}

fn rate(name: &str, around: &impl BoardEnvironment, before: &Counted, after: &Counted, hz: f64) -> Check {
    if !around.keeps_time() {
        return Check::not_run(name, "the board's time is simulated");
    }
    if after.ticks < before.ticks {
        return restarted(name);
    }
    let (time_s, ticks) = (after.at_s - before.at_s, f64::from(difference(before.ticks, after.ticks)));
    // Plus one tick at the ends.
    let share = RATE_SHARE + (before.within_s + after.within_s + 1.0 / hz) / time_s;
    Check::new(
        name,
        (ticks / time_s / hz - 1.0).abs() <= share,
        format!("{:.1} Hz", ticks / time_s),
        format!("{hz:.0} Hz ±{:.2} %", 100.0 * share),
        "board and host clocks disagree: compare the board's crystal frequency with `boards/src/`",
    )
}

fn difference(before: u64, after: u64) -> u32 {
    u32::try_from(after.saturating_sub(before)).unwrap_or(u32::MAX)
}

fn restarted(name: &str) -> Check {
    let next = "run `events` for the cause; the results of later checks are invalid";
    Check::new(name, false, "the board restarted during the test", "no restart", next)
}

fn in_time(name: &str, before: &Counted, after: &Counted) -> Check {
    let (Some(then), Some(now)) = (&before.timing, &after.timing) else {
        return Check::not_run(name, "the device does not report late ticks");
    };
    if now.ticks < then.ticks {
        return restarted(name);
    }
    let (late, overruns) =
        (now.late - then.late.min(now.late), now.overruns - then.overruns.min(now.overruns));
    let mut found = format!(
        "{late} of {} ticks started late (by over 10 % of a period), {overruns} overran",
        now.ticks - then.ticks
    );
    if then.late + then.overruns > 0 {
        found += &format!("; before the test: {} late ticks, {} overruns", then.late, then.overruns);
    }
    let next = "find the cause of late ticks: a debugger, a write to flash, or a scheme that takes too long (`show`)";
    Check::new(name, late + overruns == 0, found, "0 late, 0 overran", next)
}

/// The bound is for a tick without a request: compares the sampled ticks, else the mean of all ticks.
fn duration(name: &str, timing: Option<&TickTimingReport>, cycles: &[f64]) -> Check {
    let Some((timing, mean, most, bound)) = timing
        .and_then(|timing| Some((timing, timing.mean_cycles?, timing.max_cycles?, timing.bound_cycles?)))
    else {
        return Check::not_run(name, "the device does not report the cycles of a tick or their bound");
    };
    let min_sent = cycles.iter().copied().reduce(f64::min);
    let max_sent = cycles.iter().copied().reduce(f64::max);
    let mut found =
        format!("mean {mean} and maximum {most} cycles per tick since the start, requests included");
    if let (Some(least), Some(most)) = (min_sent, max_sent) {
        found = format!("{least} to {most} cycles in {} sampled ticks; {found}", cycles.len());
    }
    let limit = timing.limit_cycles;
    Check::new(
        name,
        max_sent.unwrap_or(mean.into()) <= bound.into() && limit.is_none_or(|limit| most <= limit.get()),
        found,
        format!(
            "max {bound} cycles without requests (bound from the machine code); limit with requests: {}",
            limit.map_or("none".to_owned(), |limit| format!("{limit} cycles"))
        ),
        "run `cargo xtask step cycle-table BOARD`, which compares the chip with the model, and report the output",
    )
}

fn line(name: &str, before: &Counted, after: &Counted, hz: f64) -> Check {
    let [then, now] = [&before.live, &after.live];
    let dropped = now.dropped.saturating_sub(then.dropped);
    let damaged = now.damaged.saturating_sub(then.damaged);
    let silent_ticks = after.heartbeat.map(|heartbeat| difference(heartbeat, after.ticks));
    let heartbeat = match silent_ticks {
        Some(ticks) => format!("last heartbeat {ticks} ticks ago"),
        None => "no heartbeat".to_owned(),
    };
    let is_alive = silent_ticks.is_some_and(|ticks| f64::from(ticks) < SILENCE_S * hz);
    Check::new(
        name,
        is_alive && dropped + damaged == 0,
        format!(
            "{heartbeat}; {dropped} frames dropped, {damaged} damaged; since the start {} dropped, {} damaged",
            now.dropped, now.damaged
        ),
        "10 heartbeats per second, no frame lost",
        "check cable and baud rate, and close other programs that use the board",
    )
}
