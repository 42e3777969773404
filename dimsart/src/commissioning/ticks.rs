//! How well a board's ticks keep their time, as far as it tells, and by a clock that is not its own.

use std::io::{Read, Write};
use std::time::Duration;

use super::jitter::{self, Histogram};
use super::{Check, Surroundings};
use crate::connect::{ConnectError, Device, LiveReport, Tap, TimingText};

/// Of three heartbeats, `s`.
const SILENCE_S: f64 = 0.3;
/// Between two looks at the line.
const A_MOMENT: Duration = Duration::from_millis(20);
/// What crystals of boards and computers differ by, at most, and much more.
const RATE_SHARE: f64 = 1e-3;
/// Ticks from one that is sent to the next: so few that the line has room for answers and heartbeats, and no divisor of
/// what comes regularly.
const SENT_EVERY: u32 = 7;
/// What a board may measure of every tick.
const MEASURED: [&str; 2] = ["TICK_CYCLES", "TICK_PERIOD"];

/// What a board has counted, and when.
struct Counted {
    ticks: u64,
    timing: Option<TimingText>,
    live: LiveReport,
    /// At the last heartbeat.
    heartbeat: Option<u64>,
    /// When it was asked for `ticks`, by the other clock; and how sure that is.
    at_s: f64,
    within_s: f64,
}

impl Counted {
    fn ask<S: Read + Write>(
        device: &mut Device<S>,
        around: &impl Surroundings,
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

/// Watches ticks for some time of the board's surroundings, `s`: their rate, those that were late, how regularly they began,
/// how long they took, and what the board's line lost meanwhile.
///
/// # Errors
/// [`ConnectError`] when the device does not answer.
pub fn watch_ticks<S: Read + Write>(
    device: &mut Device<S>,
    around: &impl Surroundings,
    duration_s: f64,
) -> Result<(Vec<Check>, Option<Histogram>), ConnectError> {
    let [measured, _] = device.device_types()?;
    let sent: Vec<String> = measured.into_iter().filter(|name| MEASURED.contains(&name.as_str())).collect();
    let mut tap = Tap::new(SENT_EVERY).of(&sent);
    // The first heartbeat tells what was dropped before.
    wait(device, around, 0.15)?;
    let before = Counted::ask(device, around)?;
    let (end_s, mut rows) = (around.now_s() + duration_s, Vec::new());
    while around.now_s() < end_s {
        if sent.is_empty() {
            device.listen(A_MOMENT)?;
        } else {
            rows.extend(device.tap(&mut tap, A_MOMENT)?);
        }
    }
    let after = Counted::ask(device, around)?;
    if !sent.is_empty() {
        device.end_tap(&mut tap)?;
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

/// Lets time pass for the board, and listens.
pub(super) fn wait<S: Read + Write>(
    device: &mut Device<S>,
    around: &impl Surroundings,
    time_s: f64,
) -> Result<(), ConnectError> {
    let end_s = around.now_s() + time_s;
    while around.now_s() < end_s {
        device.listen(A_MOMENT)?;
    }
    Ok(())
}

fn rate(name: &str, around: &impl Surroundings, before: &Counted, after: &Counted, hz: f64) -> Check {
    if !around.keeps_time() {
        return Check::not_run(name, "the board's time is simulated, and no clock here is as good");
    }
    if after.ticks < before.ticks {
        return restarted(name);
    }
    let (time_s, ticks) = (after.at_s - before.at_s, f64::from(difference(before.ticks, after.ticks)));
    // One tick may have come at either end.
    let share = RATE_SHARE + (before.within_s + after.within_s + 1.0 / hz) / time_s;
    Check::new(
        name,
        (ticks / time_s / hz - 1.0).abs() <= share,
        format!("{:.1} Hz", ticks / time_s),
        format!("{hz:.0} Hz, to {:.2} %", 100.0 * share),
        "compare the board's crystal with the one in `boards/src/`: it counts another time than it should",
    )
}

fn difference(before: u64, after: u64) -> u32 {
    u32::try_from(after.saturating_sub(before)).unwrap_or(u32::MAX)
}

fn restarted(name: &str) -> Check {
    let next = "`events` says why; nothing below is worth much until it goes on";
    Check::new(name, false, "the board has started over meanwhile", "that it goes on", next)
}

fn in_time(name: &str, before: &Counted, after: &Counted) -> Check {
    let (Some(then), Some(now)) = (&before.timing, &after.timing) else {
        return Check::not_run(name, "the device does not tell");
    };
    if now.ticks < then.ticks {
        return restarted(name);
    }
    let (late, overruns) =
        (now.late - then.late.min(now.late), now.overruns - then.overruns.min(now.overruns));
    let mut found = format!(
        "{late} of {} ticks began more than a tenth of a period late, {overruns} overran",
        now.ticks - then.ticks
    );
    if then.late + then.overruns > 0 {
        found += &format!("; before it {} were late and {} overran", then.late, then.overruns);
    }
    let next = "see what holds the tick up: a debugger, flash that is written, or a scheme that takes too long (`show`)";
    Check::new(name, late + overruns == 0, found, "none late, none overran", next)
}

/// The bound is that of a tick that is asked nothing: of those that were sent, or else of all on average.
fn duration(name: &str, timing: Option<&TimingText>, cycles: &[f64]) -> Check {
    let Some((timing, mean, most, bound)) = timing
        .and_then(|timing| Some((timing, timing.mean_cycles?, timing.max_cycles?, timing.bound_cycles?)))
    else {
        return Check::not_run(name, "the device does not tell what its ticks take, or their bound");
    };
    let least_sent = cycles.iter().copied().reduce(f64::min);
    let most_sent = cycles.iter().copied().reduce(f64::max);
    let mut found = format!("{mean} on average, {most} at most since the start, with a request in it");
    if let (Some(least), Some(most)) = (least_sent, most_sent) {
        found = format!("{least} to {most} in {} ticks that were sent; {found}", cycles.len());
    }
    let limit = timing.limit_cycles;
    Check::new(
        name,
        most_sent.unwrap_or(mean.into()) <= bound.into() && limit.is_none_or(|limit| most <= limit.get()),
        found,
        format!(
            "{bound} at most without a request, by the machine code of the scheme that runs; {} in all",
            limit.map_or("any".to_owned(), |limit| limit.to_string())
        ),
        "`cargo xtask step cycle-table BOARD` compares the chip with the model: report what it shows",
    )
}

fn line(name: &str, before: &Counted, after: &Counted, hz: f64) -> Check {
    let [then, now] = [&before.live, &after.live];
    let dropped = now.dropped.saturating_sub(then.dropped);
    let damaged = now.damaged.saturating_sub(then.damaged);
    let silent_ticks = after.heartbeat.map(|heartbeat| difference(heartbeat, after.ticks));
    let heartbeat = match silent_ticks {
        Some(ticks) => format!("the last heartbeat {ticks} ticks ago"),
        None => "no heartbeat".to_owned(),
    };
    let is_alive = silent_ticks.is_some_and(|ticks| f64::from(ticks) < SILENCE_S * hz);
    Check::new(
        name,
        is_alive && dropped + damaged == 0,
        format!(
            "{heartbeat}; {dropped} dropped, {damaged} came damaged; since the start {} and {}",
            now.dropped, now.damaged
        ),
        "a heartbeat ten times a second, and nothing lost",
        "look at cable and baud rate, and have fewer programs look at the board at once",
    )
}
