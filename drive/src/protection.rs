//! What turns the bridge off, in the period in which it shows.

use core::f32::consts::FRAC_PI_2;
use core::fmt;

use crate::Angle;
use crate::configuration::{Configuration, Inverter, Limits};
use crate::number::{larger, smaller};
use crate::sample::{Rotor, Sample};
use crate::vector::Dq;

/// Share of the trip current that the sum of the phases may be off: converters are not exact, but a dead one shows.
const SENSOR_SHARE: f32 = 0.2;
/// Of an encoder, beside what the fastest rotor turns in two periods, `rad`.
const ENCODER_NOISE_RAD: f32 = 0.01;
/// A reading of an encoder that is missing or wrong counts so much, a right one takes one back: two in a row are bridged by
/// the speed, and one in three for ever.
const BAD_READING: u8 = 2;
const MOST_BAD: u8 = 4;
/// Coldest that it can be, `°C`: a sensor whose wire is open says less.
const COLDEST_C: f32 = -40.0;
/// Share of the square of the largest current that a winding at rest loses by and by.
const COOLED_SHARE: f32 = 0.25;
/// Below this share of the fastest speed the encoder reports standstill.
const STANDSTILL_SHARE: f32 = 0.01;
/// Some checks take turns: those of the encoder's alignment and of the current control run in every third period, those of speed,
/// stall and braking in every sixth. An oscillating current control has a sixth to a fourth of the periods' frequency, of which a
/// third is no multiple.
const SLOTS: u8 = 6;

/// Tolerance of the voltage model as a share of the supply, beside the dead time: phase resistances differ by some percent.
const MODEL_SHARE: f32 = 0.01;
/// Tolerance of the d-axis voltage, of the magnets' voltage: a healthy angle is wrong by 12° at most, where `ψ` is 1.43 times as
/// configured.
const DIRECT_EMF_SHARE: f32 = 0.35;
/// Tolerance of the q-axis voltage, of the magnets' voltage: `ψ` is 1.43 times as configured.
const QUADRATURE_EMF_SHARE: f32 = 0.55;
/// Tolerance of the voltage that couples the axes: `L` is 1.43 times as configured.
const COUPLING_SHARE: f32 = 0.45;
/// Tolerance of the resistive voltage: `R` is 1.43 times as configured, and the winding 100 °C warmer.
const RESISTIVE_SHARE: f32 = 1.1;
/// The angle is wrong when the voltage exceeds its tolerance for so long, `s`, longer than currents take to change; where it
/// alternates, half of the time is taken back in which it does not.
const MISALIGNED_S: f32 = 0.005;

/// Current beyond the command, and a change beyond the command's, that are an overshoot: with `L` at 0.7 of its configured value it
/// is 19 %.
const OVERSHOOT: f32 = 1.25;
/// Tolerance of the current and of its change, of the largest current that is commanded: noise and offsets of the converters.
const CURRENT_SHARE: f32 = 0.1;
/// The largest recent command and its largest recent change are forgotten with this time constant, `s`.
const COMMAND_S: f32 = 0.01;
/// Points for a current that changes more than the command; one that does not takes one back.
const OSCILLATES: i32 = 2;
/// Points of a current control that oscillates: 3 ms without a steady current.
const MOST_OSCILLATING: i32 = 40;
/// From this share of the speed that the supply can hold against, by the configured `ψ`, a current that brakes beyond the command
/// is overspeed.
const HELD_SHARE: f32 = 0.65;
/// Of that speed, where a bridge that is off stays off: `ψ` may be configured 1.3 times too high.
const MOST_HELD_SHARE: f32 = 1.3;
/// Checks in a row with such a current: 3 ms.
const MOST_BRAKING: i32 = 10;

