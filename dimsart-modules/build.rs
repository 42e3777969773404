//! Takes the modules of a project outside this repository in: `DIMSART_MODULES` is the path of a Rust file with a list of
//! kinds called `OWN`. Without it there are those of the library.

use std::path::PathBuf;
use std::{env, fs};

const NONE: &str =
    "/// Modules of a project outside the library: none.\npub const OWN: Kinds = Kinds::NONE;\n";

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-env-changed=DIMSART_MODULES");
    let text = match env::var_os("DIMSART_MODULES").filter(|path| !path.is_empty()) {
        None => NONE.to_owned(),
        Some(path) => {
            let file = fs::canonicalize(&path).map_err(|error| {
                format!(
                    "DIMSART_MODULES: {}: {error}; give the path of a Rust file",
                    PathBuf::from(&path).display()
                )
            })?;
            let folder = file.parent().ok_or("DIMSART_MODULES is no file")?;
            println!("cargo:rerun-if-changed={}", folder.display());
            format!(
                "/// Modules of a project outside the library.\n\
                 #[allow(missing_docs, unreachable_pub, dead_code, clippy::all)]\n\
                 #[path = {file:?}]\n\
                 pub mod own;\n\
                 pub use own::OWN;\n"
            )
        }
    };
    let out = env::var_os("OUT_DIR").ok_or("cargo gives no OUT_DIR")?;
    fs::write(PathBuf::from(out).join("own_modules.rs"), text).map_err(|error| error.to_string())
}
