//! Devices whose joints are moteus drives behind a CAN FD bus: what a scheme sees, and what the joints do.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

mod closed_form;
mod room;
mod trouble;
mod wrong;

use std::path::PathBuf;

use hil_sim::rig_file::RigFile;

const STIFFNESS: f64 = 30.0;
const DAMPING: f64 = 1.2;
const INERTIA: f64 = 0.03;
const PERIOD_S: f64 = 1e-3;

/// Two inertias with drives, under a PD scheme, without margins; `moteus` and `more` are lines of the file.
fn text(moteus: &str, more: &str) -> String {
    format!(
        r#"
        duration_s = 1.0
        [[device]]
        name = "robot"
        measures = ["POSITION", "VELOCITY", "MEASURED_TORQUE", "BUS_VOLTAGE", "TEMPERATURE", "DRIVE_FAULT", "DES_POSITION"]
        [device.moteus]
        ids = [1, 2]
        {moteus}
        [[device.axis]]
        plant.load.inertia = {INERTIA}
        [[device.axis]]
        plant.load.inertia = {INERTIA}
        [[controller]]
        device = "robot"
        scheme = "builtin:moteus"
        [experiment]
        margins = false
        {more}
        "#
    )
}

/// A step of an axis' reference at 0 s.
fn step(axis: usize, size: f64) -> String {
    format!(
        "[[experiment.move]]\ndevice = \"robot\"\naxis = {axis}\non = \"DES_POSITION\"\nstep = {{ at_s = 0.0, amplitude = {size} }}\n"
    )
}

fn read(text: &str) -> RigFile {
    RigFile::read(text, "test", PathBuf::new(), &[]).unwrap()
}