/// Why the bridge is off, the first reason that was found. It stays until it is [cleared](Protection::clear).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A phase has more than the trip current.
    Overcurrent,
    /// The currents of the phases do not add up to nothing: a converter is wrong, or current leaves the motor elsewhere.
    CurrentSensors,
    /// The supply is too low: it is off, its fuse is gone, or its wires are thin.
    Undervoltage,
    /// The supply is too high: braking feeds one that takes nothing.
    Overvoltage,
    /// Too hot, or the sensor is gone.
    Overtemperature,
    /// The encoder does not answer; or it reports standstill, but the voltage is that of a rotor that turns.
    EncoderLost,
    /// It says angles to which no rotor can have turned.
    EncoderJumped,
    /// Its magnet is gone, or at a wrong distance.
    EncoderMagnet,
    /// The rotor has stood still under current for too long.
    Stalled,
    /// The rotor turns faster than it may, or than the supply can hold against.
    Overspeed,
    /// The encoder's angle does not match the rotor's magnets: counts are missing, a wheel or magnet slips, or it counts in the
    /// wrong direction.
    EncoderSlipped,
    /// The current exceeds the command: the current control oscillates.
    CurrentUnstable,
}

impl Fault {
    /// What to do about it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.texts().1
    }

    /// What it is, and what to do.
    fn texts(self) -> (&'static str, &'static str) {
        match self {
            Self::Overcurrent => (
                "a phase has more than the trip current",
                "look for a short circuit, and identify the motor again: its inductance may be wrong",
            ),
            Self::CurrentSensors => (
                "the currents of the phases do not add up to nothing",
                "look at the phases' wires and the shunts' amplifiers, with the motor unplugged",
            ),
            Self::Undervoltage => (
                "the supply is below its lowest voltage",
                "look at supply, fuse and wires, at the board's terminals and under load",
            ),
            Self::Overvoltage => {
                ("the supply is above its highest voltage", "add a brake resistor, or brake less")
            }
            Self::Overtemperature => (
                "it is too hot, or the sensor of its temperature is gone",
                "let it cool, command less, or look at the sensor's wires",
            ),
            Self::EncoderLost => (
                "the encoder does not answer, or says that the rotor stands still while it turns",
                "look at the encoder's wires and supply",
            ),
            Self::EncoderJumped => (
                "the encoder says angles to which no rotor can have turned",
                "look for disturbance on the encoder's wires, and for a loose magnet or wheel",
            ),
            Self::EncoderMagnet => (
                "the encoder's magnet is gone, or at a wrong distance",
                "set the magnet to the distance that the encoder's maker wants",
            ),
            Self::Stalled => (
                "the rotor has stood still under current for too long",
                "look what holds the joint, or allow more time in `limits.stall_s`",
            ),
            Self::Overspeed => (
                "the rotor turns faster than it may, or than the supply can hold against",
                "look what drives the joint, command less, or raise `limits.speed_rad_per_s` or the supply",
            ),
            Self::EncoderSlipped => (
                "the encoder's angle does not match the rotor's magnets",
                "check the encoder's coupling, wires, counts per turn and offset",
            ),
            Self::CurrentUnstable => (
                "the current exceeds the command: the current control oscillates",
                "identify the motor again (its inductance may be too high), or lower `bandwidth_rad_per_s`",
            ),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.texts().0)
    }
}

/// What tolerances of the voltage model are made of.
#[derive(Debug, Clone)]
struct Model {
    /// Of the supply.
    share: f32,
    direct_vs: f32,
    coupling_h: f32,
    quadrature_vs: f32,
    resistive_ohm: f32,
}

/// What a drive has seen and commanded, as of the last period.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) angle: Angle,
    pub(crate) speed_rad_per_s: f32,
    pub(crate) current_a: Dq,
    /// Current that was commanded; none while the bridge was off.
    pub(crate) wanted_a: Option<f32>,
    pub(crate) bus_v: f32,
}

