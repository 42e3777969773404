//! Tests of `dimsart top` from the user's view: the command in a terminal, and a joint served by another process.
#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

use std::io::{BufRead as _, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use portable_pty::{CommandBuilder, PtySize, native_pty_system};
use test_requirements::TEST_TIMEOUT;

const DIMSART: &str = env!("CARGO_BIN_EXE_dimsart");
const PORT: &str = "sim:joint";

/// A rig that is served in a socket folder of its own, invisible to other tests.
struct Served {
    child: Child,
    _said: BufReader<ChildStdout>,
}

impl Served {
    fn start(folder: &Path, rig: &str, controllers: usize) -> Self {
        let mut command = Command::new(DIMSART);
        // A lease lasts two seconds of the computer's time.
        command.args(["serve", rig, "--no-page", "--speed", "0.1"]).env("XDG_RUNTIME_DIR", folder);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut said = BufReader::new(child.stdout.take().unwrap());
        for _ in 0..controllers {
            let mut line = String::new();
            said.read_line(&mut line).unwrap();
            assert!(line.contains("sim:"), "{line}");
        }
        Self { child, _said: said }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The command in a terminal of 80 × 24.
struct Terminal {
    child: Box<dyn portable_pty::Child + Send + Sync>,
    keys: Box<dyn Write + Send>,
    shown: Receiver<Vec<u8>>,
    screen: vt100::Parser,
    terminal: Box<dyn portable_pty::MasterPty + Send>,
    /// Kept open: when the last end closes, the system may drop unread output.
    _slave: Box<dyn portable_pty::SlavePty + Send>,
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

impl Terminal {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let size = PtySize { rows: 24, cols: 80, pixel_width: 0, pixel_height: 0 };
        let pair = native_pty_system().openpty(size).unwrap();
        let mut command = CommandBuilder::new(DIMSART);
        command.arg("top");
        command.args(arguments);
        command.env("XDG_RUNTIME_DIR", folder);
        // Time scale as of the rig: 0.5 s of the user's silence are 5 s of the computer's time.
        command.env("DIMSART_SPEED", "0.1");
        command.env("TERM", "xterm");
        let child = pair.slave.spawn_command(command).unwrap();
        let mut reader = pair.master.try_clone_reader().unwrap();
        let (found, shown) = channel();
        thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = reader.read(&mut buffer) {
                if found.send(buffer.get(..count).unwrap().to_vec()).is_err() {
                    return;
                }
            }
        });
        let keys = pair.master.take_writer().unwrap();
        let screen = vt100::Parser::new(24.try_into().unwrap(), 80.try_into().unwrap(), 0);
        Self { child, keys, shown, screen, terminal: pair.master, _slave: pair.slave }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
        self.keys.flush().unwrap();
    }

    fn resize(&mut self, rows: u16, cols: u16) {
        self.terminal.resize(PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }).unwrap();
        self.screen.screen_mut().set_size(rows.try_into().unwrap(), cols.try_into().unwrap());
    }

    /// Reads the screen until it satisfies the condition.
    fn wait_for(&mut self, what: &str, is_there: impl Fn(&str) -> bool) {
        let deadline = Instant::now() + TEST_TIMEOUT;
        loop {
            let contents = self.screen.screen().contents();
            let words = contents.split_whitespace().collect::<Vec<_>>().join(" ");
            if is_there(&words) {
                return;
            }
            assert!(Instant::now() < deadline, "no {what} in:\n{contents}");
            match self.shown.recv_timeout(Duration::from_secs(1)) {
                Ok(bytes) => self.screen.process(&bytes),
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {}
                Err(error) => panic!("{error}; no {what} in:\n{contents}"),
            }
        }
    }

    fn wait_for_text(&mut self, text: &str) {
        self.wait_for(text, |words| words.contains(text));
    }

    /// Waits for its end; returns its exit status. The terminal is restored then.
    fn end(mut self) -> u32 {
        let status = self.child.wait().unwrap().exit_code();
        let deadline = Instant::now() + TEST_TIMEOUT;
        while self.screen.screen().alternate_screen() || self.screen.screen().hide_cursor() {
            assert!(Instant::now() < deadline, "the terminal or its cursor is not restored");
            if let Ok(bytes) = self.shown.recv_timeout(Duration::from_secs(1)) {
                self.screen.process(&bytes);
            }
        }
        status
    }
}

