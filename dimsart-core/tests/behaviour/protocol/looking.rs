//! Reading changes nothing, and shows the contents of modules' memories.

use crate::common::IDS;
use crate::common::module_at;
use dimsart_core::{Format, ModuleRef, scheme, types};
use dimsart_link::protocol::{
    LeaseAction, MAX_SIGNAL_WORDS, Refusal, Request, Response, SchemeAction, SignalWords,
};

use super::served::{ServedDevice, module};
use super::{SCHEME, SIDES};

const RECORDER: &str = "all RECORDER_MOD LENGTH 30\nall RECORDER_MOD PORT_SIGNAL_IN POSITION\n\
                        all MOD_ENG MOD_ON RECORDER_MOD";
/// Memory of a recorder.
const INPUT: u8 = 0;
const ROWS_KEPT: u8 = 2;

fn load(served: &mut ServedDevice, rows: &str) {
    assert_eq!(scheme::load(rows, "slave", SIDES, &mut served.dimsart, |error| panic!("{error:?}")), 0);
}

fn memory(served: &mut ServedDevice, module: ModuleRef, port: u8, from: u16) -> Option<SignalWords> {
    match served.ask(Request::Memory { module, port, from }) {
        Response::Signal(words) => Some(words),
        Response::Refused(Refusal::NotFound) => None,
        other => panic!("{other:?}"),
    }
}

#[test]
fn no_question_changes_the_controller() {
    let mut served = ServedDevice::new();
    load(&mut served, RECORDER);
    load(&mut served, SCHEME);
    served.tick(0.25);
    let before = (served.state(), served.dimsart.engine().usage());
    let kinds = 0..20;
    let modules = kinds.flat_map(|place| [0, 1, 2].map(|number| module_at(place, number)));
    let of_modules = modules.flat_map(|module| {
        let of_index = move |index| {
            [
                Request::Port { module, index },
                Request::Get { module, parameter: index, entry: index },
                Request::Memory { module, port: index, from: 0 },
                Request::SchemeCommand { place: module.number, index: index.into() },
            ]
        };
        (0..18).flat_map(of_index)
    });
    let of_lists = (0..60).flat_map(|index| {
        [
            Request::Module { place: index },
            Request::Parameter { kind: IDS[usize::from(index)], index: index % 9 },
            Request::DataType { index: index.into() },
            Request::Instance { index },
            Request::Entry { index },
            Request::Finding { index },
            Request::Signal { signal: types::POSITION.first(), from: index.into() },
            Request::Cycles { place: index, clears: false },
        ]
    });
    let others = [
        Request::Identify,
        Request::Status,
        Request::Timing,
        Request::Safety,
        Request::Schemes(SchemeAction::Read),
        Request::Lease(LeaseAction::Read),
    ];
    for request in of_modules.chain(of_lists).chain(others) {
        assert!(!request.changes_device(), "{request:?}");
        served.ask(request);
        assert_eq!((served.state(), served.dimsart.engine().usage()), before, "{request:?}");
    }
}

#[test]
fn a_memory_is_read_in_pieces_as_the_last_tick_left_it() {
    let mut served = ServedDevice::new();
    load(&mut served, RECORDER);
    load(&mut served, SCHEME);
    (0_u8..40).for_each(|tick| served.tick(tick.into()));
    let recorder = module("RECORDER_MOD");
    let mut words = Vec::new();
    while words.len() < 90 {
        let from = u16::try_from(words.len()).unwrap();
        let part = memory(&mut served, recorder, ROWS_KEPT, from).unwrap();
        assert_eq!((part.format, part.total_words), (Format::U32, 90));
        assert!(part.words.len() == MAX_SIGNAL_WORDS || words.len() + part.words.len() == 90);
        words.extend(part.words);
    }
    assert_eq!(Some(words.as_slice()), served.dimsart.engine().memory(recorder));
    let first: Vec<f32> = words.chunks(3).map(|row| f32::from_bits(row[0])).collect();
    let expected: Vec<f32> = (30_u8..40).chain(10..30).map(f32::from).collect();
    assert_eq!(first, expected, "row n lies at n mod LENGTH");
}

#[test]
fn every_module_s_memory_can_be_read_and_nothing_else() {
    let mut served = ServedDevice::new();
    load(&mut served, "all MOD_ENG MOD_ON TIMEDELAY_MOD");
    let delay = module("TIMEDELAY_MOD");
    let ports = served.dimsart.engine().ports(delay).unwrap();
    for (port, spec) in (0..).zip(&ports) {
        let found = memory(&mut served, delay, port, 0).is_some();
        assert_eq!(found, spec.data_type.is_none(), "{}", spec.name);
    }
    assert!(ports.iter().any(|spec| spec.data_type.is_none()), "a delay keeps a line");

    load(&mut served, RECORDER);
    let recorder = module("RECORDER_MOD");
    assert!(memory(&mut served, recorder, ROWS_KEPT, 89).is_some());
    for (module, port, from) in [
        (recorder, INPUT, 0),
        (recorder, 200, 0),
        (recorder, ROWS_KEPT, 91),
        (recorder, ROWS_KEPT, u16::MAX),
        (ModuleRef { number: 2, ..recorder }, ROWS_KEPT, 0),
        (ModuleRef::new("NO_MOD", 1), 0, 0),
    ] {
        assert_eq!(memory(&mut served, module, port, from), None, "{module:?} {port} {from}");
    }
    load(&mut served, "all MOD_ENG MOD_OFF RECORDER_MOD");
    assert_eq!(memory(&mut served, recorder, ROWS_KEPT, 0), None, "not plugged in");
}
