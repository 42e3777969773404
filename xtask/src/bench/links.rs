//! What is felt over every carrier, as `hil-sim/examples/link_figures.rs` prints it.

use crate::shell::{cargo, run, target};

const HEAD: &str = "
`schemes/bilateral.scheme`, both sides with hand, wall and the simulated medium, the whole shipped run. Perceived stiffness
against the prediction for the measured round trip, the worse of the two axes in contact; the smallest energy in the
channel, below 0 if it were not passive. Errors are frames or bytes that the medium damaged, or packets that it lost.
The same figures on every machine; `hil-sim/tests/links.rs` holds them to 1 %, and to no less than 0 J.

A lost wave is lost motion, which in a constant contact nothing brings back: where packets get lost or come bunched
under `zero` and `limited` alone, the two sides creep apart and stiffness is the wrong word for what is felt.
`link.playout_ticks` makes up for it and stays passive.
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

/// The page's section.
pub(super) fn text(table: &str) -> String {
    format!("{HEAD}\n{table}")
}
