//! Both sides as separate processes over serial ports in real time.
#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a failed unwrap is a failed test")]

use std::io::{Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::{Child, Command, Output, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

/// Lock while this program opens exclusive ports, and while it starts another program, which would otherwise inherit the ports
/// and their locks.
static STARTING: Mutex<()> = Mutex::new(());

fn spawn(command: &mut Command) -> Child {
    let _starting = STARTING.lock();
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// A line between two serial ports that transfers bytes in both directions.
struct SerialPair {
    /// This program's ends of both ports.
    ends: [TTYPort; 2],
    /// Names of the ports.
    ports: [String; 2],
}

impl SerialPair {
    fn new() -> Self {
        let _starting = STARTING.lock();
        let [one, other] = [(); 2].map(|()| TTYPort::pair().unwrap());
        let mut ends = [one.0, other.0];
        ends.iter_mut().for_each(|end| end.set_timeout(Duration::from_millis(5)).unwrap());
        let ports = [one.1, other.1].map(|mut port| {
            port.set_exclusive(false).unwrap();
            port.name().unwrap()
        });
        Self { ends, ports }
    }

    /// Transfers bytes while `work` runs, which receives the names of both ports.
    fn carry<R>(&self, work: impl FnOnce([String; 2]) -> R) -> R {
        let is_over = AtomicBool::new(false);
        let pass = |from: usize, to: usize| {
            let [mut from, mut to] = [from, to].map(|end| self.ends[end].try_clone_native().unwrap());
            let mut bytes = [0; 1024];
            while !is_over.load(Ordering::Relaxed) {
                match from.read(&mut bytes) {
                    Ok(count) => drop(to.write_all(&bytes[..count])),
                    // No bytes yet, or the port is not open.
                    Err(_) => std::thread::sleep(Duration::from_micros(100)),
                }
            }
        };
        std::thread::scope(|scope| {
            scope.spawn(|| pass(0, 1));
            scope.spawn(|| pass(1, 0));
            let result = catch_unwind(AssertUnwindSafe(|| work(self.ports.clone())));
            is_over.store(true, Ordering::Relaxed);
            result.unwrap_or_else(|panic| resume_unwind(panic))
        })
    }
}

fn start(side: &str, port: &str, more: &[&str]) -> Child {
    let mut dimsart = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    dimsart.args(["run", "--json", "--no-report", "--side", side]);
    spawn(dimsart.args(["--set", &format!("link.{side}_address=serial:{port}")]).args(more))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn figures(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_str(text(&output.stdout).lines().last().unwrap()).unwrap()
}

#[test]
fn two_processes_run_the_experiment_over_serial_ports() {
    let duration = ["--set", "duration_s=1"];
    let outputs = SerialPair::new().carry(|[one, other]| {
        let slave = start("slave", &other, &duration);
        let master = start("master", &one, &duration);
        [master, slave].map(|process| process.wait_with_output().unwrap())
    });
    for output in outputs {
        let figures = figures(&output);
        assert_eq!((&figures["stable"], &figures["ticks"]), (&true.into(), &1000.into()), "{figures}");
        // 20 ticks of the time-delay modules, and at least one on the line: packets arrived and were answered.
        let round_trip_ticks = figures["round_trip_ticks"].as_u64().unwrap();
        assert!(round_trip_ticks >= 21, "{round_trip_ticks} ticks");
    }
}

#[test]
fn a_silent_line_is_named_with_its_port() {
    SerialPair::new().carry(|[one, _]| {
        let output = start("master", &one, &["--wait-s", "0.3"]).wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let message = text(&output.stderr);
        assert!(
            message.contains(&format!("no packet from the slave at serial:{one} within 0.3 s")),
            "{message}"
        );
    });
}

#[test]
fn what_does_not_open_is_told_what_to_do() {
    for (address, expected) in [
        ("serial:/dev/ttyNONE9", "port /dev/ttyNONE9 not found; "),
        (
            "serial:/dev/ttyNONE9",
            "--set link.master_address=IP:PORT (on both sides), serial:PATH or can:INTERFACE",
        ),
        ("serial:", "expected IP:PORT, serial:PATH"),
        ("usb:1", "expected IP:PORT, serial:PATH, serial:PATH@BAUD, can:INTERFACE or canfd:INTERFACE"),
    ] {
        let set = format!("link.master_address={address}");
        let mut dimsart = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        let output = spawn(dimsart.args(["run", "--side", "master", "--set", &set]));
        let output = output.wait_with_output().unwrap();
        let message = text(&output.stderr);
        assert!(!output.status.success() && message.contains(expected), "{address}: {message}");
    }
}
