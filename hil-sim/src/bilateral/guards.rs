//! The guards of a link whose scenario names a key.

use dimsart_link::auth::{Guard, Key, Line, Profile};
use dimsart_link::protocol::KeyBytes;

use super::Side;
use crate::emulated::BoardKey;
use crate::experiment::ExperimentError;
use crate::key_file::{self, KeyFileError};
use crate::link::{Address, Channels, Ends};
use crate::rig::{Rig, Station};
use crate::scenario::{CarrierKind, Scenario};

/// What both sides authenticate packets with, if they do.
fn key(scenario: &Scenario) -> Result<Option<Key>, KeyFileError> {
    let bytes = scenario.link.key_file.as_deref().map(key_file::read).transpose()?;
    Ok(bytes.as_ref().map(Key::new))
}

/// Number of the link of an experiment, at both sides.
const LINK: u8 = 0;

fn guard(key: &Key, is_classic_can: bool, seed: u64, out: u16, listening: u16) -> Guard {
    let profile = if is_classic_can { Profile::Short } else { Profile::Full };
    let mut guard = Guard::new(key, Line::Link(LINK), profile, seed);
    guard.send_on(out);
    guard.listen(listening);
    guard
}

/// Guards both ends of a simulated link, master first. They have found together when the run begins.
pub(super) fn guard_both(scenario: &Scenario, rig: &mut Rig, ends: Ends) -> Result<(), ExperimentError> {
    let Some(key) = key(scenario)? else { return Ok(()) };
    let Ends { forward_channel, backward_channel } = ends;
    let channels = [(forward_channel, backward_channel), (backward_channel, forward_channel)];
    let is_classic_can = scenario.link.carrier == CarrierKind::Can;
    for (index, (station, (out, listening))) in (0..).zip(rig.stations_mut().iter_mut().zip(channels)) {
        // Two runs of a seed are alike, and nothing is replayed from one to the other.
        let seed = scenario.seed.wrapping_mul(2).wrapping_add(index);
        let guard = guard(&key, is_classic_can, seed, out, listening);
        station.guard(LINK.into(), guard, scenario.sample_period_s);
    }
    rig.introduce(0, 1);
    Ok(())
}

/// What an emulated board is given to authenticate packets with, if they are.
pub(super) fn board_key(scenario: &Scenario, side: Side) -> Result<Option<BoardKey>, KeyFileError> {
    let bytes = scenario.link.key_file.as_deref().map(key_file::read).transpose()?;
    // As for a guard, and far from one's.
    let salt = !scenario.seed.wrapping_mul(2).wrapping_add(u64::from(side == Side::Slave)).rotate_left(32);
    Ok(bytes.map(|bytes| BoardKey { bytes: KeyBytes(bytes), salt }))
}

/// Guards this side's end of a link to another process or a board.
pub(super) fn guard_one(
    scenario: &Scenario,
    side: Side,
    station: &mut Station,
    channels: Channels,
) -> Result<(), ExperimentError> {
    let Some(key) = key(scenario)? else { return Ok(()) };
    let is_classic_can = matches!(side.address(scenario), Address::Can { is_fd: false, .. });
    let guard = guard(&key, is_classic_can, getrandom::u64()?, channels.out, channels.listening);
    station.guard(LINK.into(), guard, scenario.sample_period_s);
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::experiment::Experiment;

    fn load(carrier: &str, key: Option<&std::path::Path>) -> (f64, u64) {
        let mut sets = vec![format!("link.carrier={carrier}"), "duration_s=0.5".to_owned()];
        sets.push("link.every_ticks=4".to_owned());
        sets.extend(key.map(|key| format!("link.key_file='{}'", key.display())));
        let scenario = Scenario::load(None, &sets).unwrap();
        let run = Experiment::new(&scenario).unwrap().run(&AtomicBool::new(false), |_| {});
        assert!(run.outcome.stable, "{:?}", run.outcome.faults);
        assert_eq!(run.outcome.faults, Vec::<String>::new(), "{carrier}");
        (
            run.media.iter().map(|medium| medium.traffic.load).sum(),
            run.outcome.round_trip_ticks.unwrap().into(),
        )
    }

    /// Table 1 at 3 axes, both ways: 47 bytes without a key.
    #[test]
    fn a_tag_costs_its_bytes_on_every_carrier() {
        let key = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(key.path(), "00112233445566778899aabbccddeeff").unwrap();
        // Of a byte stream, 62 bytes in place of 50; of CAN FD, frames of 64 in place of 48 bytes; of classic CAN,
        // 10 frames in place of 9, which with the other side's are more than a tick takes; of UDP, 87 bytes in place of 75.
        for (carrier, more, ticks) in
            [("uart", 62.0 / 50.0, 0), ("can_fd", 1.24, 0), ("can", 1.12, 2), ("udp", 87.0 / 75.0, 0)]
        {
            let (without, with) = (load(carrier, None), load(carrier, Some(key.path())));
            let ratio = with.0 / without.0;
            assert!((ratio - more).abs() < 0.04, "{carrier}: {ratio} times the load");
            assert_eq!(with.1, without.1 + ticks, "{carrier}");
        }
    }
}
