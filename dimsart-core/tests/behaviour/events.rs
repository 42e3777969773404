//! Events of a controller about faults and resets.

use dimsart_core::{Command, SafetyReason, types};
use dimsart_link::protocol::{DeviceInfo, Request, request_id, serve};
use dimsart_link::{EventKind, EventLog};

use crate::common::{self, Bench};

/// Numbers of the events, oldest first.
fn events(log: &EventLog) -> Vec<u8> {
    (0..u8::MAX).filter_map(|back| log.get(back)).map(|event| event.what).rev().collect()
}

#[test]
fn a_can_bus_is_logged_when_it_changes() {
    let log: &EventLog = Box::leak(Box::new(EventLog::new()));
    let mut info: DeviceInfo = DeviceInfo::new("bench").with_events(log);
    let [left, joined, given_up] =
        [EventKind::BusOff, EventKind::BusRejoined, EventKind::BusOffPermanent].map(|kind| kind as u8);
    for what in [joined, joined, left, left, joined, left, given_up, given_up, left, joined] {
        info.log_bus_event(what);
    }
    assert_eq!(events(log), [left, joined, left, given_up, left, joined]);
}

/// Without this event the log would end with the reset, although the device does not move.
#[test]
fn a_fault_that_is_there_again_behind_a_reset_is_told_again() {
    let log: &EventLog = Box::leak(Box::new(EventLog::new()));
    let mut info: DeviceInfo = DeviceInfo::new("bench").with_events(log);
    let mut bench = Bench::of(1, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    bench.run("PDCTRL_MOD K_PARAM 1000\nMOD_ENG MOD_ON PDCTRL_MOD");
    let tick = |bench: &mut Bench, info: &mut DeviceInfo, position_m: f32| {
        let (tick, _) = bench.try_tick(&common::words(&[position_m, 0.0]));
        info.end_tick(tick, &bench.dimsart);
    };
    let reset = |bench: &mut Bench, info: &mut DeviceInfo| {
        let _ = serve(request_id(1, 1), &Request::Command(Command::Reset), &mut bench.dimsart, info);
    };
    for position_m in [f32::NAN, f32::NAN] {
        tick(&mut bench, &mut info, position_m);
    }
    reset(&mut bench, &mut info);
    tick(&mut bench, &mut info, f32::NAN);
    tick(&mut bench, &mut info, 1e30);
    reset(&mut bench, &mut info);
    tick(&mut bench, &mut info, 1e30);
    reset(&mut bench, &mut info);
    tick(&mut bench, &mut info, 0.0);
    let [refused, failed] =
        [SafetyReason::MeasurementRefused, SafetyReason::ModuleFailed].map(SafetyReason::number);
    let (reset, cut_out) = (EventKind::Reset as u8, EventKind::ModuleIsolated as u8);
    assert_eq!(events(log), [refused, reset, refused, cut_out, reset, failed, reset, 0]);
}
