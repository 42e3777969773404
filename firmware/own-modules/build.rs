//! Includes a project's modules: `DIMSART_MODULES` is the path of a Rust file with a list of kinds named
//! `OWN`.

use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-env-changed=DIMSART_MODULES");
    let text = match env::var_os("DIMSART_MODULES").map(PathBuf::from) {
        None => "/// None.\npub const OWN: dimsart_core::ModuleKinds = dimsart_core::ModuleKinds::NONE;\n"
            .to_owned(),
        Some(path) => {
            let file = fs::canonicalize(&path).map_err(|error| {
                format!("DIMSART_MODULES: {}: {error}; set it to the path of a Rust file", path.display())
            })?;
            println!("cargo:rerun-if-changed={}", file.with_file_name("").display());
            format!(
                "#[allow(missing_docs, unreachable_pub, dead_code, clippy::all)]\n\
                 #[path = {file:?}]\n\
                 mod own;\n\
                 pub use own::OWN;\n"
            )
        }
    };
    let out = env::var_os("OUT_DIR").ok_or("OUT_DIR is not set by cargo")?;
    fs::write(PathBuf::from(out).join("own_modules.rs"), text).map_err(|error| error.to_string())
}
