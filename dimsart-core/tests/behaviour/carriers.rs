//! Carriers: contents arrive unchanged or not at all.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "a failed unwrap is a failed test")]

use dimsart_core::envelope::{self, Class, HEADER_BYTES, MAX_CONTENT_BYTES};
use dimsart_link::auth::{Key, KeyDomain, Opener, Profile, Sealer};
use dimsart_link::carrier::stream::{MAX_FRAME_BYTES, StreamReceiver};
use dimsart_link::carrier::{can, stream};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;

fn stream_frame(content: &[u8]) -> Vec<u8> {
    stream::encode(content, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

fn received(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut receiver = StreamReceiver::new();
    bytes.iter().filter_map(|byte| receiver.push(*byte).map(<[u8]>::to_vec)).collect()
}

/// Returns whether all of `expected` occur in `found`, in this order.
fn are_among(expected: &[Vec<u8>], found: &[Vec<u8>]) -> bool {
    let mut found = found.iter();
    expected.iter().all(|content| found.any(|other| other == content))
}

fn contents() -> impl Strategy<Value = Vec<Vec<u8>>> {
    vec(vec(any::<u8>(), 1..=MAX_CONTENT_BYTES), 1..8)
}

proptest! {
    #[test]
    fn a_stream_gives_every_content_as_it_went_in(contents in contents()) {
        let bytes: Vec<u8> = contents.iter().flat_map(|content| stream_frame(content)).collect();
        prop_assert_eq!(received(&bytes), contents);
    }

    #[test]
    fn noise_between_frames_of_a_stream_costs_none(contents in contents(), noise in vec(any::<u8>(), 0..600)) {
        let bytes: Vec<u8> =
            contents.iter().flat_map(|content| [noise.clone(), stream_frame(content)].concat()).collect();
        prop_assert!(are_among(&contents, &received(&bytes)));
    }

    #[test]
    fn bytes_lost_added_or_changed_in_a_frame_of_a_stream_cost_that_one(
        mut contents in contents(), hit in any::<Index>(), at in any::<Index>(), lost in 0_usize..300,
        added in vec(any::<u8>(), 0..300),
    ) {
        let mut frames: Vec<Vec<u8>> = contents.iter().map(|content| stream_frame(content)).collect();
        let hit = hit.index(frames.len());
        let frame = &mut frames[hit];
        // The delimiters at both ends are kept: losing one with its neighbour would lose that frame too.
        let start = 1 + at.index(frame.len() - 1);
        let end = (start + lost).min(frame.len() - 1);
        frame.splice(start..end, added);
        contents.remove(hit);
        prop_assert!(are_among(&contents, &received(&frames.concat())));
    }
}

#[test]
fn a_content_that_does_not_fit_is_not_encoded() {
    let content = [7; MAX_CONTENT_BYTES];
    let whole = stream_frame(&content).len();
    for room in 0..whole {
        assert_eq!(stream::encode(&content, &mut vec![0; room]), None, "{room} bytes of {whole}");
    }
}

/// A packet's content: echo, content and words.
fn packet(channel: u16, counter: u16, payload: &[u8]) -> Vec<u8> {
    let mut buffer = [0; MAX_CONTENT_BYTES];
    buffer[HEADER_BYTES..][..payload.len()].copy_from_slice(payload);
    envelope::seal(Class::Packet, channel, counter, payload.len(), &mut buffer).unwrap().to_vec()
}

fn can_frames(content: &[u8], channel: u16) -> Vec<Vec<u8>> {
    can::frames(content, channel).unwrap().map(|frame| frame.to_vec()).collect()
}

fn assembled<'f>(
    assembler: &mut can::Assembler,
    frames: impl IntoIterator<Item = &'f Vec<u8>>,
) -> Vec<Vec<u8>> {
    frames.into_iter().filter_map(|frame| assembler.push(frame, CHANNEL).map(<[u8]>::to_vec)).collect()
}

const CHANNEL: u16 = 0x123;

fn counters() -> impl Strategy<Value = u16> {
    1..=u16::MAX
}

/// No packet has counter 0.
fn counter_after(counter: u16, steps: u16) -> u16 {
    let sum = counter.wrapping_add(steps);
    if sum < counter { sum + 1 } else { sum }
}

fn payload() -> impl Strategy<Value = Vec<u8>> {
    (0..=can::MAX_WORDS).prop_flat_map(|words| vec(any::<u8>(), 4 + 4 * words))
}

proptest! {
    #[test]
    fn classic_can_gives_every_packet_as_it_went_in(
        channel in 0_u16..2048, payloads in vec((counters(), payload()), 1..5),
    ) {
        let mut assembler = can::Assembler::new();
        for (counter, payload) in payloads {
            let content = packet(channel, counter, &payload);
            let frames = can_frames(&content, channel);
            prop_assert_eq!(frames.len(), (payload.len() / 4 - 1).max(3));
            let (last, others) = frames.split_last().unwrap();
            for frame in others {
                prop_assert_eq!(assembler.push(frame, channel), None);
            }
            prop_assert_eq!(assembler.push(last, channel), Some(&content[..]));
        }
        prop_assert_eq!(assembler.dropped(), 0);
    }

    #[test]
    fn frames_lost_and_repeated_cost_packets_and_change_none(
        first in counters(), payloads in vec(payload(), 1..40), fates in vec(0_usize..3, 40 * 16),
    ) {
        let counters = (0..).map(|index| counter_after(first, index));
        let sent: Vec<Vec<u8>> =
            counters.zip(&payloads).map(|(counter, payload)| packet(CHANNEL, counter, payload)).collect();
        let mut fates = fates.into_iter();
        let (mut arriving, mut whole) = (Vec::new(), Vec::new());
        for content in &sent {
            let frames = can_frames(content, CHANNEL);
            let copies: Vec<usize> = fates.by_ref().take(frames.len()).collect();
            // A repeated first frame restarts the packet: no loss.
            if copies.iter().all(|copies| *copies > 0) {
                whole.push(content.clone());
            }
            arriving.extend(frames.into_iter().zip(copies).flat_map(|(frame, copies)| vec![frame; copies]));
        }
        let found = assembled(&mut can::Assembler::new(), &arriving);
        prop_assert!(found.iter().all(|content| sent.contains(content)));
        prop_assert!(are_among(&whole, &found));
    }

    #[test]
    fn frames_in_any_order_give_what_was_sent_or_nothing(
        first in counters(), payloads in vec(payload(), 1..6), order in vec(any::<Index>(), 200),
    ) {
        let counters = (0..).map(|index: u16| counter_after(first, 16 * index));
        let sent: Vec<Vec<u8>> =
            counters.zip(&payloads).map(|(counter, payload)| packet(CHANNEL, counter, payload)).collect();
        let frames: Vec<Vec<u8>> = sent.iter().flat_map(|content| can_frames(content, CHANNEL)).collect();
        let shuffled = order.iter().map(|index| &frames[index.index(frames.len())]);
        let found = assembled(&mut can::Assembler::new(), shuffled);
        prop_assert!(found.iter().all(|content| sent.contains(content)));
    }
}

#[test]
fn a_mix_of_two_packets_is_never_assembled() {
    let payload = |seed: u8| -> Vec<u8> { (0..40).map(|index| seed ^ index).collect() };
    for counter in [1, 16, 0x7FFF, 0xFFF0, 0xFFFF] {
        let one = can_frames(&packet(CHANNEL, counter, &payload(0)), CHANNEL);
        for later in (1..4096).filter(|later| counter.wrapping_add(*later) != 0) {
            let other = can_frames(&packet(CHANNEL, counter.wrapping_add(later), &payload(0x55)), CHANNEL);
            for cut in 1..one.len() {
                let mut assembler = can::Assembler::new();
                let found = assembled(&mut assembler, one[..cut].iter().chain(&other[cut..]));
                assert!(found.is_empty(), "{cut} frames of {counter}, then of the packet {later} later");
            }
        }
    }
}

#[test]
fn one_to_three_wrong_bits_in_a_classic_can_frame_are_always_found() {
    let content = packet(CHANNEL, 0xABCD, &[0x5A; 4 + 36]);
    let frames = can_frames(&content, CHANNEL);
    // The first frame, a middle frame and the last.
    for at in [0, 3, frames.len() - 1] {
        let damaged = |bits: &[usize]| {
            let mut frame = frames[at].clone();
            bits.iter().for_each(|bit| frame[bit / 8] ^= 1 << (bit % 8));
            let mut assembler = can::Assembler::new();
            let before = assembled(&mut assembler, &frames[..at]);
            let found = assembled(&mut assembler, [&frame].into_iter().chain(&frames[at + 1..]));
            assert_eq!((before, found), (vec![], vec![]), "bits {bits:?} of frame {at}");
        };
        let bits = frames[at].len() * 8;
        for one in 0..bits {
            damaged(&[one]);
            for two in 0..one {
                damaged(&[one, two]);
                (0..two).for_each(|three| damaged(&[one, two, three]));
            }
        }
    }
}

#[test]
fn a_classic_can_frame_has_these_bytes() {
    let frames = can_frames(&packet(0x123, 0xABCD, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]), 0x123);
    let tags_and_parts: Vec<&[u8]> = frames.iter().map(|frame| &frame[1..]).collect();
    // Low byte first: 0xABC with the last frame's index 2, the echo 0x0201, the content 0x0403, two words.
    let expected: [&[u8]; 3] = [&[0x0D, 0xC2, 0xAB, 5, 6, 7, 8], &[0x1D, 1, 2, 9, 10, 11, 12], &[0x2D, 3, 4]];
    assert_eq!(tags_and_parts, expected);
    // The CRC-8 of the `crc` crate over the data id, the counter's bits 4 to 11 (0 in the first frame) and the rest.
    let crc = crc::Crc::<u8>::new(&crc::CRC_8_AUTOSAR);
    let data_id = 0x23 + 0xD * 3;
    for (frame, above) in frames.iter().zip([0, 0xBC, 0xBC]) {
        assert_eq!(frame[0], crc.checksum(&[&[data_id, above], &frame[1..]].concat()));
    }
}

