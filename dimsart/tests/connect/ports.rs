//! Ports: sockets, serial ports, and ports that cannot be opened.

#[cfg(unix)]
use std::io::{Read, Write};
#[cfg(unix)]
use std::thread;
#[cfg(unix)]
use std::time::Duration;

#[cfg(unix)]
use dimsart::connect::Device;
#[cfg(unix)]
use dimsart_link::protocol::Receiver;
use hil_sim::link::{PortError, open_port};

#[cfg(unix)]
use crate::emulated::{QUICK, Robot};
use crate::emulated::{dimsart, message};
#[test]
fn a_port_that_does_not_open_is_told_what_to_do() {
    for (port, expected) in [
        ("/dev/ttyNONE9", "port /dev/ttyNONE9 not found; "),
        ("/dev/null", "cannot open serial port /dev/null: "),
        ("tcp:localhost", "invalid address tcp:localhost: write tcp:HOST:PORT"),
        ("tcp:localhost:http", "invalid address"),
        ("tcp:127.0.0.1:1", "start the emulated board first"),
        ("unix:/no/such/socket", "start the emulated board first"),
    ] {
        let found = message(&dimsart(&["connect", port, "show"]));
        assert!(found.contains(expected), "{port}: {found}");
    }
    let output = dimsart(&["connect", "tcp:127.0.0.1:1", "--timeout-s", "-1"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[cfg(unix)]
#[test]
fn a_socket_with_a_path_will_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("board");
    let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
    thread::spawn(move || answer_on(listener.accept().unwrap().0));
    let port = format!("unix:{}", path.display());
    let output = dimsart(&["connect", &port]);
    assert!(String::from_utf8(output.stdout).unwrap().starts_with("arm, image test 0.1"));
}

#[cfg(unix)]
#[test]
fn a_serial_port_will_do_and_one_program_at_a_time_has_it() {
    use serialport::{SerialPort, TTYPort};

    let (mut board, mut port) = TTYPort::pair().unwrap();
    board.set_timeout(Duration::from_millis(10)).unwrap();
    port.set_exclusive(false).unwrap();
    let name = port.name().unwrap();
    thread::spawn(move || answer_on(board));
    drop(port);
    // A program started by another test may briefly have inherited the port and its lock.
    let mut tries = std::iter::repeat_with(|| open_port(&name, 115_200)).take(1_000);
    let opened = tries.find(|opened| {
        thread::sleep(Duration::from_millis(10));
        !matches!(opened, Err(PortError::InUse { .. }))
    });
    let mut device = Device::identify(opened.unwrap().unwrap(), QUICK, dimsart_modules::ALL).unwrap();
    assert_eq!(device.overview().unwrap().identity.device, "arm");
    assert!(matches!(open_port(&name, 115_200), Err(PortError::InUse { .. })));
}

/// Answers on a stream until the program ends.
#[cfg(unix)]
fn answer_on(mut stream: impl Read + Write) {
    let (mut robot, mut receiver, mut buffer) = (Robot::new(), Receiver::new(), [0; 256]);
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => {
                let mut bytes = Vec::new();
                receiver.push_all(&buffer[..count], |content| bytes.extend(robot.answer(content)));
                stream.write_all(&bytes).unwrap();
            }
            // No bytes yet, or the other end is not open.
            Err(_) => thread::sleep(Duration::from_millis(1)),
        }
    }
}
