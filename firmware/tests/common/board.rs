//! A board with schemes in its flash.

use std::cell::RefCell;
use std::collections::BTreeMap;

use dimsart_core::{
    AxisKind, Command, Cost, Costs, DeviceDescriptor, Dimsart, KindId, ModuleRef, ProvidedMemory, Value,
    types,
};
use dimsart_link::protocol::{
    DeviceInfo, MAX_FRAME_BYTES, Receiver, Request, Response, SchemeStatus, answer, decode_response,
    encode_request,
};
use dimsart_link::saved_scheme::{SchemeBytes, save};
use dimsart_modules::ALL;
use embassy_futures::block_on;
use firmware::{SchemeStore, start};

use crate::common::Flash;

/// Watchdog timeout between two ticks on nucleo-g474re, the shortest. Before the first tick it is 512 ms.
const PATIENCE_US: u64 = 10_000;

fn pd() -> ModuleRef {
    ALL.module("PDCTRL_MOD").unwrap()
}

/// Assumes that a tick costs as much as each of its modules.
const COSTS: Costs = Costs::new(&[Cost::new(500, 50); 1 + KINDS], &IDS);
const KINDS: usize = ALL.list().len();
static IDS: [KindId; KINDS] = ALL.ids();

pub(crate) fn controller() -> Dimsart {
    let device = DeviceDescriptor::new(
        "arm",
        &[AxisKind::Linear; 3],
        1e-3,
        &[types::POSITION, types::DES_POSITION],
        &[types::DES_FORCE],
    );
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap();
    dimsart.engine_mut().set_costs(Some(COSTS));
    dimsart
}

thread_local! {
    /// The created schemes by gain.
    static SCHEMES: RefCell<BTreeMap<u16, Vec<u8>>> = const { RefCell::new(BTreeMap::new()) };
}

/// A scheme identified by its gain; a larger size has more modules.
pub(crate) fn scheme(gain: u16) -> Vec<u8> {
    SCHEMES.with_borrow_mut(|schemes| schemes.entry(gain).or_insert_with(|| new_scheme(gain)).clone())
}

fn new_scheme(gain: u16) -> Vec<u8> {
    let mut dimsart = controller();
    let modules = 1 + gain % 10;
    for number in (1..=u8::try_from(modules).unwrap()).rev() {
        let module = ModuleRef { number, ..pd() };
        dimsart.command(Command::set(module, 0, Value::Real(gain.into()))).unwrap();
        if number > 1 {
            for axis in 0..3 {
                let value = Value::Real(f32::from(axis) + 1.0);
                let set = Command::Set { module, parameter: 1, entry: Some(axis), value };
                dimsart.command(set).unwrap();
            }
        }
    }
    dimsart.command(Command::PlugIn(pd())).unwrap();
    dimsart.command(Command::Check).unwrap();
    save(dimsart.engine_mut()).unwrap().to_vec()
}

pub(crate) const BUILT_IN: u16 = 9;

/// A board with this flash.
pub(crate) struct Board {
    pub(crate) store: SchemeStore<Flash>,
    pub(crate) dimsart: Dimsart,
    pub(crate) status: SchemeStatus,
}

/// Flashes with the boards' numbers of pages.
pub(crate) fn blank_flashes() -> [Flash; 2] {
    [Flash::of_pages(2), Flash::new()]
}

/// A store in the whole flash.
pub(crate) fn store(flash: Flash) -> SchemeStore<Flash> {
    let range = 0..u32::try_from(flash.bytes.len()).unwrap();
    SchemeStore::new(flash, range).unwrap()
}

impl Board {
    /// Starts like a board, without erasing a page: the watchdog timeout is too short for that.
    pub(crate) fn start(flash: Flash) -> Self {
        let (patience_us, erasures) = (flash.patience_us, flash.erasures.clone());
        let mut store = store(Flash { patience_us: PATIENCE_US, ..flash });
        let mut dimsart = controller();
        let status =
            block_on(start(Some(&mut store), &mut SchemeBytes::new(), &scheme(BUILT_IN), &mut dimsart));
        assert_eq!(store.flash().erasures, erasures, "erased by a start: {status:?}");
        store.flash().patience_us = patience_us;
        Self { store, dimsart, status }
    }

    /// Returns the gain of the running scheme, after checking that the scheme is complete and commands are
    /// answered.
    pub(crate) fn running(&mut self) -> u16 {
        assert!(self.dimsart.engine().is_running());
        let value = self.dimsart.engine_mut().get(pd(), 0, 0).unwrap();
        let gain = (0..=u16::MAX).find(|gain| value == Value::Real(f32::from(*gain))).unwrap();
        assert_eq!(
            save(self.dimsart.engine_mut()).unwrap().as_slice(),
            scheme(gain),
            "a part of scheme {gain}"
        );
        let mut frame = [0; MAX_FRAME_BYTES];
        let frame = encode_request(&Request::Identify, 7, &mut frame).unwrap();
        let (mut receiver, mut answers) = (Receiver::new(), 0);
        receiver.push_all(frame, |content| {
            let mut buffer = [0; MAX_FRAME_BYTES];
            let mut info: DeviceInfo = DeviceInfo::new("test").with_laws();
            let frame = answer(content, &mut self.dimsart, &mut info, &mut buffer).unwrap().unwrap();
            Receiver::new().push_all(frame, |content| {
                let response = decode_response(content).unwrap();
                assert!(matches!(response, (7, Response::Identity(_))));
                answers += 1;
            });
        });
        assert_eq!(answers, 1);
        gain
    }
}
