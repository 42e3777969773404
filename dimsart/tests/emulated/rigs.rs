//! Rigs of any devices on emulated boards: what the firmware does is what the controllers here do.

use hil_sim::response::{Experiment, Run};
use hil_sim::rig_file::RigFile;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::common::image;

/// Errors of every axis, to the last bit, of the joint with its reference and of two devices that turn.
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
                experiment.emulate(&image, |_| None).unwrap();
            }
            let run = experiment.run(&AtomicBool::new(false), |_| ());
            assert!(run.broken.is_none(), "{:?}", run.broken);
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
