use std::path::PathBuf;
use std::time::Duration;

use super::*;
use crate::report::{ControllerMetadata, RunMetadata, SignalsFile, SignalsFormat};
use hil_sim::recording::{Column, RecordingChunk, TickInputs};
use hil_sim::rig::Inputs;

/// Returns a small recording, unfinished by a killed writer, and finished.
fn recordings() -> [Vec<u8>; 2] {
    let folder = tempfile::tempdir().unwrap();
    let joint = ControllerMetadata {
        name: "joint".to_owned(),
        scheme: "joint MOD_ENG MATCHING_CHECK\n".to_owned(),
        device_json: Some("{}".to_owned()),
    };
    let facts = RunMetadata {
        settings_toml: "seed = 7\n".to_owned(),
        controllers: vec![joint],
        ..RunMetadata::default()
    };
    let (file, sender) = SignalsFile::create(folder.path(), &[], SignalsFormat::Mcap(facts)).unwrap();
    let path: PathBuf = file.path().to_owned();
    let column = |signal: &str| Column {
        source: "joint".to_owned(),
        signal: signal.to_owned(),
        indices: Vec::new(),
        unit: "rad".to_owned(),
        format: None,
    };
    sender.send(RecordingChunk::Columns(vec![column("POSITION"), column("VELOCITY")])).unwrap();
    for tick in 0..6 {
        let time_s = f64::from(tick) * 1e-3;
        let inputs = Inputs { packets: vec![(0, vec![1, 2, 3])], ..Inputs::default() };
        sender
            .send(RecordingChunk::Inputs(vec![TickInputs { tick: 0, time_s, station: 0, inputs }]))
            .unwrap();
        sender.send(RecordingChunk::Rows(vec![f64::from(tick), time_s, 1.5, 0.5])).unwrap();
    }
    let mut killed = Vec::new();
    // Three attachments, two schemas, two channels and twelve messages.
    while read(&killed).map_or(0, |(records, _)| records.len()) < 19 {
        std::thread::sleep(Duration::from_millis(20));
        killed = std::fs::read(&path).unwrap();
    }
    drop(sender);
    file.finish().unwrap();
    [killed, std::fs::read(&path).unwrap()]
}

/// Reads all records, and whether the file is truncated.
fn read(bytes: &[u8]) -> Result<(Vec<Record>, bool), RecordError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let mut records = Records::new(file.reopen().unwrap())?;
    let mut found = Vec::new();
    while let Some(record) = records.next()? {
        found.push(record);
    }
    Ok((found, records.is_unfinished()))
}

#[test]
fn a_damaged_byte_is_found_at_its_record_wherever_it_is() {
    let recordings = recordings();
    let whole = read(&recordings[1]).unwrap().0;
    assert_eq!(whole.iter().filter(|record| matches!(record, Record::Message { .. })).count(), 12);
    for (bytes, is_cut) in recordings.iter().zip([true, false]) {
        assert_eq!(read(bytes).unwrap(), (read(bytes).unwrap().0, is_cut));
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] = 0xFF;
            match read(&damaged) {
                // The byte was 0xFF, or is unused: in the index after the data.
                Ok((found, _)) => assert_eq!(found, whole, "byte {place}"),
                Err(RecordError::NotMcap) => assert!(place < MAGIC.len(), "byte {place}"),
                Err(RecordError::Damaged { byte, .. }) => {
                    assert!(byte < bytes.len() as u64, "byte {place}: at {byte}");
                }
                Err(RecordError::File(error)) => panic!("byte {place}: {error}"),
            }
        }
    }
}

#[test]
fn a_file_that_is_cut_anywhere_is_read_as_far_as_it_goes() {
    let [killed, finished] = recordings();
    let whole = read(&finished).unwrap().0;
    for bytes in [&killed, &finished] {
        for end in MAGIC.len()..bytes.len() {
            let (found, is_cut) = read(&bytes[..end]).unwrap();
            assert!(whole.starts_with(&found) && is_cut, "cut at byte {end}");
        }
    }
}

#[test]
fn an_open_chunk_is_read_as_far_as_it_goes() {
    // As of writers that stream into a chunk: its length is written on close.
    let finished = &recordings()[1];
    let whole = read(finished).unwrap().0;
    let mut at = MAGIC.len();
    while finished[at] != op::CHUNK {
        at += HEAD_BYTES
            + usize::try_from(u64::from_le_bytes(finished[at + 1..at + 9].try_into().unwrap())).unwrap();
    }
    let length = usize::try_from(u64::from_le_bytes(finished[at + 1..at + 9].try_into().unwrap())).unwrap();
    let mut open = finished[..at + HEAD_BYTES + length].to_vec();
    open[at + 1..at + 9].fill(0xFF);
    let sizes = at + HEAD_BYTES + 16;
    open[sizes..sizes + 12].fill(0xFF);
    let compressed = sizes + 12 + 4 + "lz4".len();
    open[compressed..compressed + 8].fill(0xFF);
    let (found, is_cut) = read(&open).unwrap();
    assert!(is_cut && found == whole, "{} of {} records", found.len(), whole.len());
}
