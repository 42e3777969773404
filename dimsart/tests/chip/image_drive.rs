//! The drive configuration in an image of nucleo-g474re with its shield, patched in the linked image.

use std::mem::offset_of;
use std::sync::Arc;

use cycles::image::Image;
use drive::{Configuration, Encoder, Motor};
use object::{Object as _, ObjectSegment as _, ObjectSymbol as _};

const SYMBOL: &str = "dimsart_drive";

/// Returns the image with the encoder of a configuration, and the address of its zero; `None` without images.
pub(crate) fn configured(name: &str, configuration: &Configuration) -> Option<Arc<Image>> {
    let mut bytes = std::fs::read(test_requirements::image(name)?).unwrap();
    let start = place(&bytes);
    let mut put = |offset: usize, word: u32| {
        bytes[start + offset..start + offset + 4].copy_from_slice(&word.to_le_bytes());
    };
    let (kind, counts) = match configuration.encoder {
        Encoder::Incremental { counts_per_turn } => (0, counts_per_turn),
        Encoder::As5047p => (1, 0),
        Encoder::Mt6701 => (2, 0),
        Encoder::As5600 => (3, 0),
    };
    // `repr(C)`: the kind, then the fields of the first variant.
    let encoder = offset_of!(Configuration, encoder);
    put(encoder, kind);
    put(encoder + 4, counts);
    let offset = offset_of!(Configuration, motor) + offset_of!(Motor, encoder_offset_rad);
    put(offset, configuration.motor.encoder_offset_rad.to_bits());
    Some(Arc::new(Image::read(&bytes).unwrap()))
}

fn place(bytes: &[u8]) -> usize {
    let elf = object::read::elf::ElfFile32::<object::Endianness>::parse(bytes).unwrap();
    let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(SYMBOL)).unwrap();
    assert_eq!(symbol.size(), size_of::<Configuration>() as u64);
    let in_segment = elf.segments().find_map(|segment| {
        let (from, length) = segment.file_range();
        Some(from + symbol.address().checked_sub(segment.address()).filter(|beyond| *beyond < length)?)
    });
    usize::try_from(in_segment.unwrap()).unwrap()
}
