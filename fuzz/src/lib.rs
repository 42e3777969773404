//! Common code of the fuzz targets: controllers with shipped schemes.

use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, ProvidedMemory, scheme, types};
use dimsart_modules::ALL;

/// The sides of the shipped schemes.
pub const SIDES: &[&str] = &["master", "slave"];

/// Returns an arm with three linear axes.
#[must_use]
pub fn arm() -> DeviceDescriptor {
    let axes = [AxisKind::Linear; 3];
    DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]).unwrap()
}

/// Returns a controller of an [`arm`] without modules.
#[must_use]
pub fn controller() -> Dimsart {
    Dimsart::new(ProvidedMemory::leak_default(), arm(), ALL).unwrap()
}

/// Loads valid rows into a controller.
pub fn load(rows: &str, dimsart: &mut Dimsart) {
    let failed = scheme::load(rows, "slave", SIDES, dimsart, |error| eprintln!("{error:?}"));
    assert_eq!(failed, 0);
}

/// Returns a slave running the paper's bilateral scheme.
#[must_use]
pub fn bilateral() -> Dimsart {
    let mut dimsart = controller();
    load(include_str!("../../schemes/bilateral.scheme"), &mut dimsart);
    dimsart
}
