//! Links an image for a board; the board's crate brings the memory map. Names the image.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    let feature = |(name, _): (String, _)| name.strip_prefix("CARGO_FEATURE_").map(str::to_owned);
    let mut features: Vec<String> = env::vars().filter_map(feature).filter(|name| name != "BOARD").collect();
    features.sort();
    let features = features.join("+").replace('_', "-").to_lowercase();
    println!("cargo:rustc-env=DIMSART_IMAGE=dimsart {} {features}", env!("CARGO_PKG_VERSION"));
}