#[test]
fn what_is_no_packet_or_does_not_fit_has_no_frames() {
    let long = packet(CHANNEL, 1, &[0; 4 + 4 * (can::MAX_WORDS + 1)]);
    let mut damaged = packet(CHANNEL, 1, &[0; 8]);
    damaged[5] ^= 1;
    let uncounted = packet(CHANNEL, 0, &[0; 8]);
    let elsewhere = packet(CHANNEL + 1, 1, &[0; 8]);
    for content in [long, damaged, uncounted, elsewhere, packet(CHANNEL, 1, &[0; 9]), vec![]] {
        assert!(can::frames(&content, CHANNEL).is_none(), "{content:?}");
    }
    let mut buffer = [0; 20];
    let request = envelope::seal(Class::Request, CHANNEL, 1, 8, &mut buffer).unwrap();
    assert!(can::frames(request, CHANNEL).is_none());
}

#[test]
fn the_data_ids_of_a_channel_differ_and_two_channels_share_at_most_one() {
    let ids = |channel| -> Vec<u8> { (0..16).map(|counter| can::data_id(channel, counter)).collect() };
    let lists: Vec<Vec<u8>> = (0..2048).map(ids).collect();
    for (channel, list) in lists.iter().enumerate() {
        let mut seen = [false; 256];
        assert!(list.iter().all(|id| !std::mem::replace(&mut seen[usize::from(*id)], true)));
        for other in &lists[..channel] {
            let shared = list.iter().zip(other).filter(|(one, other)| one == other).count();
            assert!(shared <= 1, "{list:?} {other:?}");
        }
    }
}

