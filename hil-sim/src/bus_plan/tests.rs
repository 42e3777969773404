use super::*;

const PLAN: BusPlan = BusPlan {
    joints: 6,
    rate_hz: 1000.0,
    words_to_joint: 3,
    words_from_joint: 3,
    format: Format::Fd,
    parameters: CanParameters {
        bits_per_s: 1_000_000,
        data_bits_per_s: 8_000_000,
        bit_error_rate: 0.0,
        rejoins: 3,
        queue_frames: 64,
    },
    seed: 1,
};

fn classic(rate_hz: f64) -> BusPlan {
    BusPlan { format: Format::Classic, rate_hz, ..PLAN }
}

/// Three words are three frames of 8 bytes and 135 bits, twelve times: 4.86 ms. The last one is never blocked.
#[test]
fn classic_frames_of_six_joints_are_counted_by_hand() {
    let (figures, _) = classic(200.0).analyse().unwrap();
    assert!(figures.fits, "{figures:?}");
    assert!((figures.worst_load - 12.0 * 3.0 * 135e-6 / 5e-3).abs() < 1e-9);
    let last = figures.packets.last().unwrap();
    assert_eq!((last.frames, last.max_bits, last.identifier.as_str()), (3, 405, "0x206"));
    assert!((last.worst_response_s.unwrap() - 4.86e-3).abs() < 1e-9, "{last:?}");
    // The most urgent one waits for a frame that has begun.
    assert!((figures.packets[0].worst_response_s.unwrap() - 4.0 * 135e-6).abs() < 1e-9);
}

#[test]
fn a_bus_that_is_asked_too_much_says_what_would_fit() {
    let (figures, report) = classic(1000.0).analyse().unwrap();
    assert!(!figures.fits && figures.worst_load > 4.8 && figures.simulated_load > 0.99, "{figures:?}");
    assert!(figures.dropped > 0 && report.timeline.busy_intervals().count() > 100);
    let advice = figures.advice.join("\n");
    assert!(advice.contains("--rate-hz 205") && advice.contains("can.data_bits_per_s=8000000"), "{advice}");
    assert!(classic(205.0).analyse().unwrap().0.fits && !classic(206.0).analyse().unwrap().0.fits);
    assert!(PLAN.analyse().unwrap().0.fits);
    let slow = CanParameters { data_bits_per_s: 2_000_000, ..PLAN.parameters };
    let (slow, _) = BusPlan { parameters: slow, ..PLAN }.analyse().unwrap();
    assert!(!slow.fits && slow.advice.iter().any(|advice| advice.contains("8 Mbit/s")), "{slow:?}");
}

#[test]
fn nothing_simulated_takes_longer_than_the_worst_case() {
    for joints in [1, 3, 6] {
        let (figures, _) = BusPlan { joints, ..PLAN }.analyse().unwrap();
        for packet in &figures.packets {
            let (seen_s, worst_s) = (packet.simulated_response_s.unwrap(), packet.worst_response_s.unwrap());
            assert!(seen_s <= worst_s && seen_s > 0.5 * worst_s - 100e-6, "{packet:?}");
        }
        assert!(
            figures.simulated_load <= figures.worst_load && figures.simulated_load > 0.8 * figures.worst_load
        );
    }
}

#[test]
fn errors_can_be_what_does_not_fit() {
    let parameters = CanParameters { bit_error_rate: 1e-3, ..PLAN.parameters };
    let (figures, _) = BusPlan { parameters, ..PLAN }.analyse().unwrap();
    assert!(figures.error_frames > 100 && !figures.fits, "{figures:?}");
    // What would take less time is no remedy.
    let [advice] = &figures.advice[..] else { panic!("{:?}", figures.advice) };
    assert!(advice.contains("fits only without bit errors"), "{advice}");
}

#[test]
fn too_little_room_to_wait_can_be_what_does_not_fit() {
    let plan =
        |queue_frames| BusPlan { parameters: CanParameters { queue_frames, ..PLAN.parameters }, ..PLAN };
    let (figures, _) = plan(5).analyse().unwrap();
    assert!(!figures.fits && figures.dropped > 0);
    let [advice] = &figures.advice[..] else { panic!("{:?}", figures.advice) };
    assert!(advice.contains("can.queue_frames=6"), "{advice}");
    assert!(plan(6).analyse().unwrap().0.fits);
}

#[test]
fn a_packet_that_no_frame_carries_is_refused() {
    let plan = BusPlan { words_to_joint: 14, ..PLAN };
    assert_eq!(plan.analyse().unwrap_err(), TooManyWords { words: 14 });
    assert!(BusPlan { words_to_joint: 13, joints: 1, ..PLAN }.analyse().unwrap().0.fits);
}
