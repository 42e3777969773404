//! Perceived stiffness and passivity over every carrier, from `hil-sim/examples/link_figures.rs`.

use crate::shell::{cargo, run, target};

const HEAD: &str = "
`schemes/bilateral.scheme`, both sides with hand, wall and the simulated medium, over the whole shipped run. Perceived stiffness
is relative to the prediction for the measured round-trip time, for the worse of the two axes in contact. The minimum energy of
the channel is negative if the channel is not passive. Errors are corrupt frames or bytes, or lost packets. The figures are
the same on every machine; `hil-sim/tests/links.rs` checks them to 1 % and the energy to at least 0 J.

A lost wave is lost motion, which constant contact does not restore. If packets are lost or arrive in bursts with `zero` or
`limited` alone, the two sides drift apart and the perceived stiffness is not meaningful. `link.playout_ticks` compensates for
this and stays passive.
";

/// Builds and runs the example.
pub(super) fn measure() -> Result<String, String> {
    run(&mut cargo(&["build", "--release", "--package", "hil-sim", "--example", "link_figures"]))?;
    let output = std::process::Command::new(target().join("release/examples/link_figures")).output();
    let output = output.map_err(|error| format!("cannot run link_figures: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("link_figures failed: {}", String::from_utf8_lossy(&output.stderr)))
    }
}

/// Returns the section of the page.
pub(super) fn text(table: &str) -> String {
    format!("{HEAD}\n{table}")
}
