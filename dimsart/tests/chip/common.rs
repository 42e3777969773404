//! A board for a test.

use std::path::PathBuf;
use std::sync::Arc;

use chips::{Bench, Board};
use cycles::image::Image;

/// The board of a name on the bench, with its image; none where no images are.
pub(crate) fn bench(name: &str) -> Option<Bench> {
    let board = Board::named(name).unwrap();
    Some(Bench::new(board, image(name)?).unwrap())
}

/// An image by its name.
pub(crate) fn image(name: &str) -> Option<Arc<Image>> {
    let bytes = std::fs::read(image_file(name)?).unwrap();
    Some(Arc::new(Image::read(&bytes).unwrap()))
}

/// The file of an image; none, after a line that says so, where no images are.
pub(crate) fn image_file(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("DIMSART_FIRMWARE");
    let is_required = folder.is_some();
    let file = folder.map_or_else(|| PathBuf::from("../target/images"), PathBuf::from).join(name);
    if file.exists() {
        return Some(file);
    }
    assert!(!is_required, "{} is missing", file.display());
    eprintln!("skipped: no image {}; `cargo xtask test` builds it", file.display());
    None
}

/// What the drivers of `embassy-stm32` 0.6 do against the manual, and is harmless: they write 1 to reserved bits of
/// registers in which writing 1 does something to bits that exist.
pub(crate) fn is_known(violation: &str) -> bool {
    violation.contains("FDCAN1_TXBTIE gets 0xffffffff")
        || violation.contains("RT1_ICR gets")
        || violation.contains("USART2_ICR gets")
}

/// Violations that are not known.
pub(crate) fn violations(bench: &Bench) -> Vec<String> {
    bench.violations().into_iter().filter(|violation| !is_known(violation)).collect()
}
