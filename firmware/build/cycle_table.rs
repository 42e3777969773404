//! The sequences of the crate `cycles`, as code with the model's figures.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use cycles::sequences::{RETURN, sequences};
use cycles::timing::{Column, Profile, Timing};

/// Number of `NOP`s in the reference sequence; each takes one cycle.
const NOPS: usize = 64;
const NOP: u16 = 0xBF00;

/// Writes the file that the image includes.
pub(crate) fn write(file: &Path) -> Result<(), String> {
    let mut code = assembly("empty", [].into_iter());
    code += &assembly("nops", std::iter::repeat_n(NOP, NOPS));
    let (mut names, mut rows) = ("cycle_empty cycle_nops".to_owned(), String::new());
    for (number, sequence) in sequences().enumerate() {
        let count = |column| {
            sequence.count(Timing::new(Profile::ZeroWait, column)).map_err(|error| error.to_string())
        };
        let (typical, upper) = (count(Column::Likely)?, count(Column::Upper)?);
        code += &assembly(&number.to_string(), sequence.halfwords());
        let _ = write!(names, " cycle_{number}");
        let _ = writeln!(
            rows,
            "Sequence {{ row: {:?}, text: {:?}, code: cycle_{number}, instructions: {}, typical: {}, upper: {} }},",
            sequence.row, sequence.text, typical.instructions, typical.cycles, upper.cycles
        );
    }
    let text = format!(
        "pub(super) const NOPS: u32 = {NOPS};\n\
         core::arch::global_asm!(\".section .text.cycle_table, \\\"ax\\\"\", \".thumb\",\n{code});\n\
         code! {{ {names} }}\n\
         pub(super) static SEQUENCES: &[Sequence] = &[\n{rows}];\n"
    );
    fs::write(file, text).map_err(|error| format!("cannot write {}: {error}", file.display()))
}

/// Returns the function of a sequence, aligned to 4 bytes.
fn assembly(name: &str, halfwords: impl Iterator<Item = u16>) -> String {
    let halfwords: Vec<String> = halfwords.chain(RETURN).map(|halfword| format!("{halfword:#06x}")).collect();
    format!("\".balign 4\", \".thumb_func\", \"cycle_{name}: .hword {}\",\n", halfwords.join(", "))
}
