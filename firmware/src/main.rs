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
mod links;
mod rescue;
mod telemetry;
mod tick;

use boards::{Board as _, Parts, Selected};
use cortex_m_rt::entry;
use dimsart_core::limits::MAX_LINKS;
use dimsart_core::modules::Standard;
use dimsart_core::{Dimsart, scheme};
use static_cell::ConstStaticCell;

use crate::handover::Handover;

type BoardDimsart = Dimsart<Standard, { Selected::WORDS }>;

const SCHEME: &str = include_str!("../../schemes/bilateral.scheme");
const SIDES: [&str; 2] = ["master", "slave"];
const SIDE: &str = if cfg!(feature = "slave") { "slave" } else { "master" };

#[entry]
fn main() -> ! {
    boards::Idle::run(start())
}

/// Apart from what comes after it, and never ends: what it needs is off the stack by then.
#[inline(never)]
fn start() -> <Selected as boards::Board>::Idle {
    let Parts { device, tick, background, joints, command_port, link_in, link_out, idle } = Selected::start();
    static DIMSART: ConstStaticCell<BoardDimsart> = ConstStaticCell::new(Dimsart::unconnected());
    let dimsart = DIMSART.take();
    if let Err(error) = dimsart.connect(device) {
        defmt::panic!("the board's Data Base is too small for its device: {}", error);
    }
    load_default_scheme(dimsart);

    static REQUESTS: ConstStaticCell<Handover<dimsart_core::protocol::Request, 2>> =
        ConstStaticCell::new(Handover::new());
    static ANSWERS: ConstStaticCell<Handover<commands::Answer, 2>> = ConstStaticCell::new(Handover::new());
    static PACKETS_IN: ConstStaticCell<Handover<links::Received, { 2 * MAX_LINKS + 1 }>> =
        ConstStaticCell::new(Handover::new());
    static PACKETS_OUT: ConstStaticCell<Handover<links::Outgoing, { 2 * MAX_LINKS + 1 }>> =
        ConstStaticCell::new(Handover::new());
    static STATUS: ConstStaticCell<Handover<telemetry::Status, 3>> = ConstStaticCell::new(Handover::new());
    let (requests, requests_to_take) = REQUESTS.take().split();
    let (answers, answers_to_take) = ANSWERS.take().split();
    let (packets_in, packets_to_take) = PACKETS_IN.take().split();
    let (packets_out, packets_to_send) = PACKETS_OUT.take().split();
    let (status, status_to_take) = STATUS.take().split();

    let ends =
        tick::Ends { requests: requests_to_take, answers, packets_in: packets_to_take, packets_out, status };
    background.spawn(token(commands::serve(command_port, requests, answers_to_take)));
    background.spawn(token(links::receive(link_in, packets_in)));
    background.spawn(token(links::send(link_out, packets_to_send)));
    background.spawn(token(telemetry::log(status_to_take)));
    tick.spawn(token(tick::run(dimsart, joints, ends)));
    idle
}

/// Starts the built-in scheme. One that does not match leaves the board idle, but answering.
fn load_default_scheme(dimsart: &mut BoardDimsart) {
    let failed = scheme::load(SCHEME, SIDE, &SIDES, dimsart, |error| {
        defmt::error!("built-in scheme, line {}: {} was refused", error.place.line, error.place.word);
    });
    if failed == 0 {
        defmt::info!("{}: the built-in scheme runs as {}", Selected::NAME, SIDE);
    } else {
        defmt::error!("{}: the built-in scheme does not run; the board stays idle", Selected::NAME);
    }
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
