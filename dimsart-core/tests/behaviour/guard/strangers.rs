//! A side's own frames, and frames of a foreign link.

use super::*;

/// Everything that a side sends comes back to it, and nothing else.
#[test]
fn a_mirror_is_no_other_side() {
    for profile in PROFILES {
        let mut side = Side::new(KEY, profile, [0, 0], 1);
        let mut sent = VecDeque::new();
        let mut count = 0;
        for now_ms in 0..1000 {
            sent.extend(side.send(now_ms));
            while let Some(content) = sent.pop_front() {
                count += 1;
                sent.extend(side.take(now_ms, &content, 0));
            }
        }
        assert!(count >= 1000 && side.taken.is_empty(), "{} of {count} taken", side.taken.len());
        assert!(side.refused.iter().all(|error| *error == AuthError::Tag));
        assert!(!side.guard.has_session());
    }
}

/// In operation, a side's own frames come back in addition to the peer's, even if both use one channel.
#[test]
fn what_is_reflected_is_refused_and_no_trouble() {
    for profile in PROFILES {
        for channels in [CHANNELS, [0, 0]] {
            let mut link = Link::running(profile, channels, 0);
            let mut reflected = 0;
            for _ in 0..500 {
                // The last of three: newer than everything received.
                let mut send =
                    |side: &mut Side| (0..3).flat_map(|_| side.send(link.now_ms)).last().expect("sent");
                let said = link.sides.each_mut().map(&mut send);
                // Before the peer's frame arrives.
                for (from, content) in said.iter().enumerate() {
                    link.give(from, content);
                    reflected += 1;
                }
                for (from, content) in said.iter().enumerate() {
                    link.give(1 - from, content);
                }
                link.now_ms += 1;
            }
            let refused = link.sides.iter().flat_map(|side| &side.refused);
            assert_eq!(refused.clone().count(), reflected);
            let of_one_channel = channels[0] == channels[1];
            assert!(refused.clone().all(|error| (*error == AuthError::Tag) == of_one_channel));
            for side in &link.sides {
                assert_eq!((side.taken.len(), side.handshakes), (500, 0));
            }
        }
    }
}

#[test]
fn what_is_moved_to_another_link_is_refused_and_no_trouble() {
    for profile in PROFILES {
        let of_link = |number, seed| {
            let mut link = Link::new(profile, CHANNELS, 0);
            let [left, right] = CHANNELS;
            let line = KeyDomain::Link(number);
            link.sides = [
                Side::of_line(KEY, line, profile, [left, right], seed),
                Side::of_line(KEY, line, profile, [right, left], seed + 1),
            ];
            link.run(50, &mut clean);
            link.sides.iter_mut().for_each(Side::forget);
            link
        };
        // Even the seeds are the same: only the link's number differs.
        let mut links = [of_link(1, 1), of_link(2, 1)];
        let mut moved = Vec::new();
        for _ in 0..500 {
            let [from, to] = &mut links;
            from.run(1, &mut |content, side| {
                moved.push((side, content.to_vec()));
                clean(content, side)
            });
            // Before the original arrives.
            for (side, content) in moved.drain(..) {
                to.give(side, &content);
            }
            to.run(1, &mut clean);
        }
        for (link, refused) in links.iter().zip([0, 500]) {
            for side in &link.sides {
                assert_eq!((side.taken.len(), side.handshakes), (500, 0));
                assert_eq!(side.refused, vec![AuthError::Tag; refused]);
            }
        }
    }
}

#[test]
fn another_key_on_the_other_side_is_refused() {
    let [left, right] = CHANNELS;
    for profile in PROFILES {
        let mut link = Link::new(profile, CHANNELS, 0);
        link.sides[1] = Side::new(b"another key of16", profile, [right, left], 2);
        link.run(500, &mut clean);
        for side in &link.sides {
            assert!(side.taken.is_empty() && !side.guard.has_session());
            assert!(side.refused.len() > 400 && side.refused.iter().all(|error| *error == AuthError::Tag));
        }
    }
}