#[test]
fn classic_can_carries_a_tag_in_one_word_and_the_room_beside_others() {
    let (key, line) = (Key::new(&[7; 16]), KeyDomain::Link(0));
    let mut sealer = Sealer::new(&key, line, Profile::Short, CHANNEL, 1);
    let mut opener = Opener::new(&key, line, Profile::Short, CHANNEL, 2);
    opener.open(sealer.handshake().unwrap(), &mut [0; 256]).unwrap();
    assert!(sealer.receive(opener.handshake().unwrap()));
    for words in 0..can::MAX_WORDS {
        let plain = packet(CHANNEL, 0x7FF3, &vec![0xA5; 4 + 4 * words]);
        let mut sealed = [0; 256];
        let sealed = sealer.seal(&plain, &mut sealed).unwrap();
        let frames: Vec<_> = can::frames(sealed, CHANNEL).unwrap().collect();
        assert_eq!(frames.len(), (words + 1).max(5));
        let mut assembler = can::Assembler::authenticated();
        let (last, others) = frames.split_last().unwrap();
        assert!(others.iter().all(|frame| assembler.push(frame, CHANNEL).is_none()));
        assert_eq!(assembler.push(last, CHANNEL), Some(sealed), "{words} words");
        assert_eq!(assembler.dropped(), 0);
    }
    let plain = packet(CHANNEL, 1, &[0; 4 + 4 * can::MAX_WORDS]);
    let mut sealed = [0; 256];
    assert!(can::frames(sealer.seal(&plain, &mut sealed).unwrap(), CHANNEL).is_none(), "one too many");
}
