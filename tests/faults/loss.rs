//! Random and burst losses in the two-sided loop: both sides report a lost link exactly after 20 ticks
//! without a packet, and the channel stays passive.

use std::f64::consts::PI;

use hil_sim::observer::channel_energy::ChannelEnergy;
use hil_sim::plant::ExternalForce;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::happens;
use crate::line::Loop;
use crate::loops::push;
use test_requirements::length;

/// Resolution of the energy account in packets, `J`; far above its rounding errors here.
const NOTHING_J: f64 = 1e-9;
/// A hand with this force moves each device, with a damper of 8 N s/m, by less than 0.2 m.
const FAR_M: f64 = 0.5;

/// Oscillates with 2 N at 0.7 Hz until 10 s before the end.
fn swing(duration_s: f64) -> Option<ExternalForce> {
    let force = move |t| if t < duration_s - 10.0 { 2.0 * libm::sin(2.0 * PI * 0.7 * t) } else { 0.0 };
    push(force)
}

/// Runs a loop and checks that it is passive and comes to rest; returns the sides with a lost link.
fn run(mut both: Loop, ticks: u64, what: &str) -> [bool; 2] {
    let mut energy = ChannelEnergy::new(&both.rig);
    let mut lost = [false; 2];
    let mut before_m = [0.0; 2];
    for tick in 0..ticks {
        lost = both.tick(what);
        energy.add(&both.rig);
        both.rig.advance();
        let positions_m = both.positions_m();
        assert!(
            positions_m.iter().all(|position_m| position_m.abs() < FAR_M),
            "{what}: {positions_m:?} m, tick {tick}"
        );
        if tick + 1000 == ticks {
            before_m = positions_m;
        }
    }
    let smallest_j = energy.min_j().unwrap();
    assert!(smallest_j >= -NOTHING_J, "{what}: {smallest_j:e} J");
    for (now_m, before_m) in both.positions_m().into_iter().zip(before_m) {
        assert!(
            (now_m - before_m).abs() < 1e-4,
            "{what}: still moves, {before_m} m, {now_m} m a second later"
        );
    }
    lost
}

/// 20 runs of 60 s each in the long run. 20 consecutive losses are rare at 50 % loss and certain at 70 %.
#[test]
fn chance_losses_lose_the_link_only_when_nothing_came_for_twenty_ticks() {
    let (seeds, seconds) = (length(1, 20), length(20, 60));
    for stale in ["zero", "limited"] {
        for loss in [0.001, 0.01, 0.05, 0.1, 0.2, 0.5, 0.7] {
            let mut gone = 0;
            for seed in 0..seeds {
                let what = format!("{stale}, {loss} lost, seed {seed}");
                let loses = [0, 1].map(|side| {
                    let mut random = Pcg64Mcg::seed_from_u64(300 + 2 * seed + side);
                    move |_| happens(&mut random, loss)
                });
                #[expect(clippy::cast_precision_loss, reason = "a minute")]
                let both = Loop::new(&format!("link.stale={stale}"), swing(seconds as f64), loses);
                let lost = run(both, 1000 * seconds, &what);
                gone += u64::from(lost.contains(&true));
                // 20 consecutive losses are expected once in 1e20 ticks at 10 % and once in 1e14 at 20 %.
                assert!(loss > 0.2 || lost == [false; 2], "{what}");
            }
            println!("{stale}, {loss} lost: {gone} of {seeds} runs of {seconds} s lost their link");
            assert!(loss < 0.7 || gone == seeds, "{stale}: {gone} of {seeds}");
        }
    }
}

/// Every length from 1 to 1000 at several times in the long run.
#[test]
fn bursts_of_nineteen_never_lose_the_link_and_of_twenty_always_do() {
    let is_run = |burst: &u64| *burst <= 24 || length(0, 1) == 1 || [50, 100, 333, 1000].contains(burst);
    for burst in (1..=1000).filter(is_run) {
        for start in (0..length(1, 3)).map(|index| 1000 + 137 * index) {
            for to in 0..2 {
                for stale in ["zero", "limited"] {
                    let what = format!("{stale}, {burst} lost from {start} on, to side {to}");
                    let loses =
                        [0, 1].map(|side| move |tick| side == to && (start..start + burst).contains(&tick));
                    let both = Loop::new(&format!("link.stale={stale}"), swing(12.0), loses);
                    let lost = run(both, 12_000, &what);
                    assert_eq!(lost[to], burst >= 20, "{what}");
                    assert!(!lost[1 - to], "{what}: the other side hears all");
                }
            }
        }
    }
}
