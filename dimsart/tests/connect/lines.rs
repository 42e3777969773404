//! Bad lines, devices of other versions, and other peers than devices.

use std::net::TcpListener;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use dimsart::connect::{ConnectError, Device, LineError, Timeouts};
use dimsart_link::protocol::{
    MAX_FRAME_BYTES, OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION, Refusal, Request, Response, decode_request,
    encode_response, serve,
};
use hil_sim::link::open_port;
use hil_sim::schemes::SchemeText;

use crate::emulated::{Emulated, Faults, QUICK, Robot, SHORT, dimsart, listen, message};

#[test]
fn noise_loss_and_delay_change_no_answer() {
    let clean = Emulated::start();
    let script =
        "all PDCTRL_MOD K_PARAM 7\nall PDCTRL_MOD D_PARAM 3\nall PDCTRL_MOD PORT_DES_POSITION POSITION\n";
    let patience = Timeouts { timeout: Duration::from_millis(50), tries: 200 };
    let mut device = clean.connect(patience);
    device
        .send_scheme(&SchemeText { name: "my.scheme".to_owned(), text: script.to_owned() }, "master")
        .unwrap();
    let expected = device.overview().unwrap();
    for faults in [
        Faults { noise_bytes: 300, ..Faults::default() },
        Faults { drop_one_in: 200, ..Faults::default() },
        Faults { late_each: 50, noise_bytes: 20, drop_one_in: 500, ..Faults::default() },
    ] {
        let emulated = Emulated::on(faults);
        let mut device = emulated.connect(patience);
        device
            .send_scheme(&SchemeText { name: "my.scheme".to_owned(), text: script.to_owned() }, "master")
            .unwrap();
        assert_eq!(device.overview().unwrap(), expected);
        assert_eq!(emulated.state(), clean.state());
    }
}

#[test]
fn an_answer_that_comes_after_its_question_was_repeated_is_not_taken_for_the_next_one() {
    let emulated = Emulated::on(Faults { late_commands_each: 6, ..Faults::default() });
    let mut device = emulated.connect(Timeouts { timeout: Duration::from_millis(50), tries: 200 });
    for value in ["11", "12", "13", "14", "15"] {
        for (name, value) in [("K_PARAM", value.to_owned()), ("D_PARAM", format!("1{value}"))] {
            let outcome = device.set("PDCTRL_MOD", name, &value).unwrap();
            let expected = format!("PDCTRL_MOD {name} is {value}  {value}  {value} ");
            assert!(outcome.effect.starts_with(&expected), "{outcome}");
        }
    }
    assert!(emulated.robot.lock().unwrap().commands > 10, "no answer was late");
}

#[test]
fn a_device_that_never_answers_is_given_up_after_three_tries() {
    let port = listen(|_| Vec::new());
    let error = Device::identify(open_port(&port, 0).unwrap(), SHORT, dimsart_modules::ALL).unwrap_err();
    assert!(matches!(error, ConnectError::Line(LineError::NoAnswer { tries: 3, bytes: 0, .. })), "{error}");
    let found = message(&dimsart(&["connect", &port, "--timeout-s", "0.1", "show"]));
    assert!(
        found.starts_with(&format!(
            "dimsart: {port}: no answer from the device: request sent 3 times, waited 0.1 s each"
        )),
        "{found}"
    );
    assert!(found.contains("no bytes received: check the board's power"), "{found}");
}

#[test]
fn something_that_is_no_controller_is_told_from_silence() {
    let port = listen(|_| b"login: ".to_vec());
    let message =
        Device::identify(open_port(&port, 0).unwrap(), SHORT, dimsart_modules::ALL).unwrap_err().to_string();
    assert!(message.contains("21 bytes received, but no whole frame"), "{message}");
    assert!(message.contains("--baud"), "{message}");
}

