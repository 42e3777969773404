//! Rigs of various devices on emulated boards: firmware and host controllers give the same results.

use dimsart::replay::replay;
use hil_sim::experiment::{Experiment, Run};
use hil_sim::rig_file::RigFile;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::AtomicBool;

use crate::common::image;

/// Errors of every axis, to the last bit, of the joint with its reference and of two rotary devices.
#[test]
fn a_rig_is_the_same_on_emulated_boards() {
    let Some(image) = image() else { return };
    for (name, duration_s) in [("joint", 0.5), ("rokviss", 1.0)] {
        let text = RigFile::shipped(name).unwrap();
        let sets = [format!("duration_s={duration_s}")];
        let file = RigFile::read(text, name, PathBuf::new(), &sets).unwrap();
        let run = |is_emulated: bool| {
            let mut experiment = Experiment::new(&file).unwrap();
            if is_emulated {
                for controller in &file.controllers {
                    experiment.emulate(controller.name(), &image, None).unwrap();
                }
            }
            let run = experiment.run(&AtomicBool::new(false), |_| ());
            assert!(run.error.is_none(), "{:?}", run.error);
            run
        };
        let (here, there) = (run(false), run(true));
        assert!(!here.outcome.axes.is_empty());
        assert_eq!(here.outcome.axes, there.outcome.axes, "{name}");
        let rows = |run: &Run| -> Vec<Vec<u64>> {
            let columns = run.recording.columns().len();
            let column = |at| run.recording.column(at).map(f64::to_bits).collect();
            (0..columns).map(column).collect()
        };
        assert_eq!(rows(&here), rows(&there), "{name}");
    }
}

/// Emulated firmware and the core compute the same outputs from the same inputs, also over a lossy link.
#[test]
fn what_emulated_firmware_recorded_replays_the_same() {
    let Some(image) = image() else { return };
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["joint", "--set", "duration_s=0.3", "--set", "experiment.margins=false"][..],
        &["--set", "duration_s=1", "--set", "link.loss=0.1"],
    ] {
        let always = ["run", "--target", "mps2-an386", "--image", image.path().to_str().unwrap()];
        let mut run = Command::new(env!("CARGO_BIN_EXE_dimsart"));
        let run =
            run.current_dir(&folder).args(always).args(["--signals", "mcap", "--out", "."]).args(arguments);
        assert!(run.output().unwrap().status.success(), "{arguments:?}");
        let replay = replay(&folder.path().join("signals.mcap"), dimsart_modules::ALL, |_| ()).unwrap();
        assert!(!replay.diverges(), "{replay:?}");
        assert!(replay.controllers.iter().all(|of| of.ticks >= 300 && of.words >= 900), "{replay:?}");
    }
}
