//! Fuzzes the contents of a link to a controller with the bilateral scheme, with and without a valid envelope. A second
//! controller receives only accepted contents and must stay equal, except for the counters of rejected ones.
#![no_main]

use std::cell::RefCell;

use dimsart_core::envelope::{Class, HEADER_BYTES, MAX_CONTENT_BYTES, seal};
use dimsart_core::{Dimsart, LinkState, TypeRef, Word, types};
use dimsart_fuzz::{bilateral, load};
use libfuzzer_sys::fuzz_target;

const TICKS: usize = 12;

thread_local! {
    static TWINS: RefCell<[Dimsart; 2]> = RefCell::new([bilateral(), bilateral()]);
    /// A packet of the scheme's peer.
    static SAMPLE: Vec<u8> = {
        let mut other = bilateral();
        other.tick(&[Word(0); 3], &mut [Word(0); 3]);
        other.take_outgoing(0).unwrap().to_bytes().to_vec()
    };
}

fn signal(dimsart: &Dimsart, signal: TypeRef) -> u32 {
    let data_base = dimsart.engine().data_base();
    data_base.words(data_base.slot(signal).unwrap())[0]
}

/// Runs a tick; forces must be finite.
fn tick(dimsart: &mut Dimsart) {
    let mut forces = [Word(0xDEAD); 3];
    dimsart.tick(&[Word::from(0.25), Word(0), Word::from(-0.5)], &mut forces);
    assert!(forces.iter().all(|force| f32::from_bits(force.0).is_finite()));
    let _ = dimsart.take_outgoing(0);
}

fuzz_target!(|bytes: &[u8]| {
    let sample = SAMPLE.with(Clone::clone);
    TWINS.with_borrow_mut(|[one, twin]| {
        for dimsart in [&mut *one, &mut *twin] {
            load("all MOD_ENG RESET", dimsart);
        }
        let mut rest = bytes;
        for counter in (1_u16..).take(TICKS) {
            let Some((&[kind, length, byte], behind)) = rest.split_first_chunk::<3>() else { break };
            let (own, behind) = behind.split_at(usize::from(length).min(behind.len()).min(60));
            rest = behind;
            let mut buffer = [0; MAX_CONTENT_BYTES];
            // The fuzzer's bytes over the sample's payload in a valid envelope, or these bytes alone.
            let payload = sample.len() - HEADER_BYTES - 4;
            buffer[..sample.len()].copy_from_slice(&sample);
            let place = HEADER_BYTES + usize::from(byte) % payload;
            buffer[place..place + own.len()].copy_from_slice(own);
            let payload = if kind & 8 == 0 { payload } else { own.len() };
            let class = if kind & 0x70 == 0x70 { Class::Telemetry } else { Class::Packet };
            let counter = if kind & 4 == 0 { counter } else { u16::from_le_bytes([kind, byte]) };
            let sealed = seal(class, 0, counter, payload, &mut buffer).unwrap();
            let content = if kind & 3 == 3 { own } else { sealed };

            let _ = one.receive(0, content);
            tick(one);
            let state = signal(one, types::LINK_STATE.first());
            if state != LinkState::Error as u32 && state != LinkState::Repeated as u32 {
                let _ = twin.receive(0, content);
            }
            tick(twin);
            let signals: Vec<_> = one.engine().data_base().signals().collect();
            for (slot, entry) in signals {
                if entry.signal.id != types::LINK_STATE.id && entry.signal.id != types::LINK_REFUSED.id {
                    let [found, expected] =
                        [&*one, &*twin].map(|dimsart| dimsart.engine().data_base().words(slot));
                    assert_eq!(found, expected, "{:?} changed by what was refused", entry.signal);
                }
            }
        }
    });
});
