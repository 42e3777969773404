//! Authenticated end of a link.

use dimsart_core::envelope::MAX_CONTENT_BYTES;
use dimsart_link::auth::{AuthError, SecureChannel};

/// Maximum answers per tick, as limited by the line of a board.
const MAX_ANSWERS: usize = 64;

/// A guard and its state.
#[derive(Debug)]
pub(super) struct Guarded {
    /// Number of the link in the station's Data Base.
    pub(super) link: usize,
    pub(super) guard: SecureChannel,
    pub(super) refusal: Option<AuthError>,
    /// Answers to packets since the last tick.
    answers: Vec<Vec<u8>>,
    period_s: f64,
    ticks: u32,
}

impl Guarded {
    pub(super) fn new(link: usize, guard: SecureChannel, period_s: f64) -> Self {
        Self { link, guard, refusal: None, answers: Vec::new(), period_s, ticks: 0 }
    }

    /// Advances time, also while the plants stand still.
    pub(super) fn tick(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a clock that wraps")]
    fn now_ms(&self) -> u32 {
        (f64::from(self.ticks) * self.period_s * 1e3) as u64 as u32
    }

    /// Passes verified packets to `deliver` and drops refused packets.
    pub(super) fn open(&mut self, bytes: &[u8], mut deliver: impl FnMut(&[u8])) {
        let now_ms = self.now_ms();
        match self.guard.open(now_ms, bytes, &mut [0; MAX_CONTENT_BYTES]) {
            Ok(content) => content.into_iter().for_each(deliver),
            Err(error) => {
                self.refusal = Some(error);
                deliver(&[]);
            }
        }
        while let Some(handshake) = self.guard.handshake(now_ms).filter(|_| self.answers.len() < MAX_ANSWERS)
        {
            self.answers.push(handshake.to_vec());
        }
    }

    /// Returns the handshakes that are due.
    pub(super) fn send_handshake(&mut self, mut carry: impl FnMut(&[u8])) {
        let now_ms = self.now_ms();
        self.answers.drain(..).for_each(|answer| carry(&answer));
        while let Some(handshake) = self.guard.handshake(now_ms) {
            carry(handshake);
        }
    }

    /// Adds the tag to a packet and passes it to `carry`; drops the packet until the peer has answered.
    pub(super) fn seal(&mut self, content: &[u8], carry: impl FnMut(&[u8])) {
        let mut out = [0; MAX_CONTENT_BYTES];
        self.guard.seal(content, &mut out).into_iter().for_each(carry);
    }
}

/// Completes the handshake of two guards without a link.
pub(super) fn complete_handshake(left: &mut SecureChannel, right: &mut SecureChannel) {
    let tell = |from: &mut SecureChannel, to: &mut SecureChannel, now_ms| {
        while let Some(handshake) = from.handshake(now_ms) {
            // A handshake with equal keys and channels always succeeds.
            let _ = to.open(now_ms, handshake, &mut []);
        }
    };
    for now_ms in 1..=3 {
        tell(left, right, now_ms);
        tell(right, left, now_ms);
    }
}

#[cfg(test)]
mod tests {
    use dimsart_core::envelope::{Class, MAX_CONTENT_BYTES, seal};
    use dimsart_core::{TickResult, types};
    use dimsart_link::auth::{Key, KeyDomain, Profile, SecureChannel};

    use crate::experiment::Experiment;
    use crate::link::Payload;
    use crate::rig::{Probe, Rig};
    use crate::rig_file::RigFile;

    /// Table 1 with a key, over a link with this one-way delay in ticks.
    fn experiment(delay_ticks: u32) -> Experiment {
        let key = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(key.path(), "00112233445566778899aabbccddeeff").unwrap();
        let sets = [
            format!("link.key_file='{}'", key.path().display()),
            format!("link.forward_delay_ticks={delay_ticks}"),
            format!("link.backward_delay_ticks={delay_ticks}"),
        ];
        Experiment::new(&RigFile::from_shipped("bilateral", &sets).unwrap()).unwrap()
    }

    /// Steps the rig and requires both controllers to keep running; returns the longest time without a packet, ticks.
    fn run(rig: &mut Rig, ticks: u32, mut before: impl FnMut(&mut Rig, u32)) -> u32 {
        let mut longest = 0;
        for tick in 0..ticks {
            before(rig, tick);
            rig.step();
            for station in rig.stations() {
                assert_eq!(station.last_tick, TickResult::Ran, "{} in tick {tick}", station.name);
                longest = longest.max(Probe::new(types::LINK_AGE.first()).words(station)[0]);
            }
        }
        longest
    }

    fn handshake(kind: u8, random: u64, length: usize, channel: u16) -> Vec<u8> {
        let mut buffer = [0; MAX_CONTENT_BYTES];
        buffer[3] = kind;
        buffer[7..15].copy_from_slice(&random.to_le_bytes());
        seal(Class::Handshake, channel, 0, 4 + length, &mut buffer).unwrap().to_vec()
    }

    /// Two false challenges of 19 bytes used to be sufficient; also any other forged frame at any rate.
    #[test]
    fn a_forger_without_the_key_does_not_trip_a_link() {
        let mut experiment = experiment(3);
        let rig = experiment.rig_mut();
        run(rig, 300, |_, _| ());
        let before = run(rig, 100, |_, _| ());
        let during = run(rig, 2000, |rig, tick| {
            for station in rig.stations_mut() {
                let channel = station.dimsart.receive_channel(0);
                for (kind, length) in [(0, 0), (1, 8), (2, 16), (3, 8), (4, 16), (5, 16), (6, 8), (7, 0)] {
                    let random = u64::from(tick) << 8 | u64::from(kind);
                    station.receive(0, 0, Payload::Bytes(handshake(kind, random, length, channel)));
                }
                station.receive(0, 0, Payload::Bytes(vec![0x83; 59]));
            }
        });
        assert_eq!(during, before, "not a packet came late");
    }

    /// By one-way delay in ticks: the longest silence after a restart of the peer's guard.
    #[test]
    fn a_start_of_the_other_side_does_not_trip_a_link() {
        let key = Key::new(&0x0011_2233_4455_6677_8899_aabb_ccdd_eeff_u128.to_be_bytes());
        for delay_ticks in 0..=3 {
            let mut experiment = experiment(delay_ticks);
            let rig = experiment.rig_mut();
            run(rig, 300, |_, _| ());
            let longest = run(rig, 100, |rig, tick| {
                if tick == 0 {
                    let [master, slave] = rig.stations_mut() else { panic!("two") };
                    let (out, listening) =
                        (slave.dimsart.receive_channel(0), master.dimsart.receive_channel(0));
                    let mut guard = SecureChannel::new(&key, KeyDomain::Link(0), Profile::Full, 99);
                    guard.set_send_channel(out);
                    guard.set_receive_channel(listening);
                    master.enable_authentication(0, guard, 1e-3);
                }
            });
            println!("{delay_ticks} ticks one way: {longest} ticks without a packet");
            assert!(longest < 20, "{longest}");
        }
    }
}
