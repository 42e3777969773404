//! Heartbeats of a board, and the lease.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use dimsart::connect::{ConnectError, DisplayValue, SignalPoll, Timeouts};
use dimsart_core::{TickResult, Word};
use dimsart_link::protocol::{LeaseAction, MAX_FRAME_BYTES, Refusal, Request, encode_request, request_id};
use hil_sim::clock;
use hil_sim::response::TELEMETRY_STREAMS;
use hil_sim::schemes::SchemeText;

use crate::board::Board;
use crate::emulated::{dimsart, message};
use test_requirements::TEST_TIMEOUT;

const DISARMED: &str = "the device is NOT commanded: the scheme runs and no client holds the lease";

/// Starts a board with the shipped scheme running and no client holding the lease.
fn running() -> Board {
    let board = Board::start();
    let scheme = SchemeText::read("builtin:bilateral").unwrap();
    let mut device = board.connect();
    let sent = device.send_scheme(&scheme, "slave").unwrap();
    assert!(sent.state.starts_with(DISARMED), "{}", sent.state);
    // The state, regardless of the ticks spent waiting for its peer.
    board.wait_for(TickResult::LinkDown { link: 0 });
    device.set("COMM_RXMOD", "TIMEOUT_TICKS", "0").unwrap();
    board.wait_for(TickResult::Disarmed);
    board
}

/// The same for programs.
fn served() -> Board {
    let board = Board::serve();
    let mut device = board.dial();
    device.send_scheme(&SchemeText::read("builtin:bilateral").unwrap(), "slave").unwrap();
    device.set("COMM_RXMOD", "TIMEOUT_TICKS", "0").unwrap();
    board.wait_for(TickResult::Disarmed);
    board
}

/// `dimsart connect` as a separate process.
struct Program {
    child: Child,
    lines: Receiver<String>,
    out: String,
}

impl Program {
    fn start(board: &Board, arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        command.args(["connect", board.port.as_ref().unwrap()]).args(arguments);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let (found, lines) = channel();
        thread::spawn(move || out.lines().map_while(Result::ok).try_for_each(|line| found.send(line)));
        Self { child, lines, out: String::new() }
    }

    /// Waits until it has printed this text.
    fn wait_for(&mut self, text: &str) {
        while !self.out.contains(text) {
            let line = self.lines.recv_timeout(TEST_TIMEOUT);
            self.out += &line.unwrap_or_else(|error| panic!("{error}: no {text:?} in {}", self.out));
            self.out += "\n";
        }
    }

    /// Ends it by Ctrl-C; returns its output.
    fn interrupt(mut self) -> String {
        assert!(
            Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap().success()
        );
        assert_eq!(self.child.wait().unwrap().code(), Some(0), "{}", self.out);
        self.lines.iter().for_each(|line| self.out += &(line + "\n"));
        self.out
    }
}

#[test]
fn a_device_moves_while_somebody_holds_the_lease_and_not_for_a_tick_longer() {
    let board = running();
    assert_eq!(board.wait_for(TickResult::Disarmed), [Word(0); 3]);
    let mut device = board.connect();
    device.take_lease().unwrap();
    board.wait_for(TickResult::Ran);
    assert_eq!(board.wait_for(TickResult::Disarmed), [Word(0); 3]);
    let late = device.renew_lease().unwrap_err().to_string();
    assert!(late.contains("a fault or a timeout ended the lease"), "{late}");
}

#[cfg(unix)]
#[test]
fn arm_holds_the_lease_until_ctrl_c_and_gives_it_back() {
    let board = served();
    let mut arm = Program::start(&board, &["arm"]);
    board.wait_for(TickResult::Ran);
    arm.wait_for(": the scheme runs and commands the device; client ");
    let mut other = board.dial();
    let refused = other.take_lease().unwrap_err().to_string();
    assert!(refused.contains(" holds the lease; other clients can only read and stop"), "{refused}");
    let refused = other.set("PDCTRL_MOD", "K_PARAM", "1").unwrap_err().to_string();
    assert!(refused.contains(" holds the lease; other clients can only read and stop"), "{refused}");
    let show = other.overview().unwrap().to_string();
    assert!(show.contains(" holds the lease, which expires in "), "{show}");
    let out = arm.interrupt();
    let lines: Vec<_> = out.lines().collect();
    assert!(lines[0].ends_with(" holds the lease until Ctrl-C"), "{out}");
    assert_eq!(lines.last(), Some(&"disarmed: lease released, outputs at their safe value"));
    board.wait_for(TickResult::Disarmed);
    other.set("PDCTRL_MOD", "K_PARAM", "1").unwrap();
}

