//! Setup of a drive before torque control: one request at a time, without blocking.

use super::{Cia402Abort, Cia402Frame, Cia402JointFault, Cia402Node, Cia402Settings, TORQUE_MODE};

/// Maximum ticks for a response; then the setup restarts.
const ANSWER_TICKS: u8 = 100;
/// Bits of the COB-ID in the PDO communication parameters: PDO disabled; no remote frames.
const OFF: u32 = 1 << 31;
const NO_REMOTE: u32 = 1 << 30;

const START: u8 = 0x01;
const ENTER_PRE_OPERATIONAL: u8 = 0x80;

const RATED_TORQUE: u16 = 0x6076;
const OUT_OF_RANGE: u32 = 0x0609_0030;

/// A step of the setup.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// Network management command.
    Network(u8),
    Write {
        index: u16,
        part: u8,
        bytes: u8,
        value: u32,
        /// Number of the optional feature that it belongs to; 0 if mandatory.
        optional: u8,
    },
    ReadRatedTorque,
}

/// A process data object and its mapping: index, sub-index and bits of each entry.
struct Pdo {
    parameters: u16,
    id: u32,
    /// Transmission type: every n-th SYNC.
    transmission: u32,
    maps: &'static [u32],
    optional: u8,
}

/// Controlword and torque; statusword, position and torque; velocity and mode; supply voltage at a lower rate.
#[rustfmt::skip]
const PDOS: [Pdo; 4] = [
    Pdo { parameters: 0x1400, id: 0x200, transmission: 1, maps: &[0x6040_0010, 0x6071_0010], optional: 0 },
    Pdo { parameters: 0x1800, id: NO_REMOTE | 0x180, transmission: 1, maps: &[0x6041_0010, 0x6064_0020, 0x6077_0010], optional: 0 },
    Pdo { parameters: 0x1801, id: NO_REMOTE | 0x280, transmission: 1, maps: &[0x606c_0020, 0x6061_0008], optional: 0 },
    Pdo { parameters: 0x1802, id: NO_REMOTE | 0x380, transmission: 10, maps: &[0x6079_0020], optional: 1 },
];

impl Pdo {
    /// Returns the steps to configure the PDO; it is disabled meanwhile.
    fn steps(&'static self, node: u32) -> impl Iterator<Item = Step> {
        let (parameters, mapping, optional) = (self.parameters, self.parameters + 0x200, self.optional);
        let of = move |index, part, bytes, value| Step::Write { index, part, bytes, value, optional };
        let id = self.id | node;
        let before =
            [of(parameters, 1, 4, OFF | id), of(parameters, 2, 1, self.transmission), of(mapping, 0, 1, 0)];
        let maps = (1..).zip(self.maps).map(move |(part, mapped)| of(mapping, part, 4, *mapped));
        let count = self.maps.iter().fold(0, |count, _| count + 1);
        let after = [of(mapping, 0, 1, count), of(parameters, 1, 4, id)];
        before.into_iter().chain(maps).chain(after)
    }
}

/// Progress of the setup.
#[derive(Debug, Clone)]
pub(super) struct Setup {
    node: Cia402Node,
    /// Consumer heartbeat entry: node of the host and timeout, ms.
    watched: u32,
    heartbeat_ms: u16,
    place: usize,
    /// Ticks since the request of the present step.
    waited: Option<u8>,
    pub(super) is_done: bool,
    pub(super) refusal: Option<Cia402JointFault>,
    /// Rated torque of the motor, `N m`.
    pub(super) rated_nm: f32,
}

impl Setup {
    pub(super) fn new(settings: &Cia402Settings) -> Self {
        Self {
            node: settings.node,
            watched: u32::from(settings.host.number()) << 16 | u32::from(settings.timeout_ms()),
            heartbeat_ms: settings.heartbeat_ms(),
            place: 0,
            waited: None,
            is_done: false,
            refusal: None,
            rated_nm: f32::NAN,
        }
    }

    pub(super) fn begin(&mut self) {
        (self.place, self.waited, self.is_done) = (0, None, false);
    }

