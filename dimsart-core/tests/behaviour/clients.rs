//! Several clients of one device: permission to change it, notification, and ticks without a lease.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

use dimsart_core::{
    AxisKind, Command, DataType, DeviceDescriptor, Dimsart, FrameError, ModuleRef, ProvidedMemory,
    SafetyReason, TickResult, Value, Word, scheme, types,
};
use dimsart_link::EventLog;
use dimsart_link::protocol::{
    DeviceInfo, Effect, LeaseAction, LeaseStatus, MAX_TELEMETRY_SIGNALS, MAX_TELEMETRY_WORDS, NO_CLIENT,
    NotCommandedReason, Refusal, Request, Response, Sample, SchemeAction, StoreError, request_id, serve,
};
use dimsart_modules::ALL;

const TICK_HZ: u32 = 1000;
const LEASE_TICKS: u32 = 200;
const SILENCE_TICKS: u32 = 5000;
const FORCE_N: [f32; 3] = [50.0, 100.0, 100.0];
const SCHEME: &str = "
any SIGGEN_MOD PORT_SIGNAL_OUT DES_POSITION
any SIGGEN_MOD AMPLITUDE 1
any MOD_ENG MOD_ON SIGGEN_MOD
any PCTRL_MOD K_PARAM 100
any MOD_ENG MOD_ON PCTRL_MOD
any MOD_ENG MATCHING_CHECK";

/// As on a host.
const STREAMS: usize = 16;

/// A controller with a tick that needs a lease.
struct Board {
    dimsart: Dimsart,
    info: DeviceInfo<STREAMS>,
    number: u8,
    last: (TickResult, [Word; 3]),
}

impl Board {
    fn new() -> Self {
        let (outputs, inputs) = (&[types::POSITION, types::VELOCITY], &[types::DES_FORCE]);
        let device = DeviceDescriptor::new("arm", &[AxisKind::Linear; 3], 1e-3, outputs, inputs);
        let dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
        let info = DeviceInfo::new("test").with_client_lease(TICK_HZ);
        Self { dimsart, info, number: 0, last: (TickResult::Idle, [Word(0); 3]) }
    }

    /// Adds a spring to position 1: 50 N at the current position.
    fn running() -> Self {
        let mut board = Self::new();
        let loaded = scheme::load(SCHEME, "any", &["any"], &mut board.dimsart, |_| ());
        assert_eq!(loaded, 0);
        board
    }