#[cfg(unix)]
#[test]
fn arm_tells_a_program_every_change() {
    let board = served();
    board.dial().check().unwrap();
    let mut arm = Program::start(&board, &["arm", "--json"]);
    arm.wait_for("\"is_commanded\":true");
    // Every client may stop the device. This ends the lease and the command.
    board.dial().stop().unwrap();
    assert_eq!(arm.child.wait().unwrap().code(), Some(1));
    board.dial().check().unwrap();
    board.wait_for(TickResult::Disarmed);
}

/// The board sends ten heartbeats per second.
#[test]
fn who_has_just_taken_the_lease_is_not_told_that_nobody_has_it() {
    let board = running();
    let mut device = board.connect();
    device.listen(Duration::from_millis(250)).unwrap();
    assert_eq!(device.live().unwrap().holder, None);
    device.take_lease().unwrap();
    assert_eq!(device.live().unwrap().holder, Some(device.client()));
}

/// Twice the duration of the lease, with continuous requests.
#[test]
fn a_lease_that_is_held_outlasts_a_long_row_of_questions() {
    let board = running();
    let mut device = board.connect();
    device.hold_lease().unwrap();
    let start = clock::now();
    while clock::elapsed_since(start) < Duration::from_millis(400) {
        device.state().unwrap();
    }
    assert_eq!(device.live().unwrap().holder, Some(device.client()));
    device.release_lease().unwrap();
    board.wait_for(TickResult::Disarmed);
    device.state().unwrap();
}

#[test]
fn an_answer_that_gets_lost_does_not_cost_the_lease() {
    let board = running();
    let patience = Timeouts { timeout: Duration::from_millis(500), tries: 3 };
    let mut device = board.connect_with(patience);
    device.hold_lease().unwrap();
    for lost in 1..=2 {
        board.lose_answers(lost);
        let start = clock::now();
        device.state().unwrap();
        assert!(clock::elapsed_since(start) >= lost * patience.timeout, "no renewal was lost");
        device.renew_if_due().unwrap();
    }
    assert_eq!(device.live().unwrap().holder, Some(device.client()));
}

/// Sets a key of the board.
fn lock(board: &Board) -> [u8; 16] {
    let key = [7; 16];
    board.core.lock().unwrap().robot.lock(&key);
    key
}

#[test]
fn a_lease_of_a_locked_board_is_renewed_with_its_key() {
    let board = running();
    let key = lock(&board);
    let mut device = board.connect();
    let refused = device.hold_lease().unwrap_err().to_string();
    assert!(refused.contains("the board is locked"), "{refused}");
    device.use_key(&key).unwrap();
    device.hold_lease().unwrap();
    let start = clock::now();
    while clock::elapsed_since(start) < Duration::from_millis(400) {
        device.state().unwrap();
    }
    device.listen(Duration::from_millis(400)).unwrap();
    device.renew_if_due().unwrap();
    assert_eq!(device.live().unwrap().holder, Some(device.client()));
    device.release_lease().unwrap();
    board.wait_for(TickResult::Disarmed);
}

/// The board keeps one authenticated session at a time.
#[test]
fn others_who_seal_do_not_cost_the_lease() {
    let board = running();
    let key = lock(&board);
    let (mut device, mut other) = (board.connect(), board.connect());
    device.use_key(&key).unwrap();
    other.use_key(&key).unwrap();
    // Each session's next request is older than the last one accepted by the board: alternate between both.
    for _ in 0..20 {
        other.take_lease().unwrap();
        other.release_lease().unwrap();
    }
    device.hold_lease().unwrap();
    for _ in 0..8 {
        let refused = other.set("PDCTRL_MOD", "K_PARAM", "1").unwrap_err().to_string();
        assert!(refused.contains(" holds the lease; other clients can only read and stop"), "{refused}");
        for _ in 0..5 {
            device.listen(Duration::from_millis(20)).unwrap();
            device.renew_if_due().unwrap();
        }
    }
    assert_eq!(device.live().unwrap().holder, Some(device.client()));
    device.release_lease().unwrap();
}

