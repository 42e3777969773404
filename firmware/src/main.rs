//! DIMSART firmware: the tick in an interrupt, everything else at lower priority.
//!
//! ```text
//! tick executor        sensors -> Dimsart::tick -> actuators, once per period
//!   ▲ commands, packets │ answers, packets, status      bounded lock-free queues, non-blocking
//! background executor  commands, links, telemetry
//! thread               the board's idle loop
//! ```
#![no_std]
#![no_main]

#[cfg(feature = "by-hand")]
mod by_hand;
mod command_line;
mod commands;
mod entry_points;
#[cfg_attr(not(feature = "auth"), path = "no_keys.rs")]
mod key_service;
mod links;
#[cfg(feature = "measure")]
mod measure;
mod memory;
mod modules;
mod motor_service;
mod rescue;
mod scheme_service;
mod stamp;
mod telemetry;
mod tick;
mod tick_handover;

#[cfg(all(feature = "b-g431b-esc1", feature = "control", feature = "signals", feature = "teleoperation"))]
compile_error!(
    "the default modules do not fit b-g431b-esc1 with its drive: \
     run `cargo board b-g431b-esc1,control,teleoperation --no-default-features`"
);

use boards::{Board as _, BoardParts, Joints as _, Limits, Selected, handover};
use cortex_m_rt::entry;
use dimsart_core::Dimsart;
use dimsart_link::protocol::{MAX_MOTOR_WORDS, MotorReport};
use dimsart_link::saved_scheme::{MAX_BYTES_WITHOUT_LAWS, MAX_SCHEME_BYTES, saved_fingerprint};
use embassy_futures::block_on;
use firmware::SchemeStore;
use static_cell::ConstStaticCell;

use crate::entry_points::{Controller, Frames};
use crate::handover::ItemQueue;
use crate::key_service::{KeyService, KeysToTake};
use crate::motor_service::MotorService;
use crate::scheme_service::{SchemeService, Store};
use crate::stamp::stamp;

#[entry]
fn main() -> ! {
    let idle = start();
    #[expect(unsafe_code, reason = "tasks may run from here on")]
    // SAFETY: no critical section is active: `start` has returned.
    unsafe {
        cortex_m::interrupt::enable();
    }
    boards::Idle::run(idle)
}

/// A separate function, so that its stack is free before the idle loop. Returns with all interrupts masked.
#[inline(never)]
fn start() -> <Selected as boards::Board>::Idle {
    let BoardParts { axes, tick, background, mut joints, command_port, link_in, link_out, storage, idle } =
        Selected::start();
    rescue::restore_events();
    static CONTROLLER: ConstStaticCell<Controller> = ConstStaticCell::new(Controller::new());
    static FRAMES: ConstStaticCell<Frames> = ConstStaticCell::new(Frames::new());
    let frames = FRAMES.take();
    let stalls_tick = storage.as_ref().is_some_and(|storage| storage.stalls_tick);
    let key_range = storage.as_ref().map(key_service::range);
    let mut store = storage.and_then(|storage| SchemeStore::new(storage.flash, storage.range));
    let (motor, limits) = start_motor(store.as_mut(), &mut joints);
    let dimsart = entry_points::connect_with(CONTROLLER.take(), &axes, frames, limits);
    stamp::limit(dimsart);
    stamp::log();
    let (schemes, keys, keys_to_take) = start_scheme(store, stalls_tick, key_range, dimsart);

    static REQUESTS: ConstStaticCell<ItemQueue<(u16, dimsart_link::protocol::Request), 2>> =
        ConstStaticCell::new(ItemQueue::new());
    static ANSWERS: ConstStaticCell<ItemQueue<tick_handover::Answer, 2>> =
        ConstStaticCell::new(ItemQueue::new());
    static PACKETS_IN: ConstStaticCell<ItemQueue<links::Received, { Selected::PACKETS_PER_TICK + 1 }>> =
        ConstStaticCell::new(ItemQueue::new());
    static PACKETS_OUT: ConstStaticCell<ItemQueue<links::Outgoing, { Selected::SIZES.links + 1 }>> =
        ConstStaticCell::new(ItemQueue::new());
    static REPORTS: ConstStaticCell<ItemQueue<command_line::Unsolicited, 3>> =
        ConstStaticCell::new(ItemQueue::new());
    static STATUS: ConstStaticCell<ItemQueue<telemetry::Status, 3>> = ConstStaticCell::new(ItemQueue::new());
    let (requests, requests_to_take) = REQUESTS.take().split();
    let (answers, answers_to_take) = ANSWERS.take().split();
    let (packets_in, packets_to_take) = PACKETS_IN.take().split();
    let (packets_out, packets_to_send) = PACKETS_OUT.take().split();
    let (reports, reports_to_take) = REPORTS.take().split();
    let (status, status_to_take) = STATUS.take().split();

    let ends = tick::Ends {
        requests: requests_to_take,
        answers,
        packets_in: packets_to_take,
        packets_out,
        reports,
        status,
    };
    let link = tick_handover::TickHandover { requests, answers: answers_to_take, id: 0 };
    // The watchdog timeout is longer up to here: flash may have been erased.
    Selected::feed_watchdog();
    // The tasks start when this function's stack is free.
    cortex_m::interrupt::disable();
    background.spawn(token(commands::serve(command_port, link, reports_to_take, schemes, motor, keys)));
    links::start(background, (link_in, link_out), (packets_in, packets_to_send), keys_to_take);
    if telemetry::IS_LOGGED {
        background.spawn(token(telemetry::log(status_to_take)));
    }
    tick.spawn(token(tick::run(dimsart, frames, joints, ends)));
    idle
}

