//! Stored schemes of a board, from `dimsart connect PORT save` to the start that runs them.

use std::fs;
use std::process::Command;

use crc::{CRC_32_AUTOSAR, Crc};
use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, ProvidedMemory, types};
use dimsart_link::protocol::{
    MAX_FRAME_BYTES, Receiver, Request, Response, SchemeAction, decode_heartbeat, decode_response,
    encode_request, request_id,
};
use dimsart_link::saved_scheme::{SAVED_SCHEME_VERSION, fingerprint};
use dimsart_modules::ALL;
use rand_core::{Rng, SeedableRng};

use crate::firmware::Firmware;

const FLASH: &str = "flash";
const FLASH_BYTES: usize = 8192;
const ON_TRIAL: &str = "started with the scheme on trial\nrun `confirm` to keep the scheme; without `confirm` the next \
                        start runs";
const NOT_AGAIN: &str = "the scheme on trial does not run again: `save` another scheme";

/// Returns the output of `dimsart connect`.
fn connect(firmware: &Firmware, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dimsart"));
    let output =
        command.args(["connect", &firmware.port(), "--timeout-s", "5"]).args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Checks the `show` output about the start.
fn assert_shows(firmware: &Firmware, start: &str, damping: u8) {
    let show = connect(firmware, &["show"]);
    assert!(show.contains(&format!("\n{start}\n")), "{start}: {show}");
    let value = connect(firmware, &["get", "WTRANSF_MOD", "B_PARAM"]);
    assert!(value.starts_with(&format!("B_PARAM = {damping} N")), "{value}");
    let state = connect(firmware, &["check"]);
    // Its scheme has a link without a peer.
    assert!(state.contains("link down (reason 46)"), "{state}");
}

fn set_and_save(firmware: &Firmware, damping: &str) {
    connect(firmware, &["set", "WTRANSF_MOD", "B_PARAM", damping]);
    let saved = connect(firmware, &["save"]);
    assert!(saved.contains("the next start runs the scheme on trial"), "{saved}");
}

#[test]
fn a_scheme_is_kept_when_its_trial_is_confirmed_and_only_then() {
    let Some(mut firmware) = Firmware::start(false) else { return };
    assert_shows(&firmware, "started with the built-in scheme", 10);

    set_and_save(&firmware, "20");
    firmware.restart();
    assert_shows(&firmware, &format!("{ON_TRIAL} the built-in scheme"), 20);
    firmware.restart();
    let unconfirmed = "the scheme on trial was started before and not confirmed";
    let rolled_back = format!("started with the built-in scheme: {unconfirmed}");
    assert_shows(&firmware, &format!("{rolled_back}\n{NOT_AGAIN}"), 10);

    set_and_save(&firmware, "30");
    firmware.restart();
    assert_eq!(connect(&firmware, &["confirm"]), "started with the scheme on trial\n");
    for _ in 0..2 {
        firmware.restart();
        assert_shows(&firmware, "started with the saved scheme", 30);
    }
}

#[test]
fn whatever_the_flash_holds_the_board_runs_a_scheme_and_says_why_it_is_the_built_in_one() {
    let Some(mut firmware) = Firmware::start(false) else { return };
    firmware.end();
    let mut random = rand_pcg::Pcg32::seed_from_u64(5);
    for length in [FLASH_BYTES, FLASH_BYTES, 3, 0] {
        let mut noise = vec![0; length];
        random.fill_bytes(&mut noise);
        fs::write(firmware.folder().join(FLASH), noise).unwrap();
        firmware.restart();
        let reason = "started with the built-in scheme: the scheme storage is unreadable or contains other data: `save` \
                      the scheme again";
        assert_shows(&firmware, reason, 10);
        if length == FLASH_BYTES {
            set_and_save(&firmware, "20");
            firmware.restart();
            // The noise in the other page may have been newer.
            let start = ON_TRIAL.replace(
                '\n',
                ": a storage entry is damaged or incomplete, an older entry was loaded: `save` the scheme again\n",
            );
            assert_shows(&firmware, &format!("{start} the built-in scheme"), 20);
        }
        firmware.end();
    }
}

#[test]
fn a_scheme_of_another_image_is_not_run() {
    let Some(mut firmware) = Firmware::start(false) else { return };
    set_and_save(&firmware, "20");
    firmware.end();
    let path = firmware.folder().join(FLASH);
    let mut flash = fs::read(&path).unwrap();
    change_fingerprint(&mut flash);
    fs::write(path, flash).unwrap();
    firmware.restart();
    let reason = "started with the built-in scheme: cannot load the scheme on trial: saved by an image with \
                  other modules, parameters or data types: save the scheme again";
    assert_shows(&firmware, &format!("{reason}\n{NOT_AGAIN}"), 10);
}

/// Converts the scheme in a flash to one of an image with other modules: only its fingerprint differs.
fn change_fingerprint(flash: &mut [u8]) {
    // Item format of `firmware/src/items.rs`: key, 0, length u16, CRC-32 of these and of the following bytes.
    const HEADER: usize = 8;
    let device = DeviceDescriptor::new("any", &[AxisKind::Linear], 1e-3, &[types::POSITION], &[]).unwrap();
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap();
    let print = fingerprint(dimsart.engine_mut()).to_le_bytes();
    let place = flash.windows(5).position(|bytes| bytes[0] == SAVED_SCHEME_VERSION && bytes[1..] == print);
    let item = &mut flash[place.unwrap() - HEADER..];
    let (header, rest) = item.split_first_chunk_mut::<HEADER>().unwrap();
    let scheme = &mut rest[..usize::from(u16::from_le_bytes([header[2], header[3]]))];
    let crc = Crc::<u32>::new(&CRC_32_AUTOSAR);
    let sum = |header: &[u8], scheme: &[u8]| crc.checksum(&[&header[..4], scheme].concat()).to_le_bytes();
    assert_eq!(header[4..], sum(header, scheme));

    scheme[1] ^= 1;
    let (content, end) = scheme.split_last_chunk_mut::<4>().unwrap();
    *end = crc.checksum(content).to_le_bytes();
    let sum = sum(header, scheme);
    header[4..].copy_from_slice(&sum);
}

#[test]
fn timing_is_in_show_and_in_the_data_base() {
    let Some(firmware) = Firmware::start(false) else { return };
    let show = connect(&firmware, &["show"]);
    assert!(show.contains("0 ticks started late, 0 overran; tick: last "), "{show}");
    let signals = dimsart_core::types::TIMING.map(|signal| signal.name);
    let text = connect(&firmware, &[&["watch", "--once"], signals.as_slice()].concat());
    for name in signals {
        assert!(text.contains(name), "{name}: {text}");
    }
}

/// A save takes one tick per command of the scheme: some heartbeat falls into it.
#[test]
fn the_heart_beats_on_while_a_scheme_is_collected() {
    let Some(firmware) = Firmware::start(false) else { return };
    let mut uart = firmware.uart();
    let requests = [Request::Status, Request::Schemes(SchemeAction::Save), Request::Status];
    let mut burst = Vec::new();
    for (number, request) in (0..).zip(&requests) {
        let frame =
            encode_request(request, request_id(1, number), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec();
        burst.extend(frame);
    }
    let (mut receiver, mut buffer) = (Receiver::new(), [0; 256]);
    for _ in 0..1000 {
        let (mut ticks, mut beats, mut is_saved) = (Vec::new(), Vec::new(), false);
        uart.write_all(&burst).unwrap();
        while ticks.len() < 2 {
            let Ok(count) = uart.read(&mut buffer) else { continue };
            receiver.push_all(&buffer[..count], |content| match decode_response(content) {
                Ok((_, Response::Status(status))) => ticks.push(status.ticks),
                Ok((_, Response::Schemes(_))) => is_saved = true,
                _ => beats.extend(decode_heartbeat(content).map(|(_, beat)| (beat.ticks, is_saved))),
            });
        }
        assert!(is_saved && ticks[1] > ticks[0] + 10, "{ticks:?}");
        // In the first half it was created while the scheme was collected; the collected scheme is written after that.
        let half = ticks[0].midpoint(ticks[1]);
        if let Some((_, is_after)) = beats.iter().find(|(at, _)| ticks[0] + 2 < *at && *at < half) {
            assert!(!is_after, "heartbeats only after all saves: {ticks:?} {beats:?}");
            return;
        }
    }
    panic!("no heartbeat in any save");
}
