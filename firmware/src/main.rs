//! DIMSART on a board: the tick in an interrupt, everything else below it.
//!
//! ```text
//! tick executor        sensors -> Dimsart::tick -> actuators, once per period
//!   ▲ commands, packets │ answers, packets, status      bounded lock-free queues, never waited for
//! background executor  commands, links, telemetry
//! thread               the board's idle loop
//! ```
#![no_std]
#![no_main]

mod commands;
mod handover;
mod keeper;
mod links;
mod rescue;
mod telemetry;
mod tick;

use boards::{Board as _, Parts, Selected, Storage};
use cortex_m_rt::entry;
use dimsart_core::Dimsart;
use dimsart_core::limits::MAX_LINKS;
use dimsart_core::modules::Standard;
use dimsart_core::saved_scheme::{SchemeBytes, fingerprint};
use embassy_futures::block_on;
use firmware::SchemeStore;
use static_cell::StaticCell;

use crate::handover::Handover;
use crate::keeper::Keeper;

type BoardDimsart = Dimsart<Standard, { Selected::WORDS }>;

/// The built-in scheme, as the build has made it of its text.
const BUILT_IN: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/built-in-scheme"));

#[entry]
fn main() -> ! {
    let Parts { device, tick, background, joints, command_port, link_in, link_out, storage, idle } =
        Selected::start();
    static DIMSART: StaticCell<BoardDimsart> = StaticCell::new();
    let dimsart = DIMSART.init_with(|| match Dimsart::new(device) {
        Ok(dimsart) => dimsart,
        Err(error) => defmt::panic!("the board's Data Base is too small for its device: {}", error),
    });
    let keeper = start_scheme(storage, dimsart);

    static REQUESTS: StaticCell<Handover<dimsart_core::protocol::Request, 2>> = StaticCell::new();
    static ANSWERS: StaticCell<Handover<commands::Answer, 2>> = StaticCell::new();
    static PACKETS_IN: StaticCell<Handover<links::Received, { 2 * MAX_LINKS + 1 }>> = StaticCell::new();
    static PACKETS_OUT: StaticCell<Handover<links::Outgoing, { 2 * MAX_LINKS + 1 }>> = StaticCell::new();
    static STATUS: StaticCell<Handover<telemetry::Status, 3>> = StaticCell::new();
    let (requests, requests_to_take) = REQUESTS.init(Handover::new()).split();
    let (answers, answers_to_take) = ANSWERS.init(Handover::new()).split();
    let (packets_in, packets_to_take) = PACKETS_IN.init(Handover::new()).split();
    let (packets_out, packets_to_send) = PACKETS_OUT.init(Handover::new()).split();
    let (status, status_to_take) = STATUS.init(Handover::new()).split();

    let ends =
        tick::Ends { requests: requests_to_take, answers, packets_in: packets_to_take, packets_out, status };
    background.spawn(token(commands::serve(
        command_port,
        commands::Link { requests, answers: answers_to_take },
        keeper,
    )));
    background.spawn(token(links::receive(link_in, packets_in)));
    background.spawn(token(links::send(link_out, packets_to_send)));
    background.spawn(token(telemetry::log(status_to_take)));
    tick.spawn(token(tick::run(dimsart, joints, ends)));
    boards::Idle::run(idle)
}

/// Starts a kept scheme or the built-in one. If none matches, the board is idle, but answers.
fn start_scheme(
    storage: Option<Storage<<Selected as boards::Board>::Flash>>,
    dimsart: &mut BoardDimsart,
) -> Keeper {
    let stalls_tick = storage.as_ref().is_some_and(|storage| storage.stalls_tick);
    let mut store = storage.and_then(|storage| SchemeStore::new(storage.flash, storage.range));
    let status = block_on(firmware::start(store.as_mut(), BUILT_IN, dimsart));
    defmt::info!("{}: {}", Selected::NAME, status);
    let fingerprint = fingerprint(dimsart.engine_mut());
    Keeper { store, stalls_tick, status, fingerprint, scheme: SchemeBytes::new() }
}

/// A task that is started once; each is.
fn token<S>(
    task: Result<embassy_executor::SpawnToken<S>, embassy_executor::SpawnError>,
) -> embassy_executor::SpawnToken<S> {
    match task {
        Ok(token) => token,
        Err(_) => defmt::panic!("a task was started twice"),
    }
}