/// Starts a drive with the stored configuration, or the image's.
fn start_motor(
    store: Option<&mut Store>,
    joints: &mut <Selected as boards::Board>::Joints,
) -> (MotorService, Limits) {
    let mut report = match store {
        Some(store) if <Selected as boards::Board>::Joints::HAS_DRIVE => store.motor(),
        _ => MotorReport::default(),
    };
    let limits = joints.begin(&mut report);
    if report.fallback.is_some() {
        defmt::warn!("stored motor configuration invalid or outdated: see `dimsart motor show`");
    }
    let limits = limits.unwrap_or(Limits { inputs: Selected::LIMITS, outputs: Selected::OUTPUT_LIMITS });
    (MotorService { report, put: [0; MAX_MOTOR_WORDS] }, limits)
}

/// Starts a stored scheme or the built-in one, and reads the key. If no scheme matches, the board is idle but
/// responds.
fn start_scheme(
    mut store: Option<Store>,
    stalls_tick: bool,
    key_range: Option<key_service::KeyRange>,
    dimsart: &mut Dimsart,
) -> (SchemeService, KeyService, KeysToTake) {
    const MAX: usize = if modules::RUNS_PROGRAMS { MAX_SCHEME_BYTES } else { MAX_BYTES_WITHOUT_LAWS };
    static SCHEME: ConstStaticCell<heapless::Vec<u8, MAX>> = ConstStaticCell::new(heapless::Vec::new());
    let scheme = SCHEME.take();
    let status = block_on(firmware::start(store.as_mut(), scheme, stamp().scheme(), dimsart));
    defmt::info!("{}: starts with scheme {}", Selected::NAME, status.origin);
    if status.fallback.is_some() {
        defmt::warn!("fallback scheme: see `dimsart connect`");
    }
    let (keys, keys_to_take) = key_service::start(key_range, store.as_mut().map(SchemeStore::flash));
    let fingerprint = saved_fingerprint(stamp().scheme());
    (SchemeService { store, stalls_tick, status, fingerprint, scheme }, keys, keys_to_take)
}

/// Returns the token of a task; each task is started once.
fn token<S>(
    task: Result<embassy_executor::SpawnToken<S>, embassy_executor::SpawnError>,
) -> embassy_executor::SpawnToken<S> {
    match task {
        Ok(token) => token,
        Err(_) => defmt::panic!("task started twice"),
    }
}
