//! Time until both sides associate, at first and after a restart of one side.

use super::*;

#[test]
fn both_sides_find_together_in_three_ms_and_lose_nothing_from_then_on() {
    for profile in PROFILES {
        for channels in [CHANNELS, [0, 0]] {
            let mut link = Link::new(profile, channels, 0);
            link.run(1000, &mut clean);
            for side in &link.sides {
                assert!(side.taken.len() >= 997, "{} taken", side.taken.len());
                assert!(side.taken.is_sorted_by(|a, b| after(a.counter) == b.counter));
                assert!(side.refused.is_empty(), "{:?}", side.refused);
                assert!(side.handshakes <= 10, "{}", side.handshakes);
            }
        }
    }
}

/// A third of all packets is lost: even then there is no long gap during the association, because handshakes
/// are repeated.
#[test]
fn loss_makes_finding_together_a_little_longer() {
    let mut random = Pcg64Mcg::seed_from_u64(6);
    for profile in PROFILES {
        for seed in 3..100 {
            let mut link = Link::running(profile, CHANNELS, 1);
            link.restart(1, profile, seed);
            link.run(60, &mut |content, _| {
                if random.next_u32().is_multiple_of(3) { Vec::new() } else { vec![content.to_vec()] }
            });
            for side in &link.sides {
                let first_ms = side.taken_ms.iter().find(|ms| **ms > 62).expect("taken");
                assert!(*first_ms < 60 + 35, "{first_ms}, seed {seed}");
            }
        }
    }
}

/// Silence after an instantaneous restart of the peer, by the transit time.
#[test]
fn a_side_that_starts_anew_is_taken_again_before_the_link_is_lost() {
    for profile in PROFILES {
        for channels in [CHANNELS, [0, 0]] {
            for delay_ms in 0..=7 {
                let mut link = Link::running(profile, channels, delay_ms);
                let started_ms = link.now_ms;
                link.restart(1, profile, 3);
                link.run(100, &mut clean);
                let [stayed, started] = &link.sides;
                // Until the first new content arrives at the side that stayed, and at the restarted side.
                let first_ms = started.taken_ms[0] - started_ms;
                let silence_ms = stayed.silence_ms(started_ms, link.now_ms);
                println!("{profile:?}, {delay_ms} ms: {silence_ms} ms, {first_ms} ms");
                assert!(
                    silence_ms <= SESSION_HOLD_MS + 2 * delay_ms && silence_ms < TIMEOUT_MS,
                    "{silence_ms} ms"
                );
                assert!(first_ms <= 4 * delay_ms + 2, "{first_ms} ms");
            }
        }
    }
}

#[test]
fn a_side_that_changes_its_channel_is_taken_again() {
    for profile in PROFILES {
        let mut link = Link::running(profile, CHANNELS, 0);
        link.sides[0].guard.set_send_channel(99);
        link.sides[0].sends_on = 99;
        link.sides[1].guard.set_receive_channel(99);
        link.run(200, &mut clean);
        assert!(link.sides[1].taken.len() >= 190, "{} taken", link.sides[1].taken.len());
        assert_eq!(link.sides[0].taken.len(), 200, "the other direction continues");
    }
}

#[test]
fn sides_that_are_far_away_find_together_in_two_round_trips() {
    for profile in PROFILES {
        for delay_ms in [6, 50, 300] {
            let mut link = Link::new(profile, CHANNELS, delay_ms);
            for start in 0..3 {
                link.sides.iter_mut().for_each(Side::forget);
                let from_ms = link.now_ms;
                link.run(10 * delay_ms, &mut clean);
                for (name, side) in ["left", "right"].iter().zip(&link.sides) {
                    let last = side.taken_ms.windows(2).rposition(|pair| pair[1] > pair[0] + 1);
                    let since_ms = side.taken_ms[last.map_or(0, |gap| gap + 1)] - from_ms;
                    assert!(
                        since_ms <= 4 * delay_ms + SESSION_HOLD_MS + 5,
                        "{name} side, {delay_ms} ms, start {start}: lost some until {since_ms} ms"
                    );
                }
                link.restart(1, profile, 3 + start);
            }
        }
    }
}

/// A side that only receives, and so has no content to replace by a hello.
#[test]
fn a_link_of_one_direction_finds_together_too() {
    for profile in PROFILES {
        let mut link = Link::new(profile, CHANNELS, 1);
        for start in 0..3 {
            for _ in 0..200 {
                link.now_ms += 1;
                let sent = link.sides[0].send(link.now_ms);
                link.put(1, sent);
                link.deliver(&mut clean);
            }
            let side = &link.sides[1];
            assert!(side.taken.len() >= 185, "{} taken", side.taken.len());
            assert!(link.sides[0].handshakes < 30 && side.handshakes < 30);
            link.sides[0].forget();
            link.restart(1, profile, 3 + start);
        }
    }
}
