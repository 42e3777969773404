//! Guards of links with a key.

use std::collections::BTreeMap;
use std::path::PathBuf;

use dimsart_link::auth::{Key, KeyDomain, Profile, SecureChannel};
use dimsart_link::protocol::KeyBytes;

use crate::emulated::BoardKey;
use crate::experiment::ExperimentError;
use crate::key_file;
use crate::link::{Address, Channels};
use crate::rig::{Rig, Station};
use crate::rig_file::{ControllerAxes, LinkSection, RigFile};

fn guard(key: &Key, link: u8, is_classic_can: bool, seed: u64, [out, listening]: [u16; 2]) -> SecureChannel {
    let profile = if is_classic_can { Profile::Short } else { Profile::Full };
    let mut guard = SecureChannel::new(key, KeyDomain::Link(link), profile, seed);
    guard.set_send_channel(out);
    guard.set_receive_channel(listening);
    guard
}

/// Returns the path of a link's key file.
fn key_path(file: &RigFile, link: &LinkSection) -> Option<PathBuf> {
    link.key_file.as_deref().map(|path| file.resolve(path))
}

/// Seeds of both ends of a link: runs with equal seeds are identical, and no packet is valid in the other direction.
fn seed(file: &RigFile, station: usize) -> u64 {
    file.seed.wrapping_mul(2).wrapping_add(station as u64)
}

/// Adds guards to both ends of every link with a key, with completed handshakes.
pub(super) fn guard_all(
    file: &RigFile,
    parts: &[ControllerAxes<'_>],
    rig: &mut Rig,
) -> Result<(), ExperimentError> {
    for link in &file.links {
        let Some(path) = key_path(file, link) else { continue };
        let key = Key::new(&key_file::read(&path)?);
        let place = |name: &str| parts.iter().position(|part| part.name() == name).unwrap_or_default();
        let ends = [(place(&link.from), link.from_link), (place(&link.to), link.to_link)];
        let bus = file.buses.iter().find(|bus| link.bus.as_ref() == Some(&bus.name));
        let is_classic_can = bus.is_some_and(|bus| bus.can.is_some());
        let channel = |(station, link): (usize, u8)| {
            let found = rig.stations().get(station);
            found.map_or(0, |station| station.dimsart.receive_channel(link.into()))
        };
        let [one, other] = ends.map(channel);
        // The reverse link uses the same guards.
        for ((station, number), channels) in ends.into_iter().zip([[other, one], [one, other]]) {
            let guard = guard(&key, number, is_classic_can, seed(file, station), channels);
            if let Some(station) = rig.stations_mut().get_mut(station).filter(|found| !found.is_guarded()) {
                station.enable_authentication(number.into(), guard, file.sample_period_s);
            }
        }
        let [(one, _), (other, _)] = ends;
        rig.complete_handshake(one.min(other), one.max(other));
    }
    Ok(())
}

/// Returns, by controller, the authentication data of an emulated board.
pub(super) fn board_keys(file: &RigFile) -> Result<BTreeMap<String, BoardKey>, ExperimentError> {
    let mut keys = BTreeMap::new();
    for (place, part) in ControllerAxes::all(file).iter().enumerate() {
        let path =
            file.links.iter().filter(|link| link.from == part.name()).find_map(|link| key_path(file, link));
        if let Some(path) = path {
            // Seeds as for a guard, but different from a guard's.
            let salt = !seed(file, place).rotate_left(32);
            keys.insert(part.name().to_owned(), BoardKey { bytes: KeyBytes(key_file::read(&path)?), salt });
        }
    }
    Ok(keys)
}

/// Adds a guard to a station's link to another process or a board.
pub(super) fn guard_one(
    file: &RigFile,
    link: &LinkSection,
    own: &Address,
    station: &mut Station,
    channels: Channels,
) -> Result<(), ExperimentError> {
    let Some(path) = key_path(file, link) else { return Ok(()) };
    let key = Key::new(&key_file::read(&path)?);
    let is_classic_can = matches!(own, Address::Can { is_fd: false, .. });
    let number = link.from_link;
    let guard = guard(&key, number, is_classic_can, getrandom::u64()?, [channels.out, channels.receive]);
    station.enable_authentication(number.into(), guard, file.sample_period_s);
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
        let file = RigFile::from_shipped("bilateral", &sets).unwrap();
        let run = Experiment::new(&file).unwrap().run(&AtomicBool::new(false), |_| {});
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
        // On a byte stream, 62 instead of 50 bytes; CAN FD: 64 instead of 48 bytes; classic CAN: 10 instead of 9
        // frames, which with the peer's exceed a tick; UDP: 87 instead of 75 bytes.
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
