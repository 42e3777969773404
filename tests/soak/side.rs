//! A side of the experiment with its own clock.

use dimsart_core::{Packet, SafetyReason, TickResult, TypeRef, Word, types};
use hil_sim::experiment::Experiment;
use hil_sim::plant::{ExternalForce, Joint, JointParameters, Joints, Plant, StopsParameters};
use hil_sim::rig::SimulatedDimsart;
use hil_sim::rig_file::RigFile;

pub(crate) const DOF: usize = 3;
/// Compensates losses and bursts; otherwise positions drift, as documented.
const SETTINGS: [&str; 2] = ["link.stale=limited", "link.playout_ticks=4"];
/// Grains per W: squares of waves add up without rounding.
const GRAINS_PER_W: f64 = (1_u128 << 70) as f64;
/// Centres of the axes' oscillation; the first axis touches the wall in every period.
const CENTERS_M: [f64; DOF] = [0.03, 0.0, 0.0];
const FREQUENCIES_HZ: [f64; DOF] = [0.5, 0.7, 1.1];
const AMPLITUDE_M: f64 = 0.03;

pub(crate) struct Side {
    dimsart: Box<SimulatedDimsart>,
    plant: Joints,
    period_ns: u64,
    pub(crate) next_ns: u64,
    pub(crate) ticks: u64,
    /// Ticks with a received packet.
    pub(crate) taken: u64,
    /// Wraps of the packet and energy counters.
    pub(crate) rounds: u64,
    pub(crate) energy_rounds: u64,
    last_counters: [u32; 2],
    pub(crate) position_m: [f32; DOF],
    pub(crate) force_n: [f32; DOF],
    /// Energy to the line minus energy from it.
    grains: [i128; DOF],
    slots: [u8; 3],
}

impl Side {
    pub(crate) fn master(period_ns: u64) -> Self {
        // A hand of 0.05 kg, 10 N s/m and 300 N/m.
        let hand = |axis: usize| -> ExternalForce {
            let center_m = CENTERS_M[axis];
            let rad_per_s = std::f64::consts::TAU * FREQUENCIES_HZ[axis];
            Box::new(move |t| 300.0 * (center_m + AMPLITUDE_M * libm::sin(rad_per_s * t)))
        };
        let mut held = axis(0.1, 10.5);
        held.load.stiffness = 300.0;
        Self::new(0, period_ns, [0, 1, 2].map(|number| (held.build().unwrap(), Some(hand(number)))))
    }

    pub(crate) fn slave(period_ns: u64) -> Self {
        let mut free = axis(0.2, 10.0);
        free.stops = Some(StopsParameters { max: 0.05, damping: 10.0, ..StopsParameters::default() });
        Self::new(1, period_ns, [(); DOF].map(|()| (free.build().unwrap(), None)))
    }

    fn new(station: usize, period_ns: u64, axes: [(Joint, Option<ExternalForce>); DOF]) -> Self {
        let file = RigFile::from_shipped("bilateral", &SETTINGS.map(str::to_owned)).unwrap();
        let mut experiment = Experiment::new(&file).unwrap();
        let station = &mut experiment.rig_mut().stations_mut()[station];
        let dimsart = std::mem::replace(&mut station.dimsart, Box::new(SimulatedDimsart::without_device()));
        let slot = |signal: TypeRef| dimsart.engine().data_base().slot(signal).unwrap();
        let slots = [types::CH1_WAVES.first(), types::CH2_WAVES.first(), types::LINK_AGE.first()].map(slot);
        Self {
            dimsart,
            plant: Joints::new(axes.into()),
            period_ns,
            next_ns: 0,
            ticks: 0,
            taken: 0,
            rounds: 0,
            energy_rounds: 0,
            last_counters: [0; 2],
            position_m: [0.0; DOF],
            force_n: [0.0; DOF],
            grains: [0; DOF],
            slots,
        }
    }

    pub(crate) fn name(&self) -> String {
        self.dimsart.engine().device().name().to_owned()
    }

    pub(crate) fn receive(&mut self, packet: &Packet) {
        self.dimsart.receive(0, &packet.to_bytes()).unwrap();
    }

    /// Runs a tick with the device enabled, and the plant until the next one; returns the packet.
    pub(crate) fn tick(&mut self) -> Packet {
        self.plant.sense(&mut self.position_m);
        let mut commanded = [Word(0); DOF];
        let tick = self.dimsart.tick(&self.position_m.map(Word::from), &mut commanded);
        assert_eq!(tick, TickResult::Ran, "after {} ns", self.next_ns);
        self.force_n = commanded.map(|word| f32::from_bits(word.0));
        self.account();
        let packet = self.dimsart.take_outgoing(0).unwrap();
        let counters = [packet.counter.into(), packet.words[DOF + 1]];
        self.rounds += u64::from(counters[0] < self.last_counters[0]);
        self.energy_rounds += u64::from(counters[1] < self.last_counters[1]);
        self.last_counters = counters;
        self.plant.advance(self.next_ns as f64 * 1e-9, self.period_ns as f64 * 1e-9, &self.force_n);
        self.next_ns += self.period_ns;
        self.ticks += 1;
        packet
    }

    fn account(&mut self) {
        let data_base = self.dimsart.engine().data_base();
        let [sent, received, age] = self.slots.map(|slot| data_base.words(slot));
        self.taken += u64::from(age[0] == 0);
        let grains = |word: u32| {
            let wave = f64::from(f32::from_bits(word));
            (wave * wave * GRAINS_PER_W) as i128
        };
        for (axis, sum) in self.grains.iter_mut().enumerate() {
            *sum += grains(sent[axis]) - grains(received[axis]);
        }
    }

    /// In the controllers' own ticks.
    pub(crate) fn energy_j(&self, axis: usize) -> f64 {
        0.5e-3 * (self.grains[axis] as f64 / GRAINS_PER_W)
    }

    pub(crate) fn count(&self, name: &str) -> u32 {
        self.count_of(self.dimsart.engine().device().signal(name).unwrap())
    }

    fn count_of(&self, signal: TypeRef) -> u32 {
        self.dimsart.signals(&[signal]).next().unwrap().0
    }

    pub(crate) fn refused_ticks(&self) -> u32 {
        self.dimsart.refused_ticks()
    }

    /// Returns every reason with its number of ticks.
    pub(crate) fn reasons(&self) -> Vec<(SafetyReason, u32)> {
        self.dimsart.safety().counts().iter().filter(|(_, ticks)| *ticks > 0).collect()
    }
}

fn axis(mass_kg: f64, damping_n_s_per_m: f64) -> JointParameters {
    let mut joint = JointParameters::of_inertia(mass_kg);
    joint.load.damping = damping_n_s_per_m;
    joint
}
