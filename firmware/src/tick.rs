//! The tick, once per period, above everything but time itself.

use boards::{Board as _, Joints as _, Selected};
use dimsart_core::limits::{MAX_DOF, MAX_LINKS};
use dimsart_core::protocol::{self, DeviceInfo, HEARTBEATS_PER_S, Request};
use dimsart_core::{MAX_DEVICE_TYPES, Tick, Timing, Word, types};
use embassy_time::{Duration, Instant, Timer};
use firmware::Watchdog;

use crate::BoardDimsart;
use crate::commands::{self, Answer, Report};
use crate::handover::{Giver, Taker};
use crate::links::{self, Outgoing, Received};
use crate::telemetry::Status;

type Joints = <Selected as boards::Board>::Joints;

const PERIOD: Duration = Duration::from_hz(Selected::TICK_HZ as u64);
/// A tick that begins later than this is late.
const TOLERANCE: Duration = Duration::from_ticks(PERIOD.as_ticks() / 10);
/// Ticks between two reports.
const REPORT_EVERY: u32 = Selected::TICK_HZ;
/// Ticks between two heartbeats.
const HEARTBEAT_EVERY: u32 = Selected::TICK_HZ / HEARTBEATS_PER_S;
/// Ticks that the communication may be silent for before the watchdog is no longer fed: it speaks at every heartbeat.
const PATIENCE: u32 = 5 * HEARTBEAT_EVERY / 2;
/// Tells this image from every other one: board and version.
const IMAGE: &str = env!("DIMSART_IMAGE");
const MAX_WORDS: usize = MAX_DEVICE_TYPES * MAX_DOF;

/// The tick's ends of the queues.
pub(crate) struct Ends {
    pub(crate) requests: Taker<(u16, Request)>,
    pub(crate) answers: Giver<Answer>,
    pub(crate) packets_in: Taker<Received>,
    pub(crate) packets_out: Giver<Outgoing>,
    pub(crate) reports: Giver<Report>,
    pub(crate) status: Giver<Status>,
}

#[embassy_executor::task]
pub(crate) async fn run(dimsart: &'static mut BoardDimsart, mut joints: Joints, mut ends: Ends) {
    let (words_in, words_out) = (dimsart.frame().output_words(), dimsart.frame().input_words());
    let (mut measured, mut commanded) = ([Word(0); MAX_WORDS], [Word(0); MAX_WORDS]);
    let (Some(measured), Some(commanded)) = (measured.get_mut(..words_in), commanded.get_mut(..words_out))
    else {
        defmt::panic!("a device of {} and {} words", words_in, words_out);
    };
    // The words behind the sensors' are the tick's own.
    let timed = if dimsart.engine().device().measures_timing() { types::TIMING.len() } else { 0 };
    let sensed = measured.len().saturating_sub(timed);
    let mut timing = Timing::default();
    let mut watchdog = Watchdog::new(PATIENCE);
    let mut info = DeviceInfo::new(IMAGE).for_clients(Selected::TICK_HZ);
    links::listen(dimsart);
    let mut due = Instant::now() + PERIOD;
    loop {
        Timer::at(due).await;
        let is_late = Instant::now() > due + TOLERANCE;

        let start = Selected::cycles();
        if let Some((sensors, timings)) = measured.split_at_mut_checked(sensed) {
            joints.read(sensors);
            for (word, value) in timings.iter_mut().zip(timing.words()) {
                *word = value;
            }
        }
        let tick = step(dimsart, measured, commanded, &mut info, &mut ends);
        joints.write(tick, commanded);
        if let (Some(start), Some(end)) = (start, Selected::cycles()) {
            timing.measure(start, end, Selected::CYCLE_BITS);
        }
        let data_base = dimsart.engine().data_base();
        Selected::show(data_base.revision(), data_base.all_words());

        due += PERIOD;
        let has_overrun = Instant::now() >= due;
        while Instant::now() >= due {
            due += PERIOD;
            info.leave_out_tick();
        }
        timing.count(is_late, has_overrun);
        info.set_timing(timing);
        if watchdog.tick(!is_late && !has_overrun, commands::alive()) {
            Selected::feed_watchdog();
        }
        let dropped = ends.answers.dropped() + ends.packets_out.dropped() + ends.reports.dropped();
        if let Some(sample) = info.sample(dimsart.engine().data_base()) {
            ends.reports.give_sparingly(Report::Sample(sample));
        }
        if timing.ticks % HEARTBEAT_EVERY == 0 {
            ends.reports.give(Report::Heartbeat(info.heartbeat(dropped)));
        }
        if timing.ticks % REPORT_EVERY == 0 {
            ends.status.give(Status { timing, tick, refused_ticks: dimsart.refused_ticks(), dropped });
        }
    }
}

/// At most one request, the packets that came, one tick.
fn step(
    dimsart: &mut BoardDimsart,
    measured: &[Word],
    commanded: &mut [Word],
    info: &mut DeviceInfo,
    ends: &mut Ends,
) -> Tick {
    if let Some((id, request)) = ends.requests.take() {
        ends.answers.give(protocol::serve(id, &request, dimsart, info));
        links::listen(dimsart);
    }
    for _ in 0..Selected::PACKETS_PER_TICK {
        let Some(Received { link, packet }) = ends.packets_in.take() else { break };
        if packet.as_ref().is_ok_and(|packet| packet.channel != links::listened_to(link)) {
            // It was wanted when it came.
            continue;
        }
        // What is refused is counted by the controller.
        let _ = dimsart.deliver(link, &packet);
    }
    let tick = dimsart.tick(measured, commanded);
    let tick = info.end(tick, commanded);
    for link in 0..MAX_LINKS {
        if let Some(packet) = dimsart.outgoing(link) {
            ends.packets_out.give(Outgoing { link, packet });
        }
    }
    tick
}
