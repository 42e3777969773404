//! One side's controller, as a board runs it: its calls are timed, and it moves while a client holds the lease.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_core::protocol::{DeviceInfo, LeaseAction, Refusal, Request, Response, request_id, serve};
use dimsart_core::{
    Command, Costs, Counter, DeviceDescriptor, Dimsart, Engine, EventKind, FrameError, InputLimits, Observer,
    OutputLimits, Packet, SafeValue, Tick, Vocabulary as _, Word, scheme,
};

use super::FaultTableError;
use super::failing::{COSTS, Kinds, with_failing_modules};
use crate::experiment::{ExperimentError, Side};
use crate::rig::DATA_BASE_WORDS;
use crate::scenario::Scenario;
use crate::schemes::{SIDES, SchemeText};

/// What the actuators allow: the range of the shipped scenario, and as on a board all of it in 10 ms.
pub(super) const LIMITS: InputLimits =
    InputLimits { min: -30.0, max: 30.0, rate_per_s: 3_000.0, safe_value: SafeValue::Zero };
/// What its sensors can show: 2 m each way, and 5 mm further in a tick.
const SENSOR_LIMITS: OutputLimits = OutputLimits { min: -2.0, max: 2.0, rate_per_s: 5.0 };
/// The client that holds the lease, and how often it renews it, ticks: as `dimsart connect`.
const CLIENT: u8 = 1;
const RENEWAL_TICKS: u32 = 50;
/// Of the shipped scenario: a lease lasts 200 of its ticks.
const TICK_HZ: u32 = 1_000;

thread_local! {
    /// Stands for a processor's counter: a thread has one of its own, and ticks one controller after the other.
    static COUNTER: &'static AtomicU32 = Box::leak(Box::new(AtomicU32::new(0)));
}

/// Has each call take its time by the counter.
#[derive(Debug)]
struct Clock {
    counter: &'static AtomicU32,
    /// By the places of the calls.
    cycles: Vec<u32>,
}

impl Observer for Clock {
    fn call(&mut self, place: usize, call: impl FnOnce()) {
        call();
        self.counter.fetch_add(self.cycles.get(place).copied().unwrap_or_default(), Relaxed);
    }
}

#[derive(Debug)]
pub(super) struct Controller {
    dimsart: Box<Dimsart<Kinds, DATA_BASE_WORDS>>,
    info: DeviceInfo,
    clock: Clock,
    commanded: Vec<Word>,
    pub(super) last_tick: Tick,
    /// Whether its client renews the lease.
    pub(super) renews: bool,
    ticks_to_renewal: u32,
}

impl Controller {
    /// The side's controller of the shipped scheme, armed.
    pub(super) fn new(scenario: &Scenario, side: Side, spare_cycles: u32) -> Result<Self, FaultTableError> {
        let device = crate::experiment::device(side.name(), scenario.dof, scenario.sample_period_s)?;
        let device: DeviceDescriptor =
            device.with_limits(&[&[LIMITS]])?.with_output_limits(&[SENSOR_LIMITS])?;
        let mut dimsart = Box::new(Dimsart::unconnected());
        dimsart.connect(device).map_err(ExperimentError::Storage)?;
        let counter = COUNTER.with(|counter| *counter);
        dimsart.engine_mut().set_costs(Some(Costs::new(&COSTS)));
        dimsart.engine_mut().time_calls(Counter::up(counter), spare_cycles);
        let commanded = vec![Word(0); dimsart.frame().input_words()];
        let mut controller = Self {
            dimsart,
            info: DeviceInfo::new("").for_clients(TICK_HZ),
            clock: Clock { counter, cycles: Vec::new() },
            commanded,
            last_tick: Tick::Idle,
            renews: true,
            ticks_to_renewal: RENEWAL_TICKS,
        };
        let scheme = SchemeText::read(&side.section(scenario).scheme)?;
        controller.load(&with_failing_modules(&scheme.text), side)?;
        controller.take_times("", 0);
        controller.arm()?;
        Ok(controller)
    }

    fn load(&mut self, rows: &str, side: Side) -> Result<(), FaultTableError> {
        let mut first = None;
        scheme::load(rows, side.name(), SIDES, &mut self.dimsart, |error| {
            first.get_or_insert_with(|| format!("{error:?}"));
        });
        first.map_or(Ok(()), |error| Err(FaultTableError::Scheme(error)))
    }

