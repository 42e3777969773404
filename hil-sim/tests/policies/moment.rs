//! What a policy speaks of: a tick of a side, what was before it, and what the world knows of it.

use crate::faulty_pair::{CLIENT, Wrong};
use dimsart_core::{Command, ModuleRef};
use dimsart_link::protocol::{LeaseAction, Request};

use crate::seen::Seen;
use crate::sensors::Sensors;

/// Modules of the pair.
pub(crate) const RECEIVER: ModuleRef = ModuleRef::new("COMM_RXMOD", 1);
pub(crate) const TRANSFORMER: ModuleRef = ModuleRef::new("WTRANSF_MOD", 1);
pub(crate) const DELAY: ModuleRef = ModuleRef::new("TIMEDELAY_MOD", 1);
pub(crate) const SENDER: ModuleRef = ModuleRef::new("COMM_TXMOD", 1);
pub(crate) const NAMES: [&str; 5] =
    ["COMM_RXMOD", "WTRANSF_MOD", "PDCTRL_MOD", "TIMEDELAY_MOD", "COMM_TXMOD"];

/// The module that can fail at this place.
pub(crate) fn failing(place: u8) -> ModuleRef {
    ModuleRef::new("FAILING_MOD", place)
}

/// Request of a client between two ticks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked {
    pub(crate) client: u8,
    pub(crate) request: Request,
    pub(crate) is_taken: bool,
}

impl Asked {
    pub(crate) fn is_taken_command(&self, command: Command) -> bool {
        self.is_taken && self.request == Request::Command(command)
    }

    pub(crate) fn is_taken_lease(&self) -> bool {
        self.is_taken && self.request == Request::Lease(LeaseAction::Take)
    }
}

/// What the world knows of a side beside what it shows, by its own account.
#[derive(Debug, Clone, Default)]
pub(crate) struct Known {
    /// Holder of the lease and its remaining ticks.
    pub(crate) lease: Option<(u8, u32)>,
    /// Ticks since a packet came that was new.
    pub(crate) silent_ticks: u32,
    /// Counter of the newest one, since the receiver began.
    pub(crate) heard: Option<u16>,
    /// Whether some command has changed the scheme.
    pub(crate) is_changed: bool,
    /// Whether a receiver that has just begun was given a packet from before: it cannot know.
    pub(crate) is_replayed: bool,
    pub(crate) sensors: Sensors,
    /// Energy that this side's waves brought to the line and took from it, axis by axis, J.
    pub(crate) energy_j: Vec<[f64; 2]>,
}

/// A tick of a side.
#[derive(Debug)]
pub(crate) struct Moment<'a> {
    pub(crate) before: &'a Seen,
    pub(crate) asked: &'a [Asked],
    pub(crate) now: &'a Seen,
    pub(crate) wrong: &'a [Wrong],
    /// Whether somebody held the lease in this tick.
    pub(crate) is_armed: bool,
    /// Whether what the device gave is no measurement.
    pub(crate) is_frame_bad: bool,
    pub(crate) known: &'a Known,
    pub(crate) other: &'a Known,
    pub(crate) spare_cycles: u32,
}

impl Moment<'_> {
    pub(crate) fn has_taken(&self, command: Command) -> bool {
        self.asked.iter().any(|asked| asked.is_taken_command(command))
    }

    /// Whether a command was taken from anybody since the tick before.
    pub(crate) fn has_commanded(&self) -> bool {
        self.asked.iter().any(|asked| asked.is_taken && matches!(asked.request, Request::Command(_)))
    }

    /// Whether a link that has brought something is silent for longer than it may.
    pub(crate) fn is_silent(&self) -> bool {
        self.known.heard.is_some() && self.known.silent_ticks >= TIMEOUT_TICKS
    }

    /// Whether any parameter or module of either side is not as shipped.
    pub(crate) fn is_changed(&self) -> bool {
        self.known.is_changed || self.other.is_changed
    }
}

/// Of the shipped receiver.
pub(crate) const TIMEOUT_TICKS: u32 = 20;
/// That a lease lasts.
const LEASE_TICKS: u32 = 200;

impl Known {
    /// Takes note of what was asked for before a tick, and whether the scheme ran then.
    pub(crate) fn note(&mut self, asked: &Asked, is_running: bool) {
        if !asked.is_taken {
            return;
        }
        match asked.request {
            Request::Lease(LeaseAction::Take | LeaseAction::Renew) => {
                self.lease = Some((asked.client, LEASE_TICKS));
            }
            Request::Lease(LeaseAction::Release) | Request::Command(Command::Stop) => self.lease = None,
            Request::Command(Command::Reset | Command::Close) => self.heard = None,
            // It starts what stands still, and changes nothing of what runs.
            Request::Command(Command::Check) if !is_running => self.heard = None,
            Request::Command(Command::ResetModule(RECEIVER)) => self.heard = None,
            _ => {}
        }
        if asked.request == Request::Command(Command::Reset) {
            self.sensors.begin_anew();
        }
        self.is_changed |= match asked.request {
            Request::Command(command) => !matches!(
                command,
                Command::Reset | Command::ResetModule(_) | Command::Stop | Command::Begin | Command::Abort
            ),
            _ => false,
        };
    }

    /// Counts a tick of the lease; whether somebody held it.
    pub(crate) fn count_lease(&mut self, has_renewed: bool) -> bool {
        let renewed = self.lease.filter(|(holder, _)| has_renewed && *holder == CLIENT);
        self.lease = renewed.map(|(holder, _)| (holder, LEASE_TICKS)).or(self.lease);
        self.lease = self.lease.and_then(|(holder, ticks)| Some((holder, ticks.checked_sub(1)?)));
        self.lease.is_some()
    }

    /// Takes note of what came over the line in a tick.
    pub(crate) fn hear(&mut self, counter: Option<u16>, now: &Seen) {
        self.silent_ticks += 1;
        let is_new = |counter: &u16| self.heard.is_none_or(|heard| dimsart_core::is_newer(*counter, heard));
        if let Some(counter) = counter.filter(is_new)
            && now.calls_of(RECEIVER) > 0
        {
            (self.heard, self.silent_ticks) = (Some(counter), 0);
        }
    }

    /// Takes note of the waves of a tick.
    pub(crate) fn count_energy(&mut self, now: &Seen) {
        self.energy_j.resize(now.given_n.len(), [0.0; 2]);
        // The transformer's late stage makes the wave that leaves.
        let counts = [now.calls_of(TRANSFORMER) == 2, now.calls_of(RECEIVER) == 1];
        for ((sum_j, counts), waves) in [0, 1].into_iter().zip(counts).zip(&now.waves) {
            for (energy_j, wave) in self.energy_j.iter_mut().zip(waves) {
                if counts && wave.is_finite() {
                    energy_j[sum_j] += 0.5e-3 * f64::from(*wave) * f64::from(*wave);
                }
            }
        }
    }
}