    /// Returns the next request, if any. Call once per tick.
    pub(super) fn frame(&mut self) -> Option<Cia402Frame> {
        match &mut self.waited {
            Some(ticks) if *ticks < ANSWER_TICKS => {
                *ticks += 1;
                return None;
            }
            // A refusal is reported until the next attempt.
            Some(_) => self.begin(),
            None => {}
        }
        let step = self.step()?;
        self.waited = Some(0);
        Some(match step {
            Step::Network(command) => {
                if command == ENTER_PRE_OPERATIONAL {
                    // NMT commands have no response.
                    self.go_on(1);
                }
                Cia402Frame::new(Cia402Node::NMT_ID, [command, self.node.number()])
            }
            Step::Write { index, part, bytes, value, .. } => {
                let kind = 0x23 | (4_u8.saturating_sub(bytes) << 2);
                self.question(kind, index, part, value)
            }
            Step::ReadRatedTorque => self.question(0x40, RATED_TORQUE, 0, 0),
        })
    }

    /// Processes a response; ignores unsolicited ones.
    pub(super) fn receive(&mut self, data: &[u8]) {
        let (Some([kind, low, high, part, value @ ..]), Some(step)) = (data.first_chunk::<8>(), self.step())
        else {
            return;
        };
        let (index, value) = (u16::from_le_bytes([*low, *high]), u32::from_le_bytes(*value));
        let is_asked = self.waited.is_some()
            && match step {
                Step::Write { index: of_step, part: of_part, .. } => (of_step, of_part) == (index, *part),
                Step::ReadRatedTorque => index == RATED_TORQUE,
                Step::Network(_) => false,
            };
        match (kind, step) {
            _ if !is_asked => {}
            (0x60, Step::Write { .. }) => self.go_on(1),
            // 4 bytes, with or without an indicated size.
            (0x43 | 0x42, Step::ReadRatedTorque) if value > 0 => {
                self.rated_nm = 1e-3 * value as f32;
                self.go_on(1);
            }
            (0x43 | 0x42, Step::ReadRatedTorque) => self.refuse(index, OUT_OF_RANGE),
            (0x80, Step::Write { optional: option @ 1.., .. }) => {
                let is_of_it =
                    |step: &Step| matches!(step, Step::Write { optional, .. } if *optional == option);
                let steps = self.steps().skip(self.place).take_while(is_of_it).count();
                self.go_on(steps);
            }
            (0x80, _) => self.refuse(index, value),
            _ => {}
        }
    }

    /// Completes the setup when the drive becomes operational after the last step.
    pub(super) fn see_operational(&mut self) {
        if self.waited.is_some() && self.step() == Some(Step::Network(START)) {
            (self.place, self.waited, self.is_done, self.refusal) = (usize::MAX, None, true, None);
        }
    }

    fn go_on(&mut self, steps: usize) {
        (self.place, self.waited) = (self.place + steps, None);
    }

    fn refuse(&mut self, object: u16, code: u32) {
        self.refusal = Some(Cia402JointFault::Refused { object, abort: Cia402Abort::from_code(code) });
    }

    fn question(&self, kind: u8, index: u16, part: u8, value: u32) -> Cia402Frame {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        Cia402Frame::new(self.node.request_id(), [kind, low, high, part, a, b, c, d])
    }

    fn step(&self) -> Option<Step> {
        self.steps().nth(self.place)
    }

    fn steps(&self) -> impl Iterator<Item = Step> + use<> {
        let node = u32::from(self.node.number());
        let of = |index, part, bytes, value| Step::Write { index, part, bytes, value, optional: 0 };
        let before = [
            Step::Network(ENTER_PRE_OPERATIONAL),
            // Disable voltage.
            of(0x6040, 0, 2, 0),
            of(0x1016, 1, 4, self.watched),
            of(0x1017, 0, 2, self.heartbeat_ms.into()),
            // Fault on loss of the controller's heartbeat.
            of(0x6007, 0, 2, 1),
            of(0x6060, 0, 1, TORQUE_MODE.unsigned_abs().into()),
            of(0x6071, 0, 2, 0),
            Step::ReadRatedTorque,
        ];
        let pdos = PDOS.iter().flat_map(move |pdo| pdo.steps(node));
        // Disable the fourth TPDO, which may be active by default.
        let fourth = OFF | NO_REMOTE | 0x480 | node;
        let fourth = Step::Write { index: 0x1803, part: 1, bytes: 4, value: fourth, optional: 2 };
        before.into_iter().chain(pdos).chain([fourth, Step::Network(START)])
    }
}
