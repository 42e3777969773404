//! Checksums of all signals of whole runs against `tests/bits.txt`: equal on any machine and build.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::fmt::Write;
use std::sync::atomic::AtomicBool;

use crc::{CRC_32_ISO_HDLC, Crc};
use hil_sim::experiment::Experiment;
use hil_sim::rig_file::RigFile;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/bits.txt");
/// Environment variable: rewrites the file instead of comparing.
const WRITE: &str = "DIMSART_WRITE_BITS";

/// The runs: name, and changes to the shipped scenario.
const RUNS: [(&str, &str); 2] = [
    ("shipped", ""),
    (
        "lossy",
        "seed=7 link.loss=0.1 link.jitter_ticks=3 link.duplication=0.1 link.reordering=0.1 link.stale=limited \
         wave.form=implicit master.motor={} slave.motor={} master.device.encoder_step_m=3e-5 \
         master.device.coulomb_friction_n=0.04 slave.device.coulomb_friction_n=0.2",
    ),
];

/// Returns a line per signal: run, checksum of all values, name.
fn checksums() -> String {
    let mut lines = String::new();
    for (name, settings) in RUNS {
        let settings: Vec<String> = settings.split_whitespace().map(str::to_owned).collect();
        let experiment = Experiment::new(&RigFile::from_shipped("bilateral", &settings).unwrap()).unwrap();
        let run = experiment.run(&AtomicBool::new(false), |_| ());
        assert!(run.outcome.ticks > 5000, "{name}: {:?}", run.outcome.faults);
        for (index, column) in run.recording.columns().iter().enumerate() {
            let mut digest = CRC.digest();
            for value in run.recording.column(index) {
                // The bits of a NaN depend on the processor.
                let value = if value.is_nan() { f64::NAN } else { value };
                digest.update(&value.to_bits().to_le_bytes());
            }
            writeln!(lines, "{name} {:08x} {}", digest.finalize(), column.header()).unwrap();
        }
    }
    lines
}

#[test]
fn a_run_has_the_same_bits_on_any_machine() {
    let found = checksums();
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(FILE, &found).unwrap();
        return;
    }
    let expected = std::fs::read_to_string(FILE).unwrap();
    let missing = |from: &str, lines: &str| -> Vec<String> {
        lines.lines().filter(|line| !from.lines().any(|other| other == *line)).map(str::to_owned).collect()
    };
    let (new, old) = (missing(&expected, &found), missing(&found, &expected));
    assert!(
        new.is_empty() && old.is_empty(),
        "checksums differ from the committed ones (run, checksum, signal).\nFound:\n  {}\nexpected:\n  {}\n\
         If a module's arithmetic, a plant, a scheme, the shipped scenario or the recording was changed intentionally, \
         rewrite the file with `{WRITE}=1 cargo test --test bits` and explain the change in the commit. \
         Otherwise find the dependence on the machine or the build.",
        new.join("\n  "),
        old.join("\n  "),
    );
}