    fn command(&mut self, client: u8, command: Command) -> Result<Effect, Refusal> {
        match self.ask(client, Request::Command(command)) {
            Response::Effect(effect) => Ok(effect),
            Response::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    fn lease(&mut self, client: u8, action: LeaseAction) -> Result<LeaseStatus, Refusal> {
        match self.ask(client, Request::Lease(action)) {
            Response::Lease(status) => Ok(status),
            Response::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    fn status(&mut self) -> Option<NotCommandedReason> {
        match self.ask(1, Request::Status) {
            Response::Status(status) => status.blocked,
            other => panic!("{other:?}"),
        }
    }

    fn follow(&mut self, client: u8, place: u8, signal: &DataType, every_ticks: u32) -> Response<'static> {
        self.ask(client, Request::Telemetry { place, signal: signal.first(), every_ticks })
    }

    fn ask(&mut self, client: u8, request: Request) -> Response<'static> {
        self.number = self.number.wrapping_add(1);
        serve(request_id(client, self.number), &request, &mut self.dimsart, &mut self.info)
    }

    fn tick(&mut self) -> Option<Sample> {
        self.tick_at(0.5)
    }

    fn tick_at(&mut self, position: f32) -> Option<Sample> {
        let mut measured = [Word(0); 6];
        measured[0] = position.into();
        let mut commanded = [Word(0); 3];
        self.dimsart.set_motion_allowed(self.info.begin_tick());
        let tick = self.dimsart.tick(&measured, &mut commanded);
        self.info.end_tick(tick, &self.dimsart);
        self.last = (tick, commanded);
        self.info.samples(self.dimsart.engine().data_base()).next()
    }
}

fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

fn stiffer() -> Command {
    Command::set(module("PCTRL_MOD"), 0, Value::Real(200.0))
}

#[test]
fn a_device_moves_for_the_length_of_a_lease_and_is_still_in_the_tick_after_that() {
    let mut board = Board::running();
    let moving = FORCE_N.map(Word::from);
    board.tick();
    assert_eq!(board.last, (TickResult::Disarmed, [Word(0); 3]));
    board.lease(1, LeaseAction::Take).unwrap();
    for action in [LeaseAction::Renew, LeaseAction::Take] {
        (0..LEASE_TICKS / 2).for_each(|_| drop(board.tick()));
        board.lease(1, action).unwrap();
    }
    for tick in 0..LEASE_TICKS {
        board.tick();
        assert_eq!(board.last, (TickResult::Ran, moving), "{tick} ticks after the renewal");
    }
    board.tick();
    assert_eq!(board.last, (TickResult::Disarmed, [Word(0); 3]));
    // The scheme was still computed.
    let signals = board.dimsart.engine().data_base();
    let slot = signals.slot(types::DES_FORCE.first()).unwrap();
    assert_eq!(signals.words(slot), FORCE_N.map(f32::to_bits));
}

#[test]
fn stop_releases_the_lease_and_starting_again_moves_nothing_without_arming() {
    for stopping in [1, 2] {
        let mut board = Board::running();
        board.lease(1, LeaseAction::Take).unwrap();
        board.tick();
        assert_eq!(board.last.0, TickResult::Ran);
        let effect = board.command(stopping, Command::Stop).unwrap();
        assert_eq!(
            (effect.refused, effect.blocked),
            (None, Some(NotCommandedReason::Tick(TickResult::Idle)))
        );
        assert_eq!(board.lease(2, LeaseAction::Read), Ok(LeaseStatus::default()));
        let late = board.lease(1, LeaseAction::Renew);
        assert_eq!(late, Err(Refusal::Lease { holder: NO_CLIENT }), "a renewal does not restore it");
        // The request of `Start`, from the client that was armed.
        let effect = board.command(1, Command::Check).unwrap();
        assert_eq!(
            (effect.refused, effect.blocked),
            (None, Some(NotCommandedReason::Tick(TickResult::Disarmed)))
        );
        board.tick();
        assert_eq!(board.last, (TickResult::Disarmed, [Word(0); 3]));
        board.lease(1, LeaseAction::Take).unwrap();
        board.tick();
        assert_eq!(board.last.0, TickResult::Ran);
    }
}

#[test]
fn ticks_that_were_left_out_do_not_make_a_lease_longer() {
    let mut board = Board::running();
    board.lease(1, LeaseAction::Take).unwrap();
    for tick in 0..LEASE_TICKS / 4 {
        board.tick();
        assert_eq!(board.last.0, TickResult::Ran, "{tick}");
        (0..3).for_each(|_| board.info.skip_tick());
    }
    board.tick();
    assert_eq!(board.last.0, TickResult::Disarmed);
}

#[test]
fn neither_questions_nor_telemetry_nor_other_clients_prolong_a_lease() {
    let mut board = Board::running();
    board.lease(1, LeaseAction::Take).unwrap();
    board.follow(1, 0, types::POSITION, 1);
    for _ in 0..LEASE_TICKS {
        board.ask(1, Request::Status);
        board.command(1, stiffer()).unwrap();
        board.lease(1, LeaseAction::Read).unwrap();
        assert_eq!(board.lease(2, LeaseAction::Take), Err(Refusal::Lease { holder: 1 }));
        assert!(board.tick().is_some());
        assert_eq!(board.last.0, TickResult::Ran);
    }
    board.tick();
    assert_eq!(board.last.0, TickResult::Disarmed);
}

#[test]
fn while_one_holds_it_the_others_look_and_change_nothing() {
    let mut board = Board::running();
    board.lease(1, LeaseAction::Take).unwrap();
    board.tick();
    let (before, held) = (format!("{:?}", board.dimsart), Refusal::Lease { holder: 1 });
    for command in [Command::Close, Command::Reset, Command::Check] {
        assert_eq!(board.command(2, command), Err(held));
    }
    for other in [NO_CLIENT, 2, 255] {
        assert_eq!(board.command(other, stiffer()), Err(held));
    }
    for action in [SchemeAction::Save, SchemeAction::Confirm, SchemeAction::RollBack] {
        assert_eq!(board.ask(2, Request::Schemes(action)), Response::Refused(held));
        let no_storage = Response::Refused(Refusal::Store(StoreError::NoStorage));
        assert_eq!(board.ask(1, Request::Schemes(action)), no_storage, "the holder may");
    }
    assert_eq!(format!("{:?}", board.dimsart), before);
    assert!(matches!(board.ask(2, Request::Status), Response::Status(status) if status.blocked.is_none()));
    assert!(matches!(board.ask(2, Request::Identify), Response::Identity(_)));
    assert_eq!(board.command(1, stiffer()).unwrap().blocked, None);
    // Any client may stop the device.
    assert_eq!(
        board.command(2, Command::Stop).unwrap().blocked,
        Some(NotCommandedReason::Tick(TickResult::Idle))
    );
    board.lease(1, LeaseAction::Release).unwrap();
    board.command(2, stiffer()).unwrap();
}

#[test]
fn a_command_and_a_heartbeat_say_that_the_lease_is_missing() {
    let mut board = Board::running();
    assert_eq!(
        board.command(1, stiffer()).unwrap().blocked,
        Some(NotCommandedReason::Tick(TickResult::Disarmed))
    );
    board.tick();
    let heartbeat = board.info.heartbeat(3);
    assert_eq!((heartbeat.ticks, heartbeat.dropped), (1, 3));
    assert_eq!(
        (heartbeat.blocked, heartbeat.first_fault),
        (Some(NotCommandedReason::Tick(TickResult::Disarmed)), None)
    );
    board.lease(7, LeaseAction::Take).unwrap();
    assert_eq!(board.command(7, stiffer()).unwrap().blocked, None, "it moves in the next tick");
    board.tick_at(f32::NAN);
    let heartbeat = board.info.heartbeat(0);
    let reason = NotCommandedReason::Tick(TickResult::MeasurementRefused(FrameError::NotFinite {
        signal: types::POSITION.first(),
        word: 0,
    }));
    assert_eq!(heartbeat.blocked, Some(reason));
    assert_eq!(heartbeat.first_fault.unwrap().tick, 2);
    assert_eq!(heartbeat.lease, LeaseStatus::default(), "a fault ends it");
    board.tick();
    assert_eq!(board.info.heartbeat(0).blocked, Some(reason));
    board.command(7, Command::Reset).unwrap();
    board.lease(7, LeaseAction::Take).unwrap();
    board.tick();
    assert_eq!(board.info.heartbeat(0).blocked, None);
}

#[test]
fn signals_come_every_so_many_ticks_with_the_tick_they_are_of() {
    let mut board = Board::running();
    assert_eq!(board.follow(1, 0, types::POSITION, 10), Response::Telemetry { words: 3 });
    assert_eq!(board.follow(1, 1, types::DES_FORCE, 3), Response::Telemetry { words: 6 });
    let id = request_id(1, board.number);
    let samples: Vec<_> = (0..10).filter_map(|_| board.tick()).collect();
    let told: Vec<_> = samples.iter().map(|sample| (sample.tick, sample.counter, sample.id)).collect();
    // By number: several streams of a client belong to the same ticks.
    assert_eq!(told, [(3, 0, id), (6, 1, id), (9, 2, id)]);
    let words = [0.5, 0.0, 0.0].into_iter().chain(FORCE_N).map(f32::to_bits);
    assert!(words.eq(samples[0].words.iter().copied()));
    // Place 0 restarts the list, 0 ticks ends the stream.
    assert_eq!(board.follow(1, 0, types::DES_FORCE, 1), Response::Telemetry { words: 3 });
    assert_eq!(board.tick().unwrap().words.len(), 3);
    assert_eq!(board.follow(1, 0, types::DES_FORCE, 0), Response::Telemetry { words: 0 });
    assert_eq!(board.tick(), None);
}

#[test]
fn telemetry_ends_when_its_client_is_silent_or_the_signal_goes_and_is_one_client_s() {
    let mut board = Board::running();
    board.follow(1, 0, types::DES_FORCE, 1);
    for _ in 0..2 {
        (0..SILENCE_TICKS - 1).for_each(|_| drop(board.tick()));
        assert!(board.tick().is_some());
        let taken = Response::Refused(Refusal::Telemetry { client: 1 });
        assert_eq!(board.follow(2, 0, types::POSITION, 1), taken);
        board.ask(1, Request::Identify);
    }
    assert!((0..SILENCE_TICKS).all(|_| board.tick().is_some()));
    assert_eq!(board.tick(), None);

    board.follow(2, 0, types::DES_POSITION, 1);
    assert!(board.tick().is_some());
    board.command(2, Command::Close).unwrap();
    assert_eq!(board.tick(), None, "a signal that is not in the Data Base is not sent");
}

#[test]
fn telemetry_that_cannot_be_is_refused_and_what_there_is_goes_on() {
    let mut board = Board::running();
    board.follow(1, 0, types::POSITION, 1);
    for place in [u8::try_from(MAX_TELEMETRY_SIGNALS * STREAMS).unwrap(), 255] {
        assert_eq!(board.follow(1, place, types::POSITION, 1), Response::Refused(Refusal::TooLong));
    }
    assert_eq!(board.follow(1, 1, types::FORCE, 1), Response::Refused(Refusal::NotFound));
    assert_eq!(board.tick().unwrap().words.len(), 3);
    let all = [types::POSITION, types::VELOCITY, types::DES_POSITION, types::DES_FORCE];
    for (place, data_type) in (0..).zip(all) {
        board.follow(1, place, data_type, 1);
    }
    assert_eq!(board.tick().unwrap().words.len(), MAX_TELEMETRY_WORDS);
    assert_eq!(
        board.follow(NO_CLIENT, 0, types::POSITION, 1),
        Response::Refused(Refusal::Telemetry { client: 1 })
    );
    // Without clients there are no messages.
    board.info = DeviceInfo::new("alone");
    assert_eq!(board.follow(1, 0, types::POSITION, 1), Response::Refused(Refusal::NotFound));
    board.tick();
    assert_eq!(board.last.0, TickResult::Ran, "nor a lease");
}

/// Arming the first of two boards stays valid when the second one starts.
#[test]
fn a_link_that_is_down_keeps_the_lease_and_is_no_fault_of_the_past() {
    let log: &EventLog = Box::leak(Box::new(EventLog::new()));
    let mut board = Board::new();
    board.info = board.info.with_events(log);
    let rows =
        "any COMM_RXMOD CRX_ADD_DATA DES_FORCE\nany MOD_ENG MOD_ON COMM_RXMOD\nany MOD_ENG MATCHING_CHECK";
    assert_eq!(scheme::load(rows, "any", &["any"], &mut board.dimsart, |_| ()), 0);
    board.lease(1, LeaseAction::Take).unwrap();
    (0..50).for_each(|_| drop(board.tick()));
    let down = Some(NotCommandedReason::Tick(TickResult::LinkDown { link: 0 }));
    assert_eq!((board.last.0, board.status()), (TickResult::LinkDown { link: 0 }, down));
    board.lease(1, LeaseAction::Renew).unwrap();
    let heartbeat = board.info.heartbeat(0);
    assert_eq!((heartbeat.blocked, heartbeat.first_fault, heartbeat.lease.holder), (down, None, 1));
    let event = log.get(0).unwrap();
    assert_eq!((event.what, event.detail), (SafetyReason::LinkDown.number(), 0));
}

#[test]
fn answers_say_that_a_link_is_lost_as_heartbeats_do_until_a_reset() {
    let load = |mut board: Board, rows: &str| {
        assert_eq!(scheme::load(rows, "any", &["any"], &mut board.dimsart, |_| ()), 0);
        board
    };
    let rows = "any COMM_TXMOD CTX_ADD_DATA DES_FORCE\nany MOD_ENG MOD_ON COMM_TXMOD";
    let mut sender = load(Board::running(), rows);
    let rows =
        "any COMM_RXMOD CRX_ADD_DATA DES_FORCE\nany MOD_ENG MOD_ON COMM_RXMOD\nany MOD_ENG MATCHING_CHECK";
    let mut board = load(Board::new(), rows);
    sender.tick();
    let packet = sender.dimsart.take_outgoing(0).unwrap();
    board.dimsart.receive(0, &packet.to_bytes()).unwrap();
    board.lease(1, LeaseAction::Take).unwrap();
    (0..20).for_each(|_| drop(board.tick()));
    assert_eq!((board.last.0, board.status()), (TickResult::Ran, None));
    board.tick();
    let lost = Some(NotCommandedReason::Tick(TickResult::LinkLost { link: 0 }));
    assert_eq!((board.last.0, board.info.heartbeat(0).blocked), (TickResult::LinkLost { link: 0 }, lost));
    assert_eq!(board.status(), lost);
    assert_eq!(board.command(1, Command::Check).unwrap().blocked, lost);
    assert_eq!(board.lease(1, LeaseAction::Renew), Err(Refusal::Fault(48)), "a fault ends the lease");
    assert_eq!(board.lease(1, LeaseAction::Take), Err(Refusal::Fault(48)), "and motion needs a reset");
    assert_eq!(
        board.command(1, Command::Reset).unwrap().blocked,
        Some(NotCommandedReason::Tick(TickResult::Disarmed))
    );
    board.tick();
    assert_eq!(board.last.0, TickResult::Disarmed, "and a new lease");
    board.lease(1, LeaseAction::Take).unwrap();
    board.tick();
    assert_eq!(board.last.0, TickResult::Ran);
    let heartbeat = board.info.heartbeat(0);
    assert_eq!(
        (heartbeat.blocked, heartbeat.first_fault.map(|first| Some(first.reason))),
        (None, Some(lost))
    );
}

#[test]
fn what_its_holder_asks_of_the_schemes_renews_a_lease_and_a_look_does_not() {
    let mut board = Board::running();
    board.lease(1, LeaseAction::Take).unwrap();
    for (client, action, ticks_left) in [
        (1, SchemeAction::Read, LEASE_TICKS - 10),
        (2, SchemeAction::Save, LEASE_TICKS - 20),
        (1, SchemeAction::Save, LEASE_TICKS),
        (1, SchemeAction::Confirm, LEASE_TICKS),
    ] {
        (0..10).for_each(|_| drop(board.tick()));
        board.ask(client, Request::Schemes(action));
        let expected = LeaseStatus { holder: 1, ticks_left };
        assert_eq!(board.lease(3, LeaseAction::Read), Ok(expected), "{action:?} of {client}");
    }
    board.lease(1, LeaseAction::Release).unwrap();
    board.ask(1, Request::Schemes(SchemeAction::Save));
    assert_eq!(
        board.lease(1, LeaseAction::Read),
        Ok(LeaseStatus::default()),
        "motion starts only by taking the lease"
    );
}