/// Watches a drive.
#[derive(Debug, Clone)]
pub struct Protection {
    limits: Limits,
    /// All of the checks.
    slot_s: f32,
    pole_pairs: f32,
    most_sum_a: f32,
    most_surprise_rad: f32,
    standstill_rad_per_s: f32,
    /// Most current that may be asked for, per degree below the trip temperature.
    derating_a_per_c: f32,
    /// Of the square of a current, and what a winding loses: so that all of the current takes the time that it may.
    stall_per_a2: f32,
    cooled: f32,
    /// A quarter of an electrical turn.
    held_rad: f32,
    /// Where the rotor is held, as long as it stays near.
    held_at: Angle,
    model: Model,
    misaligned: i32,
    most_misaligned: i32,
    /// The largest recent command and the largest recent change of it, and the share that is left of them in the next check of
    /// the current control.
    recent_a: f32,
    recent_change_a: f32,
    recent_share: f32,
    tolerance_a: f32,
    /// As of the last check.
    last_wanted_a: f32,
    last_current_a: Dq,
    has_jumped: bool,
    oscillating: i32,
    braking: i32,
    slot: u8,
    bad_readings: u8,
    stalled_s: f32,
    fault: Option<Fault>,
}

impl Protection {
    /// With the limits of a configuration that is [right](Configuration::check).
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a cast saturates")]
    pub fn new(configuration: &Configuration) -> Self {
        let Configuration { motor, limits, inverter, .. } = *configuration;
        let Inverter { period_s, dead_time_share, .. } = inverter;
        let slot_s = f32::from(SLOTS) * period_s;
        let pole_pairs = f32::from(motor.pole_pairs);
        Self {
            limits,
            slot_s,
            pole_pairs,
            most_sum_a: SENSOR_SHARE * limits.trip_current_a,
            most_surprise_rad: 2.0 * limits.speed_rad_per_s * period_s + ENCODER_NOISE_RAD,
            standstill_rad_per_s: STANDSTILL_SHARE * limits.speed_rad_per_s,
            derating_a_per_c: limits.current_a / (limits.trip_c - limits.derating_c),
            stall_per_a2: 1.0 / (limits.current_a * limits.current_a * (1.0 - COOLED_SHARE)),
            cooled: COOLED_SHARE / (1.0 - COOLED_SHARE),
            held_rad: FRAC_PI_2 / pole_pairs,
            held_at: Angle(0),
            model: Model {
                share: MODEL_SHARE + dead_time_share,
                direct_vs: DIRECT_EMF_SHARE * motor.flux_linkage_vs,
                coupling_h: COUPLING_SHARE * motor.quadrature_inductance_h,
                quadrature_vs: QUADRATURE_EMF_SHARE * motor.flux_linkage_vs,
                resistive_ohm: RESISTIVE_SHARE * motor.resistance_ohm,
            },
            misaligned: 0,
            most_misaligned: (4.0 * MISALIGNED_S / slot_s) as i32,
            recent_a: 0.0,
            recent_share: 1.0 - smaller(0.5 * slot_s / COMMAND_S, 1.0),
            recent_change_a: 0.0,
            last_wanted_a: 0.0,
            last_current_a: Dq::default(),
            has_jumped: false,
            oscillating: 0,
            tolerance_a: CURRENT_SHARE * limits.current_a,
            braking: 0,
            slot: 0,
            bad_readings: 0,
            stalled_s: 0.0,
            fault: None,
        }
    }

    /// Why the bridge is off; none when it may be on.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Forgets the fault: what is still wrong is found again in the next period.
    pub fn clear(&mut self) {
        if self.fault.take().is_some() {
            (self.bad_readings, self.misaligned, self.oscillating, self.braking) = (0, 0, 0, 0);
        }
    }