/// Sends a request as a client of this number, in addition to the other clients.
fn ask_as(board: &Board, client: u8, request: Request) {
    let mut line = board.line();
    line.write_all(encode_request(&request, request_id(client, 3), &mut [0; MAX_FRAME_BYTES]).unwrap())
        .unwrap();
    // Waits for the answer.
    while line.read(&mut [0; 8]).is_err() {}
}

#[test]
fn a_client_whose_number_another_one_has_takes_another_number_and_not_its_lease() {
    let board = running();
    let mut device = board.connect();
    let number = device.client();
    ask_as(&board, number, Request::Lease(LeaseAction::Take));
    let refused = device.take_lease().unwrap_err();
    assert!(
        matches!(refused, ConnectError::Refused(Refusal::Lease { holder }) if holder == number),
        "{refused}"
    );
    assert_ne!(device.client(), number);

    let number = device.client();
    ask_as(&board, number, Request::Status);
    device.listen(Duration::from_millis(100)).unwrap();
    device.state().unwrap();
    assert_ne!(device.client(), number, "the number clash is detected");
    let number = device.client();
    device.state().unwrap();
    device.listen(Duration::from_millis(100)).unwrap();
    device.state().unwrap();
    assert_eq!(device.client(), number, "own answers are not attributed to another client");
}

#[test]
fn a_device_without_a_lease_says_so() {
    let emulated = crate::emulated::Emulated::with_scheme("slave");
    let found = message(&emulated.run(&["arm"]));
    assert!(found.contains("the device needs no lease"), "{found}");
}

#[test]
fn signals_are_pushed_and_asked_for_where_they_cannot_be() {
    let board = running();
    let names = ["POSITION".to_owned()];
    let mut first = board.connect();
    let mut live = SignalPoll::new(&names, Duration::from_millis(10));
    let position = |value: f32| [value, 0.0, 0.0].map(DisplayValue::Real).to_vec();
    for _ in 0..20 {
        assert_eq!(first.read_signals(&mut live).unwrap()[0].values, position(0.25));
        assert!(live.uses_telemetry());
        first.listen(Duration::from_millis(20)).unwrap();
    }
    // Every client has its own stream, while streams are available.
    let mut others: Vec<_> = (0..TELEMETRY_STREAMS).map(|_| board.connect()).collect();
    for (number, other) in (1..).zip(&mut others) {
        let mut asked = SignalPoll::new(&names, Duration::from_millis(10));
        assert_eq!(other.read_signals(&mut asked).unwrap()[0].values, position(0.25));
        assert_eq!(asked.uses_telemetry(), number < TELEMETRY_STREAMS, "{number}");
    }
    // More words than a sample can contain.
    let mut all = SignalPoll::new(&["MAP".to_owned()], Duration::from_millis(10));
    assert_eq!(first.read_signals(&mut all).unwrap()[0].values.len(), 40);
    assert!(!all.uses_telemetry());
}

#[test]
fn a_device_that_falls_silent_is_told() {
    let board = running();
    let mut device = board.connect();
    while device.live().unwrap().dropped == 0 {
        device.listen(Duration::from_millis(20)).unwrap();
    }
    let live = device.live().unwrap();
    assert!(live.state.starts_with(DISARMED), "{live}");
    assert_eq!((live.holder, live.dropped, live.is_commanded), (None, 7, false));
    board.stop();
    device.listen(Duration::from_millis(350)).unwrap();
    let live = device.live().unwrap();
    assert!(live.to_string().contains("NO HEARTBEAT for 0."), "{live}");
    assert!(live.state.starts_with(DISARMED), "{live}");
}

#[cfg(unix)]
#[test]
fn watch_shows_how_the_device_is_doing() {
    let board = served();
    let mut watch = Program::start(&board, &["watch", "POSITION", "--arm", "--period-s", "0.02"]);
    board.wait_for(TickResult::Ran);
    watch.wait_for(": the scheme runs and commands the device; client ");
    watch.wait_for("POSITION");
    watch.interrupt();
    board.wait_for(TickResult::Disarmed);
    let output = dimsart(&["connect", board.port.as_ref().unwrap(), "watch", "--once", "--arm"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}