#[test]
fn a_command_that_must_not_be_given_twice_is_sent_once() {
    let robot = Arc::new(Mutex::new(Robot::new()));
    let shared = Arc::clone(&robot);
    // Carries out all requests, and answers all but commands.
    let port = listen(move |content| {
        let answer = shared.lock().unwrap().answer(content);
        if matches!(decode_request(content), Ok((_, Request::Command(_)))) { Vec::new() } else { answer }
    });
    let mut device = Device::identify(open_port(&port, 0).unwrap(), SHORT, dimsart_modules::ALL).unwrap();
    let error = device.plug_in("PDCTRL_MOD", None).unwrap_err();
    assert!(matches!(error, ConnectError::Line(LineError::OutcomeUnknown { .. })), "{error}");
    assert!(error.to_string().contains("run `show` before you repeat it"), "{error}");
    assert_eq!(robot.lock().unwrap().commands, 1);
    let error = device.set("PDCTRL_MOD", "K_PARAM", "1").unwrap_err();
    assert!(matches!(error, ConnectError::Line(LineError::NoAnswer { tries: 3, .. })), "{error}");
    assert_eq!(robot.lock().unwrap().commands, 4);
}

/// A device that reports protocol `version` and answers `Status` with `status`.
fn of_version(version: u16, mut status: impl FnMut(u16) -> Vec<u8> + Send + 'static) -> String {
    let mut robot = Robot::new();
    listen(move |content| {
        let Ok((id, request)) = decode_request(content) else { return Vec::new() };
        let mut response = serve(id, &request, &mut robot.dimsart, &mut robot.info);
        if let Response::Identity(identity) = &mut response {
            identity.protocol_version = version;
        }
        if request == Request::Status {
            return status(id);
        }
        encode_response(&response, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
    })
}

#[test]
fn a_device_too_old_to_be_understood_is_told_at_once() {
    let port = of_version(OLDEST_PROTOCOL_VERSION - 1, |_| Vec::new());
    let output = dimsart(&["connect", &port, "show"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let error = String::from_utf8(output.stderr).unwrap();
    let versions = format!(
        "protocol version mismatch: device {}, this command {PROTOCOL_VERSION}; ",
        OLDEST_PROTOCOL_VERSION - 1
    );
    assert!(error.contains(&versions), "{error}");
    assert!(error.contains("use the `dimsart` of the image's version, or flash a current image"), "{error}");
}

#[test]
fn a_device_of_another_version_answers_what_it_knows_and_refuses_the_rest_by_name() {
    let refused = Response::Refused(Refusal::Unsupported);
    let port = of_version(PROTOCOL_VERSION + 1, move |id| {
        encode_response(&refused, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
    });
    let output = dimsart(&["connect", &port, "watch", "MAP", "--once"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let note = String::from_utf8(output.stderr).unwrap();
    assert!(
        note.contains(&format!(
            "the device has protocol version {}, this program {PROTOCOL_VERSION}",
            PROTOCOL_VERSION + 1
        )),
        "{note}"
    );
    let found = message(&dimsart(&["connect", &port, "show"]));
    assert!(found.contains("unknown request: the device uses another protocol version"), "{found}");
}

#[test]
fn an_answer_of_a_newer_version_is_not_taken_for_silence() {
    let port = of_version(PROTOCOL_VERSION + 1, |id| {
        // A response that is unknown in this version; the CRC includes the channel, which is 0.
        let [low, high] = id.to_le_bytes();
        let mut content = vec![2, low, high, 250];
        let crc =
            crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR).checksum(&[&[0; 4], content.as_slice()].concat());
        content.extend(crc.to_le_bytes());
        [&[0], cobs::encode_vec(&content).as_slice(), &[0]].concat()
    });
    let mut device = Device::identify(open_port(&port, 0).unwrap(), QUICK, dimsart_modules::ALL).unwrap();
    let note = device.version_note().unwrap();
    assert!(note.contains("only reading and `stop` are possible"), "{note}");
    assert!(note.ends_with("use the `dimsart` of the image's version for full access"), "{note}");
    let error = device.overview().unwrap_err();
    assert!(matches!(error, ConnectError::Line(LineError::Unsupported)), "{error}");
    assert!(error.to_string().contains("use the `dimsart` of the image's version"), "{error}");
    assert!(matches!(device.plug_in("PDCTRL_MOD", None), Err(ConnectError::ReadOnly(_))));
    assert_eq!(device.signals(&[]).unwrap()[0].name, "POSITION", "reading is possible");
}

#[test]
fn a_device_that_goes_away_is_no_silence() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    thread::spawn(move || drop(listener.accept()));
    let error = Device::identify(open_port(&port, 0).unwrap(), QUICK, dimsart_modules::ALL).unwrap_err();
    assert!(matches!(error, ConnectError::Line(LineError::Closed)), "{error}");
}