    /// Every call takes what its module costs, those of one module so many per cent longer.
    pub(super) fn take_times(&mut self, slow: &str, percent: u32) {
        let calls = self.dimsart.engine().steps().map(|step| {
            let cost = COSTS.get(usize::from(step.module.kind) + 1).map_or(0, |cost| cost.cycles(0));
            let is_slow = Engine::<Kinds>::module_name(step.module).to_string() == slow;
            cost + if is_slow { cost * percent / 100 } else { 0 }
        });
        self.clock.cycles = calls.collect();
    }

    /// Tells a module that can fail what to write.
    pub(super) fn let_write(&mut self, number: u8, what: &str, axis: usize) -> Result<(), FaultTableError> {
        let rows = format!("m&s FAILING_MOD.{number} AXIS {axis}\nm&s FAILING_MOD.{number} WRITES {what}\n");
        self.load(&rows, Side::Master)
    }

    /// What its client is answered.
    fn ask(&mut self, request: &Request) -> Result<(), Refusal> {
        let id = request_id(CLIENT, 2);
        match serve(id, request, &mut self.dimsart, &mut self.info) {
            Response::Refused(refusal) => Err(refusal),
            _ => Ok(()),
        }
    }

    /// Takes the lease.
    pub(super) fn arm(&mut self) -> Result<(), FaultTableError> {
        self.ticks_to_renewal = RENEWAL_TICKS;
        self.ask(&Request::Lease(LeaseAction::Take)).map_err(FaultTableError::Refused)
    }

    pub(super) fn receive(&mut self, bytes: &[u8]) {
        // What is refused is counted by the controller.
        let _ = self.dimsart.receive(0, bytes);
    }

    pub(super) fn outgoing(&mut self) -> Option<Packet> {
        self.dimsart.outgoing(0)
    }

    /// A tick; gives what the actuators get, N.
    pub(super) fn tick(&mut self, measured: &[Word]) -> Vec<f32> {
        self.ticks_to_renewal -= 1;
        if self.ticks_to_renewal == 0 {
            self.ticks_to_renewal = RENEWAL_TICKS;
            if self.renews {
                // Refused while there is nothing to renew: after a fault it is to be taken anew.
                let _ = self.ask(&Request::Lease(LeaseAction::Renew));
            }
        }
        self.dimsart.allow_motion(self.info.begin_tick());
        self.last_tick = self.dimsart.tick_observed(measured, &mut self.commanded, &mut self.clock);
        self.info.end_tick(self.last_tick, &self.dimsart);
        self.commanded.iter().map(|word| f32::from_bits(word.0)).collect()
    }

    /// Whether a module is cut out.
    pub(super) fn is_cut(&self) -> bool {
        self.dimsart.engine().module_fault().is_some()
    }

    /// Does what is needed for its device to move again; says what that was.
    pub(super) fn make_move(&mut self) -> Result<&'static str, FaultTableError> {
        let takes_reset = self.is_cut() || self.dimsart.safety().state().is_fault();
        if takes_reset {
            self.ask(&Request::Command(Command::Reset)).map_err(FaultTableError::Refused)?;
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
    pub(super) fn reason(&self) -> u8 {
        if self.last_tick == Tick::Ran && self.is_cut() {
            EventKind::ModuleCutOut as u8
        } else {
            self.last_tick.reason().number()
        }
    }

    /// What is named with it, and the axis of a signal that is.
    pub(super) fn named(&self) -> String {
        let name = |module| Engine::<Kinds>::module_name(module).to_string();
        match self.last_tick {
            Tick::ModuleFailed(module) => name(module),
            Tick::LinkLost { link } => format!("link {link}"),
            Tick::MeasurementRefused(
                FrameError::NotFinite { signal, word } | FrameError::Implausible { signal, word, .. },
            ) => {
                format!("{} of axis {word}", self.dimsart.engine().name_of_signal(signal))
            }
            Tick::MeasurementRefused(FrameError::Length { found, .. }) => format!("{found} words"),
            _ => self.dimsart.engine().module_fault().map(|fault| name(fault.module)).unwrap_or_default(),
        }
    }
}