/// Returns the output of `dimsart connect`.
fn connect(folder: &Path, port: &str, words: &[&str]) -> String {
    let mut command = Command::new(DIMSART);
    let output = command.args(["connect", port]).args(words).env("XDG_RUNTIME_DIR", folder).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_joint_is_seen_armed_tuned_stopped_and_left() {
    let folder = tempfile::tempdir().unwrap();
    let _served = Served::start(folder.path(), "joint", 1);
    // Without a name: a served rig is found.
    let mut top = Terminal::start(folder.path(), &[]);
    top.wait_for_text("no client holds the lease");
    top.wait_for("signal with its unit", |words| words.contains("POSITION") && words.contains(" rad"));
    top.press("a");
    top.wait_for_text("joint may move: arm?");
    top.press("y");
    top.wait_for_text("commands the device");
    top.wait_for_text("ARMED by this terminal");
    top.press("/k_param\r");
    top.wait_for_text("*K_PARAM 150 N·m/rad");
    top.press("\r");
    top.wait_for_text("PIDCTRL_MOD K_PARAM (");
    top.press("80\r");
    top.wait_for_text("*K_PARAM 80 N·m/rad");
    assert!(connect(folder.path(), PORT, &["get", "PIDCTRL_MOD", "K_PARAM"]).contains("80"));
    top.press("\r-5\r");
    top.wait_for("refusal with its reason", |words| {
        words.contains("joint set:") && words.contains("stays 80")
    });
    top.press(" ");
    top.wait_for_text("joint STOP:");
    top.wait_for_text("scheme is stopped");
    // STOP has released the lease: a start moves nothing.
    top.wait_for_text("no client holds the lease");
    top.press("c");
    top.wait_for_text("joint check: the device is NOT commanded: the scheme runs");
    top.press("q");
    assert_eq!(top.end(), 0);
}

#[test]
fn stop_is_of_every_station_and_the_terminal_may_become_smaller() {
    const PORTS: [&str; 3] = ["sim:master", "sim:left", "sim:right"];
    let folder = tempfile::tempdir().unwrap();
    let _served = Served::start(folder.path(), "three", 3);
    let mut top = Terminal::start(folder.path(), &PORTS);
    top.wait_for_text("1 master 2 left 3 right");
    top.resize(15, 40);
    top.wait_for_text("no client holds the lease");
    top.press("s");
    top.wait_for_text("the device is NOT commanded: the scheme is stopped");
    let deadline = Instant::now() + TEST_TIMEOUT;
    for port in PORTS {
        while !connect(folder.path(), port, &[]).contains("the scheme is stopped") {
            assert!(Instant::now() < deadline, "{port} is not stopped");
        }
    }
    top.press("\x03");
    assert_eq!(top.end(), 0);
}

#[test]
fn a_request_to_terminate_gives_the_lease_and_the_terminal_back() {
    let folder = tempfile::tempdir().unwrap();
    let _served = Served::start(folder.path(), "joint", 1);
    let mut top = Terminal::start(folder.path(), &[PORT]);
    top.wait_for_text("no client holds the lease");
    top.press("ay");
    top.wait_for_text("ARMED by this terminal");
    let id = i32::try_from(top.child.process_id().unwrap()).unwrap();
    rustix::process::kill_process(rustix::process::Pid::from_raw(id).unwrap(), rustix::process::Signal::TERM)
        .unwrap();
    assert_eq!(top.end(), 0);
    let deadline = Instant::now() + TEST_TIMEOUT;
    while !connect(folder.path(), PORT, &[]).contains("no client holds the lease") {
        assert!(Instant::now() < deadline, "the joint still moves");
    }
}

#[test]
fn a_closed_terminal_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let _served = Served::start(folder.path(), "joint", 1);
    let pair = native_pty_system().openpty(PtySize::default()).unwrap();
    let mut command = CommandBuilder::new(DIMSART);
    command.args(["top", PORT]);
    command.env("XDG_RUNTIME_DIR", folder.path());
    let mut child = pair.slave.spawn_command(command).unwrap();
    drop(pair.slave);
    // The screen is drawn.
    pair.master.try_clone_reader().unwrap().read_exact(&mut [0; 100]).unwrap();
    drop(pair.master);
    let deadline = Instant::now() + TEST_TIMEOUT;
    while child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < deadline, "the command continues without a terminal");
        thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn nothing_to_show_names_what_serves() {
    let folder = tempfile::tempdir().unwrap();
    let mut top = Terminal::start(folder.path(), &[]);
    top.wait_for_text("start `dimsart serve");
    assert_eq!(top.end(), 1);
}

#[test]
fn what_is_no_terminal_is_sent_to_connect() {
    let output = Command::new(DIMSART).args(["top", "sim:joint"]).stdin(Stdio::null()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("dimsart connect sim:joint"));
}
