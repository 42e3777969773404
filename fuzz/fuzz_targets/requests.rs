//! Fuzzes the command line: the receiver resynchronises and the controller responds.
#![no_main]

use std::cell::RefCell;

use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, ProvidedMemory, types};
use dimsart_link::protocol::{DeviceInfo, MAX_FRAME_BYTES, Receiver, Request, answer, encode_request};
use dimsart_modules::ALL;
use libfuzzer_sys::fuzz_target;

thread_local! {
    static CONTROLLER: RefCell<Dimsart> = RefCell::new(controller());
}

fn controller() -> Dimsart {
    let axes = [AxisKind::Linear; 3];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]).unwrap();
    Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap()
}

fuzz_target!(|bytes: &[u8]| {
    CONTROLLER.with_borrow_mut(|controller| {
        let (mut receiver, mut info) = (Receiver::new(), <DeviceInfo>::new("fuzz").with_laws());
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut carried_out = 0;
        receiver.push_all(bytes, |content| {
            carried_out += 1;
            answer(content, controller, &mut info, &mut frame).unwrap();
        });
        assert_eq!(receiver.counters().frames, carried_out);

        // Bypasses the checksum, which a fuzzer does not find by chance.
        let _ = answer(bytes, controller, &mut info, &mut frame).unwrap();

        let mut request = [0; MAX_FRAME_BYTES];
        let request = encode_request(&Request::Identify, 7, &mut request).unwrap();
        let mut answers = 0;
        receiver.push_all(request, |content| {
            answers += usize::from(answer(content, controller, &mut info, &mut frame).unwrap().is_some());
        });
        assert_eq!(answers, 1, "the next good frame is answered");
    });
});
