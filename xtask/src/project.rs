//! A project of one's own, as a user makes it: it builds outside the workspace, knows its laws, and passes its tests.

use std::fs;

use crate::shell::{Outcome, cargo, command, run, target};

/// Makes one with two laws, and runs its tests.
pub(crate) fn project() -> Outcome {
    let folder = target().join("own-project");
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    run(&mut cargo(&["build", "--quiet", "--package", "dimsart"]))?;
    let dimsart = target().join("debug/dimsart");
    run(command(&dimsart, ["new-project", "gripper", "--law", "grip-force"]).current_dir(&folder))?;
    let project = folder.join("gripper");
    run(command(&dimsart, ["new-module", "approach"]).current_dir(&project))?;
    // What it builds is kept from run to run.
    let built = target().join("own-project-built");
    run(cargo(&["test", "--quiet", "--target-dir"]).arg(built).current_dir(&project))
}
