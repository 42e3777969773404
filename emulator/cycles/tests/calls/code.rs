//! Images built from single functions.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "test code")]

use cycles::image::{Function, Image, Segment};
use cycles::instruction::decode_all;

/// Address of the vector table.
const TABLE: u32 = 0x0800_0000;
/// Address of the first function; one function every [`ROOM`] bytes.
const BEGIN: u32 = 0x0800_0100;
const ROOM: u32 = 0x40;
/// Bottom of the stack.
const BOTTOM: u32 = 0x2000_0000;
/// Top of the stack.
const TOP: u32 = 0x2000_0400;

/// A function: its name and its code, in halfwords.
pub(crate) type Code = (&'static str, Vec<u16>);

/// Start address of the function with this index.
pub(crate) fn address(function: usize) -> u32 {
    BEGIN + ROOM * u32::try_from(function).unwrap()
}

/// `BL` from a halfword of a function to another function.
pub(crate) fn call(from: usize, halfword: usize, to: usize) -> [u16; 2] {
    branch(from, halfword, to, 0xD000)
}

/// `B.W`, like [`call`].
pub(crate) fn jump(from: usize, halfword: usize, to: usize) -> [u16; 2] {
    branch(from, halfword, to, 0x9000)
}

fn branch(from: usize, halfword: usize, to: usize, kind: u16) -> [u16; 2] {
    let at = address(from) + 2 * u32::try_from(halfword).unwrap() + 4;
    let offset = address(to).wrapping_sub(at) >> 1;
    let bits = |shift: u32, mask: u32| u16::try_from(offset >> shift & mask).unwrap();
    let sign = bits(23, 1);
    let j = |shift| !(bits(shift, 1) ^ sign) & 1;
    [0xF000 | sign << 10 | bits(11, 0x3FF), kind | j(22) << 13 | j(21) << 11 | bits(0, 0x7FF)]
}

/// An image of these functions; the vector table contains indices of functions, or `NONE` for zero entries.
pub(crate) fn image(functions: &[Code], vectors: &[usize]) -> Image {
    let mut image = Image::default();
    let mut text = vec![0; usize::try_from(ROOM).unwrap() * functions.len()];
    for (number, (name, code)) in functions.iter().enumerate() {
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        let (address, length) = (address(number), u32::try_from(bytes.len()).unwrap());
        for instruction in decode_all(address, &bytes).flatten() {
            image.code.insert(instruction.address, instruction);
        }
        let names = name.split(" = ").map(str::to_owned).collect();
        image.functions.insert(address, Function { address, bytes: length, names });
        let start = usize::try_from(address - BEGIN).unwrap();
        text[start..start + bytes.len()].copy_from_slice(&bytes);
    }
    let entry = |number: &usize| if *number == usize::MAX { 0 } else { address(*number) | 1 };
    let table = [TOP].into_iter().chain(vectors.iter().map(entry));
    let table: Vec<u8> = table.flat_map(u32::to_le_bytes).collect();
    let symbols = [
        ("__vector_table", TABLE),
        ("__stext", TABLE + u32::try_from(table.len()).unwrap()),
        ("_stack_start", TOP),
        ("_stack_end", BOTTOM),
    ];
    image.symbols.extend(symbols.map(|(name, address)| (name.to_owned(), address)));
    let segment = |address, bytes| Segment { address, load_address: address, bytes, is_writable: false };
    image.segments = vec![segment(TABLE, table), segment(BEGIN, text)];
    image
}
