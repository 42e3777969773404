//! Recordings: selected signals, and signals added during a run.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, sync_channel};

use dimsart_core::scheme;
use hil_sim::experiment::Experiment;
use hil_sim::recorder::Recorder;
use hil_sim::recording::{Column, Recording, RecordingChunk};
use hil_sim::rig::Rig;
use hil_sim::rig_file::RigFile;

fn bilateral(settings: &[&str]) -> RigFile {
    RigFile::from_shipped(
        "bilateral",
        &settings.iter().map(|&setting| setting.to_owned()).collect::<Vec<_>>(),
    )
    .unwrap()
}

fn run(settings: &[&str]) -> Recording {
    let experiment = Experiment::new(&bilateral(settings)).unwrap();
    experiment.run(&AtomicBool::new(false), |_| ()).recording
}

/// Returns the distinct names of the columns, without axes.
fn names(recording: &Recording) -> Vec<String> {
    let mut names: Vec<String> = recording.columns().iter().map(|column| column.name()).collect();
    names.dedup();
    names
}

#[test]
fn a_list_of_names_is_recorded_and_nothing_else() {
    let duration = "duration_s=0.1";
    let recording =
        run(&[duration, "record.signals=['slave.DES_FORCE', 'world.master', 'world.channel_energy']"]);
    let expected = [
        "world.channel_energy",
        "world.master.position",
        "world.master.velocity",
        "world.master.actuator_force",
        "world.master.hand_force",
        "world.master.wall_force",
        "slave.DES_FORCE",
    ];
    let mut found = names(&recording);
    found.sort();
    found.dedup();
    let mut expected = expected.map(str::to_owned).to_vec();
    expected.sort();
    assert_eq!(found, expected);
    assert_eq!(recording.time_s().len(), 100);

    let all = run(&[duration]);
    let column = |recording: &Recording, axis| {
        let index = recording.find("slave", "DES_FORCE", Some(axis)).unwrap();
        recording.column(index).collect::<Vec<_>>()
    };
    assert_eq!(column(&recording, 1), column(&all, 1), "what is recorded must not depend on what else is");
    let station = run(&[duration, "record.signals=['master']"]);
    assert!(names(&station).iter().all(|name| name.starts_with("master.")) && names(&station).len() > 5);
}

#[test]
fn a_name_that_nothing_has_is_refused_with_the_nearest_one() {
    for (name, expected) in [
        ("master.DES_FORC", "did you mean 'master.DES_FORCE'?"),
        ("world.slave.posiition", "did you mean 'world.slave.position'?"),
        ("DES_FORCE", "did you mean 'master.DES_FORCE'?"),
        ("master.DES", "did you mean "),
    ] {
        let error = Experiment::new(&bilateral(&[&format!("record.signals=['{name}']")])).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(&format!("unknown name '{name}'")), "{message}");
        assert!(message.contains(expected), "{message}");
    }
}

fn command(rig: &mut Rig, rows: &str) {
    let dimsart = &mut rig.stations_mut()[0].dimsart;
    assert_eq!(scheme::load(rows, "master", &["master"], dimsart, |error| panic!("{error:?}")), 0);
}

/// Returns the recording received by a listener.
fn told(pieces: &Receiver<RecordingChunk>) -> Recording {
    pieces.iter().fold(Recording::default(), |mut recording, piece| match piece {
        RecordingChunk::Columns(columns) => {
            let known = recording.columns().len();
            recording.add_columns(columns[known..].to_vec());
            recording
        }
        RecordingChunk::Inputs(_) => recording,
        RecordingChunk::Rows(values) => {
            for row in values.chunks_exact(2 + recording.columns().len()) {
                recording.add_row(row[1]).copy_from_slice(&row[2..]);
            }
            recording
        }
    })
}

/// Returns the columns, and times and values as bits.
fn bits(recording: &Recording) -> (Vec<String>, Vec<u64>) {
    let values = recording.time_s().iter().chain(recording.rows().flatten());
    (recording.columns().iter().map(Column::header).collect(), values.map(|value| value.to_bits()).collect())
}

#[test]
fn what_is_plugged_in_later_is_recorded_from_then_on() {
    let file = bilateral(&["dof=2", "record.signals=['master', 'world.slave.position']"]);
    let mut experiment = Experiment::new(&file).unwrap();
    let rig = experiment.rig_mut();
    let mut recorder = Recorder::new(rig, &file.record).unwrap();
    let (listener, pieces) = sync_channel(1000);
    for tick in 0..40 {
        if tick == 5 {
            recorder.add_listener(listener.clone());
        }
        match tick {
            10 => command(
                rig,
                "master SIGGEN_MOD FORM CONSTANT\nmaster SIGGEN_MOD AMPLITUDE 3\nmaster MOD_ENG MOD_ON SIGGEN_MOD",
            ),
            20 => command(rig, "master MOD_ENG MOD_OFF SIGGEN_MOD"),
            30 => command(rig, "master MOD_ENG MOD_ON SIGGEN_MOD"),
            _ => {}
        }
        rig.tick();
        recorder.record(rig, &[]);
        rig.advance();
    }
    let recording = recorder.finish();
    drop(listener);
    assert_eq!(bits(&told(&pieces)), bits(&recording));
    let column = |source: &str, signal: &str, axis| {
        let index = recording.find(source, signal, axis).unwrap_or_else(|| panic!("no {signal}"));
        recording.column(index).collect::<Vec<_>>()
    };
    for (tick, value) in column("master", "SIGNAL_OUT", Some(0)).into_iter().enumerate() {
        let is_plugged_in = (10..20).contains(&tick) || tick >= 30;
        assert_eq!(value.is_finite(), is_plugged_in, "tick {tick}: {value}");
    }
    assert!(column("world", "slave.position", Some(1)).iter().all(|value| value.is_finite()));
    assert!(column("master", "POSITION", Some(1)).iter().all(|value| value.is_finite()));
    assert!(recording.rows().all(|row| row.len() == recording.columns().len()));
    assert_eq!(recording.rows().count(), 40);
}

#[test]
fn a_run_that_keeps_nothing_comes_to_the_same() {
    let file = bilateral(&["duration_s=0.3"]);
    let run = |experiment: Experiment| experiment.run(&AtomicBool::new(false), |_| ());
    let kept = run(Experiment::new(&file).unwrap());
    let not_kept = run(Experiment::new(&file).unwrap().without_recording());
    assert!(not_kept.recording.columns().is_empty() && not_kept.recording.time_s().is_empty());
    assert_eq!(not_kept.outcome.energy_min_j, kept.outcome.energy_min_j);
    assert_eq!((not_kept.outcome.stable, not_kept.outcome.ticks), (true, 300));
}