    /// Looks at currents, supply and temperature.
    #[inline]
    pub(crate) fn look(&mut self, sample: &Sample) {
        let Limits { trip_current_a, least_bus_v, most_bus_v, trip_c, .. } = self.limits;
        let [u, v, w] = sample.phase_a;
        // What is no number is within nothing.
        let is_within = |value: f32, most: f32| value.abs() <= most;
        let has_current =
            is_within(u, trip_current_a) && is_within(v, trip_current_a) && is_within(w, trip_current_a);
        let found = match sample {
            _ if !has_current => self.wrong_current(sample.phase_a),
            _ if !is_within(u + v + w, self.most_sum_a) => Fault::CurrentSensors,
            Sample { bus_v, .. } if *bus_v > most_bus_v => Fault::Overvoltage,
            Sample { bus_v, .. } if *bus_v >= least_bus_v => {
                match (COLDEST_C..trip_c).contains(&sample.temperature_c) {
                    true => return,
                    false => Fault::Overtemperature,
                }
            }
            _ => Fault::Undervoltage,
        };
        self.note(found);
    }

    /// Of phases of which one has more than the trip current, or its converter is at its end. A converter at its end beside two
    /// phases with usual currents is wrong: the phases add up to nothing.
    #[cold]
    fn wrong_current(&self, phase_a: [f32; 3]) -> Fault {
        let is_saturated = phase_a.iter().sum::<f32>().is_infinite();
        let is_usual = |phase_a: &f32| phase_a.is_infinite() || phase_a.abs() <= self.limits.trip_current_a;
        if is_saturated && phase_a.iter().all(is_usual) { Fault::CurrentSensors } else { Fault::Overcurrent }
    }

    /// Looks at what the encoder says, `surprise_rad` from where the rotor should be; gives that where it can be believed.
    #[inline]
    pub(crate) fn believe(&mut self, rotor: Rotor, surprise_rad: f32) -> Option<f32> {
        let found = match rotor {
            Rotor::At(_) if surprise_rad.abs() <= self.most_surprise_rad => {
                self.bad_readings = self.bad_readings.saturating_sub(1);
                return Some(surprise_rad);
            }
            Rotor::At(_) => Fault::EncoderJumped,
            Rotor::Awaited => return None,
            Rotor::Lost => Fault::EncoderLost,
            Rotor::BadMagnet => Fault::EncoderMagnet,
        };
        self.bad_readings = self.bad_readings.saturating_add(BAD_READING);
        if self.has_lost_rotor() {
            self.note(found);
        }
        None
    }

    /// Whether too many readings were missing or wrong to go by the speed: where the rotor is has to be found anew.
    #[inline]
    pub(crate) fn has_lost_rotor(&self) -> bool {
        self.bad_readings > MOST_BAD
    }

    /// The next check in turn. `unexpected_v` is the voltage that the motor makes beyond the model, where the bridge is on, and
    /// `held_rad_per_s` the speed that the supply can hold against by the configured `ψ`.
    #[inline]
    pub(crate) fn check_in_turn(
        &mut self,
        seen: &Seen,
        unexpected_v: impl FnOnce() -> Dq,
        held_rad_per_s: impl FnOnce() -> f32,
    ) {
        self.slot = if self.slot + 1 < SLOTS { self.slot + 1 } else { 0 };
        match (self.slot, seen.wanted_a) {
            (0, _) => self.check_motion(seen, held_rad_per_s()),
            (1 | 4, Some(_)) => self.check_alignment(seen, unexpected_v()),
            (2 | 5, Some(wanted_a)) => self.check_control(seen.current_a, wanted_a),
            (3, Some(wanted_a)) => self.check_braking(seen, wanted_a, held_rad_per_s()),
            _ => {}
        }
    }

    /// Speed, and the time that the rotor is held under current: within a quarter of an electrical turn, trembling or not. Beyond
    /// that another phase warms up, and half of the time is taken back.
    #[inline]
    fn check_motion(&mut self, seen: &Seen, held_rad_per_s: f32) {
        let speed_rad_per_s = seen.speed_rad_per_s.abs();
        let is_held = seen.wanted_a.is_some() || speed_rad_per_s <= MOST_HELD_SHARE * held_rad_per_s;
        if speed_rad_per_s > self.limits.speed_rad_per_s || !is_held {
            self.note(Fault::Overspeed);
        }
        let heated = seen.current_a.q * seen.current_a.q * self.stall_per_a2;
        self.stalled_s = larger(self.stalled_s + self.slot_s * (heated - self.cooled), 0.0);
        if self.stalled_s > self.limits.stall_s {
            self.note(Fault::Stalled);
        }
        if seen.angle.minus(self.held_at).rad().abs() > self.held_rad {
            self.held_at = seen.angle;
            self.stalled_s *= 0.5;
        }
    }

