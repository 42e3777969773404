//! One side's controller, as a board runs it: its calls are timed, and it moves while a client holds the lease.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_core::{
    Command, Costs, Counter, DeviceDescriptor, Dimsart, FrameError, InputLimits, ModuleRef, Observer,
    OutputLimits, Packet, SafeValue, TickResult, Vocabulary as _, Word, scheme,
};
use dimsart_link::protocol::{DeviceInfo, LeaseAction, Request, Response, request_id, serve};
use dimsart_link::{EventKind, EventLog};

use super::PairError;
use super::failing::{COSTS, IDS, KINDS, let_write, with_failing_modules};
use super::fault::{Fault, Wrong};
use hil_sim::experiment::ExperimentError;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::SIDES;

/// What the actuators allow: the range of the shipped scenario, and as on a board all of it in 10 ms.
pub(crate) const LIMITS: InputLimits =
    InputLimits { min: -30.0, max: 30.0, rate_per_s: 3_000.0, safe_value: SafeValue::Zero };
/// What its sensors can show: 2 m each way, and 5 mm further in a tick.
pub(crate) const SENSOR_LIMITS: OutputLimits = OutputLimits { min: -2.0, max: 2.0, rate_per_s: 5.0 };
/// The client that holds the lease.
pub(crate) const CLIENT: u8 = 1;
/// How often it renews it, ticks: as `dimsart connect`.
const RENEWAL_TICKS: u32 = 50;
/// Of the shipped scenario: a lease lasts 200 of its ticks.
const TICK_HZ: u32 = 1_000;

thread_local! {
    /// Stands for a processor's counter: a thread has one of its own, and ticks one controller after the other.
    static COUNTER: &'static AtomicU32 = Box::leak(Box::new(AtomicU32::new(0)));
}

/// Has each call take its time by the counter, and takes note of it.
#[derive(Debug)]
struct Clock {
    counter: &'static AtomicU32,
    /// By the places of the calls.
    cycles: Vec<u32>,
    /// Places of the calls of the last tick.
    called: Vec<usize>,
}

impl Observer for Clock {
    fn call(&mut self, place: usize, call: impl FnOnce()) {
        call();
        self.called.push(place);
        self.counter.fetch_add(self.cycles.get(place).copied().unwrap_or_default(), Relaxed);
    }
}

/// A controller with its client and its processor's time.
#[derive(Debug)]
pub(crate) struct Controller {
    dimsart: Box<SimulatedDimsart>,
    info: DeviceInfo,
    clock: Clock,
    commanded: Vec<Word>,
    last_tick: TickResult,
    /// Modules whose calls take longer, and by how many per cent.
    slow: Vec<(&'static str, u32)>,
    /// Whether its client renews the lease.
    renews: bool,
    ticks_to_renewal: u32,
    /// Whether it did for the last tick.
    has_renewed: bool,
}

impl Controller {
    /// The side's controller of a scheme, armed.
    pub(crate) fn new(
        device: DeviceDescriptor,
        scheme: &str,
        side: &'static str,
        spare_cycles: u32,
    ) -> Result<Self, PairError> {
        let device = device.with_limits(&[&[LIMITS]])?.with_output_limits(&[SENSOR_LIMITS])?;
        let mut dimsart = Box::new(SimulatedDimsart::without_device());
        dimsart.connect(device, KINDS).map_err(ExperimentError::Storage)?;
        let counter = COUNTER.with(|counter| *counter);
        dimsart.engine_mut().set_costs(Some(Costs::new(&COSTS, &IDS)));
        dimsart.engine_mut().set_call_timer(Counter::counting_up(counter), spare_cycles);
        let commanded = vec![Word(0); dimsart.frame().input_words()];
        let mut controller = Self {
            dimsart,
            info: DeviceInfo::new("").with_client_lease(TICK_HZ),
            clock: Clock { counter, cycles: Vec::new(), called: Vec::new() },
            commanded,
            last_tick: TickResult::Idle,
            slow: Vec::new(),
            renews: true,
            ticks_to_renewal: RENEWAL_TICKS,
            has_renewed: false,
        };
        let mut first = None;
        scheme::load(&with_failing_modules(scheme), side, SIDES, &mut controller.dimsart, |error| {
            first.get_or_insert_with(|| format!("{error:?}"));
        });
        if let Some(error) = first {
            return Err(PairError::Scheme(error));
        }
        controller.take_times();
        controller.arm()?;
        Ok(controller)
    }

    /// The controller itself.
    pub(crate) fn dimsart(&self) -> &Dimsart {
        &self.dimsart
    }

    /// The commands that would build the scheme that runs.
    pub(crate) fn commands(&mut self) -> Vec<Command> {
        self.dimsart.engine_mut().rebuild_commands().collect()
    }

    /// What is kept beside it.
    pub(crate) fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Keeps what happens in a log from now on.
    pub(crate) fn keep_events(&mut self, events: &'static EventLog) {
        self.info = self.info.with_events(events);
    }

    /// Result of the last tick.
    pub(crate) fn last_tick(&self) -> TickResult {
        self.last_tick
    }

    /// Whether its client asked to renew the lease right before the last tick.
    pub(crate) fn has_renewed(&self) -> bool {
        self.has_renewed
    }

