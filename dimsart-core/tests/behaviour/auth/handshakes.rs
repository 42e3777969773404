//! How both ends associate, and attempts to prevent it.

use super::*;

#[test]
fn what_finds_together_is_good_for_once() {
    for profile in PROFILES {
        let mut channel = Channel { sealer: sealer(profile, 1), opener: opener(profile, 2), sent: 0 };
        let hello = channel.sealer.handshake().expect("new").to_vec();
        assert_eq!(channel.open(&hello), Ok(None));
        let challenge = channel.opener.handshake().expect("greeted").to_vec();
        assert!(channel.sealer.receive(&challenge));
        let proof = channel.sealer.handshake().expect("challenged").to_vec();
        assert_eq!(channel.open(&proof), Ok(None));
        let taken = channel.opener.handshake().expect("proven").to_vec();
        let recorded: Vec<_> = (0..20).map(|_| channel.seal()).collect();
        for (plain, sealed) in &recorded {
            assert_eq!(channel.open(sealed).as_ref(), Ok(&Some(plain.clone())));
            for said in [&hello, &proof] {
                assert_eq!(channel.open(said), Ok(None), "no new association");
            }
            for said in [&challenge, &taken] {
                channel.sealer.receive(said);
            }
            while channel.opener.handshake().is_some() {}
            assert!(channel.open(sealed).is_err(), "a replay is refused");
        }
        // Nor after a restart of either end.
        channel.sealer = sealer(profile, 3);
        assert!(!channel.sealer.receive(&challenge));
        channel.find_together();
        assert!(channel.passes());
        assert_eq!(channel.open(&proof), Err(AuthError::Tag));
        assert!(!channel.sealer.receive(&taken) || channel.passes());
        assert!(channel.passes());
    }
}

#[test]
fn a_false_hello_challenge_or_proof_or_a_repetition_interrupts_nobody() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for profile in PROFILES {
        let mut channel = Channel::new(profile);
        let mut stranger = Channel::of(
            Sealer::new(&Key::new(&[0; 16]), LINE, profile, CHANNEL, 1),
            Opener::new(&Key::new(&[0; 16]), LINE, profile, CHANNEL, 2),
        );
        for step in 0..500 {
            let mut hello = sealer(profile, random.next_u64());
            assert_eq!(channel.open(hello.handshake().expect("new")), Ok(None));
            assert!(channel.opener.handshake().is_some());
            // All responses that a stranger could send.
            stranger.opener = Opener::new(&Key::new(&[0; 16]), LINE, profile, CHANNEL, random.next_u64());
            stranger.sealer = Sealer::new(&Key::new(&[0; 16]), LINE, profile, CHANNEL, random.next_u64());
            let hello = stranger.sealer.handshake().expect("new").to_vec();
            assert_eq!(stranger.open(&hello), Ok(None));
            let challenge = stranger.opener.handshake().expect("greeted").to_vec();
            assert!(!channel.sealer.receive(&challenge));
            assert!(stranger.sealer.receive(&challenge));
            let proof = stranger.sealer.handshake().expect("challenged").to_vec();
            assert_eq!(channel.open(&proof), Err(AuthError::Tag));

            let (plain, sealed) = channel.seal();
            assert_eq!(channel.open(&sealed), Ok(Some(plain)), "step {step}");
            assert_eq!(channel.open(&sealed), Err(AuthError::Replay));
        }
    }
}

/// An attacker who floods an opener with hellos is answered, and so is the sealer: answers are not rationed
/// or stored.
#[test]
fn a_flood_of_hellos_keeps_nobody_from_finding_together() {
    for profile in PROFILES {
        let mut channel = Channel { sealer: sealer(profile, 1), opener: opener(profile, 2), sent: 0 };
        let mut others = (0..200).map(|seed| sealer(profile, 1000 + seed));
        let mut flood = |opener: &mut Opener| {
            for mut other in others.by_ref().take(50) {
                let hello = other.handshake().expect("new").to_vec();
                assert_eq!(opener.open(&hello, &mut [0; 256]), Ok(None));
                assert!(opener.handshake().is_some());
            }
        };
        flood(&mut channel.opener);
        let hello = channel.sealer.handshake().expect("new").to_vec();
        assert_eq!(channel.open(&hello), Ok(None));
        let challenge = channel.opener.handshake().expect("greeted").to_vec();
        flood(&mut channel.opener);
        assert!(channel.sealer.receive(&challenge));
        let proof = channel.sealer.handshake().expect("challenged").to_vec();
        flood(&mut channel.opener);
        assert_eq!(channel.open(&proof), Ok(None));
        flood(&mut channel.opener);
        assert!(channel.passes());
    }
}

/// A challenge answers one hello, and a sealer never repeats an answered hello.
#[test]
fn a_challenge_that_was_good_once_takes_no_sealer_out_of_its_next_association() {
    for profile in PROFILES {
        let mut channel = Channel { sealer: sealer(profile, 1), opener: opener(profile, 2), sent: 0 };
        let mut challenges: Vec<Vec<u8>> = Vec::new();
        for start in 0..10 {
            // A restarted opener asks for the peer and gets an answer.
            channel.opener = opener(profile, 10 + start);
            let mut question = [0; MAX_CONTENT_BYTES];
            question[3] = 7;
            let question = seal(Class::Handshake, CHANNEL, 0, 4, &mut question).expect("fits");
            channel.sealer.receive(question);
            let hello = channel.sealer.handshake().expect("asked").to_vec();
            assert_eq!(channel.open(&hello), Ok(None));
            challenges.push(channel.opener.handshake().expect("greeted").to_vec());
            assert!(channel.sealer.receive(challenges.last().expect("pushed")));
            channel.find_together();
            for challenge in &challenges {
                channel.sealer.receive(challenge);
                assert!(channel.passes(), "start {start}");
            }
        }
    }
}