    /// The encoder's angle, by the voltage of the magnets: it is across them, where the angle is right. A wrong angle has it along
    /// them or, by half an electrical turn, the other way round. Where the encoder is gone the field stands, and the rotor slips
    /// past it or swings about it.
    #[inline]
    fn check_alignment(&mut self, seen: &Seen, unexpected_v: Dq) {
        let Model { share, direct_vs, coupling_h, quadrature_vs, resistive_ohm } = self.model;
        let electrical = self.pole_pairs * seen.speed_rad_per_s.abs();
        let supply_v = share * seen.bus_v;
        let most_d_v = supply_v + electrical * (direct_vs + coupling_h * self.recent_a);
        let most_q_v = supply_v + electrical * quadrature_vs + resistive_ohm * self.recent_a;
        let is_wrong = !self.has_jumped
            && self.oscillating == 0
            && (unexpected_v.d.abs() > most_d_v || unexpected_v.q.abs() > most_q_v);
        self.misaligned = (self.misaligned + if is_wrong { 2 } else { -1 }).max(0);
        if self.misaligned > self.most_misaligned {
            let stands = seen.speed_rad_per_s.abs() <= self.standstill_rad_per_s;
            self.note(if stands { Fault::EncoderLost } else { Fault::EncoderSlipped });
        }
    }

    /// The current changes no more than the recent commands.
    #[inline]
    fn check_control(&mut self, current_a: Dq, wanted_a: f32) {
        let change_a = (wanted_a - core::mem::replace(&mut self.last_wanted_a, wanted_a)).abs();
        let last_a = core::mem::replace(&mut self.last_current_a, current_a);
        self.recent_change_a = larger(change_a, self.recent_share * self.recent_change_a);
        let most_a = OVERSHOOT * self.recent_change_a + self.tolerance_a;
        let (d, q) = (current_a.d - last_a.d, current_a.q - last_a.q);
        let square = d * d + q * q;
        self.has_jumped = square > self.tolerance_a * self.tolerance_a;
        self.oscillating = (self.oscillating + if square > most_a * most_a { OSCILLATES } else { -1 }).max(0);
        if self.oscillating > MOST_OSCILLATING {
            self.note(Fault::CurrentUnstable);
        }
    }

    /// A current that brakes more than the recent commands: the supply cannot hold against the magnets.
    #[inline]
    fn check_braking(&mut self, seen: &Seen, wanted_a: f32, held_rad_per_s: f32) {
        let (speed_rad_per_s, current_a) = (seen.speed_rad_per_s, seen.current_a.q);
        let recent_share = self.recent_share * self.recent_share;
        self.recent_a = larger(wanted_a.abs(), recent_share * self.recent_a);
        let brakes = speed_rad_per_s.abs() > HELD_SHARE * held_rad_per_s
            && speed_rad_per_s * current_a < 0.0
            && current_a.abs() > OVERSHOOT * self.recent_a + self.tolerance_a;
        self.braking = if brakes && !self.has_jumped { self.braking + 1 } else { 0 };
        if self.braking > MOST_BRAKING {
            self.note(Fault::Overspeed);
        }
    }

    /// The most current that may be asked for at a temperature below the trip temperature, `A`.
    #[inline]
    pub(crate) fn current_limit_a(&self, temperature_c: f32) -> f32 {
        let Limits { current_a, trip_c, .. } = self.limits;
        smaller(self.derating_a_per_c * (trip_c - temperature_c), current_a)
    }

    fn note(&mut self, fault: Fault) {
        self.fault.get_or_insert(fault);
    }
}