    /// The modules that were called in the last tick, as the scheme is now.
    pub(crate) fn called(&self) -> impl Iterator<Item = ModuleRef> + '_ {
        self.clock.called.iter().filter_map(|place| Some(self.dimsart.engine().steps().nth(*place)?.module))
    }

    /// Begins or ends faults of the controller itself: these are all that last.
    pub(crate) fn suffer(&mut self, wrong: &[Wrong]) {
        let slow = wrong.iter().filter_map(|wrong| match wrong.fault {
            Fault::TakesLonger(module, percent) => Some((module, percent)),
            _ => None,
        });
        self.slow = slow.collect();
        self.renews = wrong.iter().all(|wrong| wrong.fault != Fault::LeaseNotRenewed);
        self.take_times();
    }

    /// Every call takes what its module costs, or longer.
    fn take_times(&mut self) {
        let slow = &self.slow;
        let calls = self.dimsart.engine().steps().map(|step| {
            let costs = Costs::new(&COSTS, &IDS);
            let cost = costs.kind(step.module.kind).map_or(0, |cost| cost.cycles(0));
            let name = KINDS.module_name(step.module).to_string();
            let percent: u32 =
                slow.iter().filter(|(slow, _)| *slow == name).map(|(_, percent)| percent).sum();
            cost + cost * percent / 100
        });
        self.clock.cycles = calls.collect();
    }

    /// Response to a client.
    pub(crate) fn ask(&mut self, client: u8, request: &Request) -> Response<'static> {
        let answer = serve(request_id(client, 2), request, &mut self.dimsart, &mut self.info);
        if matches!(request, Request::Command(_)) {
            self.take_times();
        }
        answer
    }

    /// What its client wants and must not be refused.
    fn demand(&mut self, request: &Request) -> Result<(), PairError> {
        match self.ask(CLIENT, request) {
            Response::Refused(refusal) => Err(PairError::Refused(refusal)),
            _ => Ok(()),
        }
    }

    /// Takes the lease.
    fn arm(&mut self) -> Result<(), PairError> {
        self.ticks_to_renewal = RENEWAL_TICKS;
        self.demand(&Request::Lease(LeaseAction::Take))
    }

    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        // The controller counts refused requests.
        let _ = self.dimsart.receive(0, bytes);
    }

    pub(crate) fn outgoing(&mut self) -> Option<Packet> {
        self.dimsart.take_outgoing(0)
    }

    /// A tick in which all this is wrong; gives what the actuators get, N.
    pub(crate) fn tick(&mut self, measured: &[Word], wrong: &[Wrong]) -> Vec<f32> {
        self.ticks_to_renewal -= 1;
        self.has_renewed = self.ticks_to_renewal == 0 && self.renews;
        if self.has_renewed {
            // Refused without a lease: after a fault the client must acquire it again.
            let _ = self.ask(CLIENT, &Request::Lease(LeaseAction::Renew));
        }
        if self.ticks_to_renewal == 0 {
            self.ticks_to_renewal = RENEWAL_TICKS;
        }
        self.dimsart.set_motion_allowed(self.info.begin_tick());
        self.clock.called.clear();
        let_write(wrong);
        self.last_tick = self.dimsart.tick_observed(measured, &mut self.commanded, &mut self.clock);
        self.info.end_tick(self.last_tick, &self.dimsart);
        self.commanded.iter().map(|word| f32::from_bits(word.0)).collect()
    }

    /// Whether a module is cut out.
    pub(crate) fn is_cut(&self) -> bool {
        self.dimsart.engine().module_fault().is_some()
    }

    /// Does what is needed for its device to move again; says what that was.
    ///
    /// # Errors
    /// [`PairError::Refused`] when that is refused.
    pub(crate) fn make_move(&mut self) -> Result<&'static str, PairError> {
        let takes_reset = self.is_cut() || self.dimsart.safety().state().is_fault();
        if takes_reset {
            self.demand(&Request::Command(Command::Reset))?;
        }
        let takes_lease = self.info.heartbeat(0).lease.holder != CLIENT;
        if takes_lease {
            self.arm()?;
        }
        Ok(match (takes_reset, takes_lease) {
            (true, true) => "reset and lease",
            (true, false) => "reset",
            (false, true) => "lease",
            (false, false) => "itself",
        })
    }

    /// Number of why the last tick was not as it should be: of the reason, or of the event where a module is cut out
    /// that the device does not depend on.
    pub(crate) fn reason(&self) -> u8 {
        if self.last_tick == TickResult::Ran && self.is_cut() {
            EventKind::ModuleIsolated as u8
        } else {
            self.last_tick.reason().number()
        }
    }

    /// The named item; for a signal, its axis.
    pub(crate) fn named(&self) -> String {
        let name = |module| KINDS.module_name(module).to_string();
        match self.last_tick {
            TickResult::ModuleFailed(module) => name(module),
            TickResult::LinkLost { link } | TickResult::LinkDown { link } => format!("link {link}"),
            TickResult::MeasurementRefused(
                FrameError::NotFinite { signal, word } | FrameError::Implausible { signal, word, .. },
            ) => {
                format!("{} of axis {word}", self.dimsart.engine().signal_name(signal))
            }
            TickResult::MeasurementRefused(FrameError::Length { found, .. }) => format!("{found} words"),
            _ => self.dimsart.engine().module_fault().map(|fault| name(fault.module)).unwrap_or_default(),
        }
    }
}
