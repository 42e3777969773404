//! The tick: once per period, at the highest priority except timing.

use boards::{Board as _, Joints as _, Selected, bus_off};
use dimsart_core::{Command, Dimsart, Packet, TickResult, Timing};
use dimsart_link::protocol::{DeviceInfo, HEARTBEATS_PER_S, Request};
use embassy_time::{Duration, Instant, Timer};
use firmware::Watchdog;

use crate::command_line::{self, Unsolicited};
use crate::entry_points::{self, Frames};
use crate::handover::{QueueReceiver, QueueSender};
use crate::links::{self, Outgoing, Received};
use crate::modules::RUNS_PROGRAMS;
use crate::rescue::EVENTS;
use crate::stamp;
use crate::telemetry::{IS_LOGGED, Status};
use crate::tick_handover::Answer;

type Joints = <Selected as boards::Board>::Joints;

const PERIOD: Duration = Duration::from_hz(boards::TICK_HZ as u64);
/// A tick is late if it starts later than this.
const TOLERANCE: Duration = Duration::from_ticks(PERIOD.as_ticks() / 10);
/// Ticks between two reports.
const REPORT_EVERY: u32 = boards::TICK_HZ;
/// Ticks between two heartbeats.
const HEARTBEAT_EVERY: u32 = boards::TICK_HZ / HEARTBEATS_PER_S;
/// Communication silence after which the watchdog is no longer fed, ticks; a heartbeat counts as activity.
const PATIENCE: u32 = 5 * HEARTBEAT_EVERY / 2;

/// The tick's ends of the queues.
pub(crate) struct Ends {
    pub(crate) requests: QueueReceiver<(u16, Request)>,
    pub(crate) answers: QueueSender<Answer>,
    pub(crate) packets_in: QueueReceiver<Received>,
    pub(crate) packets_out: QueueSender<Outgoing>,
    pub(crate) reports: QueueSender<Unsolicited>,
    pub(crate) status: QueueSender<Status>,
}

#[embassy_executor::task]
pub(crate) async fn run(
    dimsart: &'static mut Dimsart,
    frames: &'static mut Frames,
    mut joints: Joints,
    mut ends: Ends,
) {
    // The words after the sensors' are computed by the tick.
    let sensed = frames.measured().len().saturating_sub(dimsart.engine().device().timing_outputs());
    let mut timing = Timing::default();
    let mut last_start = None;
    let mut watchdog = Watchdog::new(PATIENCE);
    let info: DeviceInfo =
        DeviceInfo::new(stamp::described()).with_client_lease(boards::TICK_HZ).with_events(&EVENTS);
    let mut info = if RUNS_PROGRAMS { info.with_laws() } else { info };
    links::listen(dimsart);
    let mut due = Instant::now() + PERIOD;
    loop {
        Timer::at(due).await;
        let is_late = Instant::now() > due + TOLERANCE;

        let counter = Selected::counter();
        let start = counter.now();
        let period_cycles = last_start.replace(start).map_or(0, |last| counter.elapsed_between(last, start));
        if let Some((sensors, timings)) = frames.measured().split_at_mut_checked(sensed) {
            joints.read(sensors);
            for (word, value) in timings.iter_mut().rev().zip(timing.words(period_cycles).into_iter().rev()) {
                *word = value;
            }
        }
        dimsart.set_drive_fault(joints.fault());
        let tick = step(dimsart, frames, &mut info, &mut ends);
        joints.write(tick, frames.commanded());
        timing.measure(counter.elapsed_since(start));
        let data_base = dimsart.engine().data_base();
        Selected::show(data_base.revision(), data_base.all_words());

        due += PERIOD;
        let has_overrun = Instant::now() >= due;
        while Instant::now() >= due {
            due += PERIOD;
            info.skip_tick();
        }
        timing.count(is_late, has_overrun);
        info.set_timing(timing);
        if watchdog.tick(!is_late && !has_overrun, command_line::alive()) {
            Selected::feed_watchdog();
        }
        let out = ends.answers.dropped() + ends.packets_out.dropped() + ends.reports.dropped();
        let dropped = out + ends.packets_in.dropped();
        for sample in info.samples(dimsart.engine().data_base()) {
            ends.reports.send_with_reserve(Unsolicited::Sample(sample), 1);
        }
        if timing.ticks % HEARTBEAT_EVERY == 0 {
            ends.reports.send(Unsolicited::Heartbeat(info.heartbeat(dropped)));
        }
        if IS_LOGGED && timing.ticks % REPORT_EVERY == 0 {
            ends.status.send(Status { timing, tick, refused_ticks: dimsart.refused_ticks(), dropped });
        }
    }
}

/// Handles at most one request and the received packets, and runs one tick.
fn step(dimsart: &mut Dimsart, frames: &mut Frames, info: &mut DeviceInfo, ends: &mut Ends) -> TickResult {
    serve(dimsart, frames, info, ends);
    tick(dimsart, frames, info, ends)
}

/// A separate function, so that the response is off the stack before the tick.
#[inline(never)]
#[cfg_attr(not(feature = "measure"), expect(unused_variables, reason = "measurements are in them"))]
fn serve(dimsart: &mut Dimsart, frames: &mut Frames, info: &mut DeviceInfo, ends: &mut Ends) {
    if let Some((id, request)) = ends.requests.try_receive() {
        #[cfg(feature = "measure")]
        let answer = frames.measurements.serve(id, &request, dimsart, info);
        #[cfg(not(feature = "measure"))]
        let answer = dimsart_link::protocol::serve(id, &request, dimsart, info);
        ends.answers.send(answer);
        links::listen(dimsart);
        if matches!(request, Request::Command(Command::Reset)) {
            bus_off::reset();
        }
    }
}

/// Delivers the received packets and runs one tick.
#[inline(never)]
fn tick(dimsart: &mut Dimsart, frames: &mut Frames, info: &mut DeviceInfo, ends: &mut Ends) -> TickResult {
    for _ in 0..Selected::PACKETS_PER_TICK {
        let taken = ends.packets_in.receive_in_place(|Received { link, packet }| {
            let was_wanted = |packet: &Packet| packet.channel == links::listened_to(*link);
            if packet.as_ref().ok().is_none_or(was_wanted) {
                entry_points::deliver(dimsart, *link, packet);
            }
        });
        if taken.is_none() {
            break;
        }
    }
    info.log_bus_event(bus_off::last_event());
    dimsart.set_motion_allowed(info.begin_tick());
    let tick = entry_points::tick(dimsart, frames);
    info.end_tick(tick, dimsart);
    for link in 0..Selected::SIZES.links {
        if let Some(packet) = entry_points::take(dimsart, link) {
            ends.packets_out.send(Outgoing { link, packet });
        }
    }
    tick
}
