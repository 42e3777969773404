use std::sync::mpsc::channel;

use dimsart_core::{Format, Word};
use hil_sim::recording::Column;
use hil_sim::rig::Inputs;

use super::*;

fn column(source: &str, signal: &str, indices: &[usize], format: Option<Format>) -> Column {
    let (source, signal) = (source.to_owned(), signal.to_owned());
    Column { source, signal, indices: indices.to_vec(), unit: "m".to_owned(), format }
}

fn written(pieces: impl IntoIterator<Item = RecordingChunk>, facts: &RunMetadata) -> Vec<u8> {
    let (sender, receiver) = channel();
    pieces.into_iter().for_each(|piece| sender.send(piece).unwrap());
    drop(sender);
    let file = tempfile::NamedTempFile::new().unwrap();
    write(&receiver, file.as_file(), facts).unwrap();
    std::fs::read(file.path()).unwrap()
}

#[test]
fn a_message_has_the_words_of_its_source_aligned_to_their_size() {
    let columns = vec![
        column("knee joint", "POSITION", &[0], Some(Format::F32)),
        column("world", "knee.position", &[0], None),
        column("knee joint", "LINK_LOST", &[], Some(Format::U32)),
        column("knee joint", "POSITION", &[1], Some(Format::F32)),
        column("knee joint", "ON", &[], Some(Format::Bool)),
    ];
    let rows = RecordingChunk::Rows(vec![250.0, 0.25, 0.5, 7.0, 3.0, -0.5, f64::NAN]);
    let bytes = written([RecordingChunk::Columns(columns), rows], &RunMetadata::default());
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let [knee, world] = messages.as_slice() else { panic!("{} messages", messages.len()) };
    assert_eq!((knee.channel.topic.as_str(), world.channel.topic.as_str()), ("/knee joint", "/world"));
    assert_eq!((knee.log_time, knee.publish_time, knee.sequence), (world.log_time, world.log_time, 0));
    let schema = knee.channel.schema.as_ref().unwrap();
    assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("dimsart/msg/KneeJoint", "ros2msg"));
    assert_eq!(
        std::str::from_utf8(&schema.data).unwrap(),
        "uint64 tick # number of the tick\nfloat64 time_s # its time\n\
         float32[2] position # POSITION (m)\nfloat64 link_lost # LINK_LOST (m)\nfloat64 on # ON (m)\n"
    );
    let stamp = [250_u64.to_le_bytes(), 0.25_f64.to_le_bytes()].concat();
    let expected = [
        cdr::MARK.as_slice(),
        &stamp,
        &0.5_f32.to_le_bytes(),
        &(-0.5_f32).to_le_bytes(),
        &3.0_f64.to_le_bytes(),
        &f64::NAN.to_le_bytes(),
    ];
    assert_eq!(knee.data, expected.concat());
    assert_eq!(world.data, [cdr::MARK.as_slice(), &stamp, &7.0_f64.to_le_bytes()].concat());
}

#[test]
fn fields_have_names_of_their_own() {
    let columns =
        [("energy", &[] as &[usize]), ("energy", &[0]), ("Energy", &[]), ("2nd.axis", &[]), ("TICK", &[])];
    let columns = columns.map(|(signal, indices)| column("world", signal, indices, None));
    let rows = RecordingChunk::Rows(vec![0.0; 7]);
    let bytes = written([RecordingChunk::Columns(columns.to_vec()), rows], &RunMetadata::default());
    let message = mcap::MessageStream::new(&bytes).unwrap().next().unwrap().unwrap();
    let definition = String::from_utf8(message.channel.schema.as_ref().unwrap().data.to_vec()).unwrap();
    let names: Vec<&str> = definition.lines().filter_map(|line| line.split(' ').nth(1)).collect();
    assert_eq!(
        names,
        ["tick", "time_s", "energy", "energy_by_axis", "energy_next", "signal_2nd_axis", "tick_next"]
    );
}

#[test]
fn more_signals_go_on_under_another_topic_and_what_made_the_run_comes_first() {
    let knee = ControllerMetadata {
        name: "knee".to_owned(),
        scheme: "knee  MOD_ENG  MATCHING_CHECK\n".to_owned(),
        device_json: Some("{}".to_owned()),
    };
    let facts = RunMetadata {
        settings_toml: "seed = 7\n".to_owned(),
        controllers: vec![knee],
        ..RunMetadata::default()
    };
    let (one, other) = (column("knee", "ONE", &[], None), column("knee", "OTHER", &[], None));
    let world = column("world", "energy", &[], None);
    let rows =
        |count: usize, width: usize| (0..count).map(move |_| RecordingChunk::Rows(vec![0.5; 2 + width]));
    let inputs = Inputs { measured: vec![Word(7)], packets: vec![(1, vec![1, 2, 3])], ..Inputs::default() };
    let inputs = TickInputs { tick: 500, time_s: 0.5, station: 0, inputs };
    let message = InputsMessage::from(inputs.clone());
    let inputs = RecordingChunk::Inputs(vec![inputs]);
    let pieces = [RecordingChunk::Columns(vec![one.clone(), world.clone()]), inputs]
        .into_iter()
        .chain(rows(300, 2))
        .chain([RecordingChunk::Columns(vec![one, world, other])])
        .chain(rows(50, 3));
    let bytes = written(pieces, &facts);
    let (mut topics, mut first) = (BTreeMap::new(), None);
    for message in mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap) {
        *topics.entry(message.channel.topic.clone()).or_insert(0) += 1;
        first.get_or_insert(message);
    }
    let expected = [("/knee", 300), ("/knee/2", 50), ("/knee/inputs", 1), ("/world", 350)];
    assert!(topics.iter().map(|(topic, count)| (topic.as_str(), *count)).eq(expected), "{topics:?}");
    let first = first.unwrap();
    assert_eq!(first.channel.topic, "/knee/inputs");
    // Wall-clock time, of this millennium.
    assert!(first.log_time > 1_700_000_000_000_000_000);
    assert_eq!(cdr::decode(&first.data), Some(message));
    let mut attached = Vec::new();
    for record in mcap::read::LinearReader::new(&bytes).unwrap().map(Result::unwrap) {
        match record {
            mcap::records::Record::Attachment { header, data, .. } => {
                attached.push((header.name, String::from_utf8(data.into_owned()).unwrap()));
            }
            mcap::records::Record::Chunk { .. } => break,
            _ => {}
        }
    }
    let scheme = facts.controllers[0].scheme.clone();
    let expected =
        [("settings.toml", facts.settings_toml), ("knee.scheme", scheme), ("knee.device.json", "{}".into())];
    assert!(attached.into_iter().eq(expected.map(|(name, text)| (name.to_owned(), text))));
}
