//! What several fuzz targets need: controllers as they ship.

use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, ProvidedMemory, scheme, types};
use dimsart_modules::ALL;

/// The sides that the shipped schemes are for.
pub const SIDES: &[&str] = &["master", "slave"];

/// An arm of three linear axes without a module.
#[must_use]
pub fn arm() -> DeviceDescriptor {
    let axes = [AxisKind::Linear; 3];
    DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]).unwrap()
}

/// A controller of an [`arm`] without a module.
#[must_use]
pub fn controller() -> Dimsart {
    Dimsart::new(ProvidedMemory::leaked(), arm(), ALL).unwrap()
}

/// Gives rows to a controller; they must all be right.
pub fn load(rows: &str, dimsart: &mut Dimsart) {
    let failed = scheme::load(rows, "slave", SIDES, dimsart, |error| eprintln!("{error:?}"));
    assert_eq!(failed, 0);
}

/// The paper's bilateral scheme, running on the slave.
#[must_use]
pub fn bilateral() -> Dimsart {
    let mut dimsart = controller();
    load(include_str!("../../schemes/bilateral.scheme"), &mut dimsart);
    dimsart
}
