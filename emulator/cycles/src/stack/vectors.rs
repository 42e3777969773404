//! Interrupt handlers and their priorities.

use super::StackError;
use crate::image::Image;

/// Exceptions with a fixed priority, by vector number.
const FIXED: [(usize, i16); 2] = [(NON_MASKABLE, -2), (HARD_FAULT, -1)];
const RESET: usize = 1;
const NON_MASKABLE: usize = 2;
const HARD_FAULT: usize = 3;
/// Handler of exceptions that never occur.
const DEFAULT: &str = "DefaultHandler";

/// The program's entry and every interrupt handler that can run, with its priority; the program has no
/// priority.
pub(super) fn levels(
    image: &Image,
    priorities: &[(&str, i16)],
) -> Result<Vec<(Option<i16>, u32)>, StackError> {
    let mut levels = Vec::new();
    for (vector, handler) in vectors(image)? {
        let fixed = FIXED.iter().find(|(fixed, _)| *fixed == vector);
        let declared = priorities.iter().find(|(name, _)| has_name(image, handler, name));
        match (fixed, declared) {
            _ if vector == RESET => levels.push((None, handler)),
            _ if has_name(image, handler, DEFAULT) => {}
            (Some((_, priority)), _) | (None, Some((_, priority))) => levels.push((Some(*priority), handler)),
            (None, None) => return Err(StackError::NoPriority { handler: image.location(handler) }),
        }
    }
    Ok(levels)
}

fn has_name(image: &Image, address: u32, name: &str) -> bool {
    let function = image.functions.get(&address);
    function.is_some_and(|function| function.names.iter().any(|known| known == name))
}

/// Handlers of the vector table with their vector numbers, without duplicates.
fn vectors(image: &Image) -> Result<Vec<(usize, u32)>, StackError> {
    let begin = super::symbol(image, "__vector_table")?;
    let end = super::symbol(image, "__stext")?;
    let bytes = usize::try_from(end.saturating_sub(begin)).unwrap_or(0);
    let table = image.bytes(begin, bytes).ok_or(StackError::NoSymbol { name: "__vector_table" })?;
    let words = table.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word));
    let mut vectors: Vec<(usize, u32)> = Vec::new();
    for (vector, word) in words.enumerate().skip(RESET) {
        let handler = word & !1;
        if word == 0 || vectors.iter().any(|(_, known)| *known == handler) {
            continue;
        }
        if !image.functions.contains_key(&handler) {
            return Err(StackError::NoHandler { vector, address: word });
        }
        vectors.push((vector, handler));
    }
    Ok(vectors)
}
