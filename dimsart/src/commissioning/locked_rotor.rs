//! Torque step on a locked rotor: compares the measured current with the commanded torque.

use std::io::{Read, Write};
use std::time::Duration;

use hil_sim::recording::{Column, Recording};
use hil_sim::schemes::SchemeText;

use super::ticks::wait;
use super::{BoardEnvironment, Check};
use crate::connect::{ALL_DESTINATIONS, ConnectError, Device, Subscription, SubscriptionRow};
use crate::report::{Curve, Figure, Level, Panel};

/// A constant torque, initially 0.
const SCHEME: &str = "\
all MOD_ENG CLOSE
all SIGGEN_MOD FORM CONSTANT
all SIGGEN_MOD AMPLITUDE 0
all SIGGEN_MOD PORT_SIGNAL_OUT DES_FORCE
all MOD_ENG MOD_ON SIGGEN_MOD
all MOD_ENG MATCHING_CHECK
";
/// Maximum time of the encoder alignment, `s`.
const ALIGNING_S: f64 = 9.0;
/// Time before and after the step, and of the step, `s`.
const BEFORE_S: f64 = 0.1;
const STEP_S: f64 = 0.4;
/// Time from the step to the comparison: the rate of commands is limited, `s`.
const SETTLING_S: f64 = 0.15;
/// Tolerance of the current.
const SHARE: f64 = 0.1;
/// Maximum angle of a locked rotor, `rad`.
const HELD_RAD: f64 = 0.2;
const A_MOMENT: Duration = Duration::from_millis(5);
const SIGNALS: [&str; 3] = ["DES_FORCE", "MOTOR_CURRENT", "POSITION"];

/// Parameters of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LockedRotor {
    /// Height of the step, `N m`.
    pub torque_nm: f64,
    /// Torque constant of the motor, `N m/A`, above 0.
    pub torque_constant_nm_per_a: f64,
}

/// The measured step, for a picture.
#[derive(Debug)]
pub struct Step {
    figure: Figure,
    recording: Recording,
}

impl Step {
    /// Returns the figure and its recording.
    #[must_use]
    pub fn picture(&self) -> (&Figure, &Recording) {
        (&self.figure, &self.recording)
    }
}

impl LockedRotor {
    /// Replaces the scheme by a constant torque of 0. Returns the rows of the old scheme, for [`restore_scheme`](Self::restore_scheme).
    ///
    /// # Errors
    /// [`ConnectError`] if the device does not answer or refuses the scheme.
    pub fn load_zero_torque_scheme<S: Read + Write>(device: &mut Device<S>) -> Result<String, ConnectError> {
        let rows = device.scheme_rows(None)?;
        let scheme = SchemeText { name: "constant-torque scheme".to_owned(), text: SCHEME.to_owned() };
        device.replace_scheme(&scheme, ALL_DESTINATIONS)?;
        Ok(rows)
    }

    /// Arms the board for 9 s to align its encoder; the rotor must be free to turn.
    ///
    /// # Errors
    /// [`ConnectError`] if the device does not answer or refuses the lease.
    pub fn align_encoder<S: Read + Write>(
        device: &mut Device<S>,
        around: &impl BoardEnvironment,
    ) -> Result<(), ConnectError> {
        device.hold_lease()?;
        let waited = wait(device, around, ALIGNING_S);
        device.release_lease()?;
        waited
    }

    /// Arms the board for less than a second and commands the step.
    ///
    /// # Errors
    /// As [`align_encoder`](Self::align_encoder).
    pub fn step<S: Read + Write>(
        &self,
        device: &mut Device<S>,
        around: &impl BoardEnvironment,
    ) -> Result<(Check, Step), ConnectError> {
        let names = SIGNALS.map(str::to_owned);
        device.require_signals(&names)?;
        let mut tap = Subscription::new(1).with_signals(&names);
        device.hold_lease()?;
        let recorded = self.record(device, around, &mut tap);
        // Also after an error.
        let ended = device.set("SIGGEN_MOD", "AMPLITUDE[0]", "0");
        device.release_lease()?;
        device.close_telemetry(&mut tap)?;
        ended?;
        let (rows, reason) = recorded?;
        let period_s = f64::from(device.identity().sample_period_s);
        let widths: Vec<usize> = tap.signals().iter().map(|signal| signal.words).collect();
        Ok((self.judge(&rows, &widths, period_s, reason), self.draw(&rows, &widths, period_s)))
    }

    /// Restores the old scheme.
    ///
    /// # Errors
    /// As [`align_encoder`](Self::align_encoder).
    pub fn restore_scheme<S: Read + Write>(device: &mut Device<S>, rows: &str) -> Result<(), ConnectError> {
        let scheme = SchemeText { name: "previous scheme".to_owned(), text: rows.to_owned() };
        device.replace_scheme(&scheme, ALL_DESTINATIONS).map(drop)
    }

    fn record<S: Read + Write>(
        &self,
        device: &mut Device<S>,
        around: &impl BoardEnvironment,
        tap: &mut Subscription,
    ) -> Result<(Vec<SubscriptionRow>, Option<&'static str>), ConnectError> {
        let mut rows = Vec::new();
        for (torque_nm, time_s) in [(0.0, BEFORE_S), (self.torque_nm, STEP_S), (0.0, BEFORE_S)] {
            device.set("SIGGEN_MOD", "AMPLITUDE[0]", &torque_nm.to_string())?;
            let end_s = around.now_s() + time_s;
            while around.now_s() < end_s {
                rows.extend(device.receive_rows(tap, A_MOMENT)?);
            }
        }
        Ok((rows, device.reason()?.map(dimsart_core::SafetyReason::name)))
    }

    fn wanted_a(&self) -> f64 {
        self.torque_nm / self.torque_constant_nm_per_a
    }

    fn judge(
        &self,
        rows: &[SubscriptionRow],
        widths: &[usize],
        period_s: f64,
        reason: Option<&str>,
    ) -> Check {
        let name = "torque on a locked rotor";
        let next =
            "check the motor's torque constant in the catalogue, the shunt scaling and the phase wires";
        let expected = format!(
            "{:.3} A ±{:.0} % ({} N m / {} N m/A), rotor locked",
            self.wanted_a(),
            100.0 * SHARE,
            self.torque_nm,
            self.torque_constant_nm_per_a
        );
        if let Some(reason) = reason {
            let next = "run `faults`: it lists the fault and the next step";
            return Check::new(name, false, format!("step aborted by {reason}"), expected, next);
        }
        let settled: Vec<[f64; 3]> = settled(rows, widths, self.torque_nm, period_s);
        if settled.is_empty() {
            return Check::new(name, false, "no samples of the step were received", expected, next);
        }
        #[expect(clippy::cast_precision_loss, reason = "a few hundred")]
        let mean_a = settled.iter().map(|row| row[1]).sum::<f64>() / settled.len() as f64;
        let angles = rows.iter().filter_map(|row| firsts(row, widths)).map(|row| row[2]);
        let (least, most) =
            angles.fold((f64::MAX, f64::MIN), |(least, most), angle| (least.min(angle), most.max(angle)));
        let is_held = most - least < HELD_RAD;
        Check::new(
            name,
            is_held && (mean_a / self.wanted_a() - 1.0).abs() <= SHARE,
            format!(
                "{mean_a:.3} A, mean of {} ticks; the rotor turned by {:.3} rad",
                settled.len(),
                most - least
            ),
            expected,
            if is_held { next } else { "the rotor turned: clamp the rotor" },
        )
    }

    fn draw(&self, rows: &[SubscriptionRow], widths: &[usize], period_s: f64) -> Step {
        let columns = [("DES_FORCE / kt", "A"), ("MOTOR_CURRENT", "A"), ("POSITION", "rad")];
        let columns = columns.map(|(signal, unit)| Column {
            source: "board".to_owned(),
            signal: signal.to_owned(),
            indices: Vec::new(),
            unit: unit.to_owned(),
            format: None,
        });
        let mut recording = Recording::new(columns.to_vec());
        let begin = rows.first().map_or(0, |row| row.tick);
        for row in rows {
            let Some([force_nm, current_a, angle_rad]) = firsts(row, widths) else { continue };
            let time_s = f64::from(row.tick.wrapping_sub(begin)) * period_s;
            let values = [force_nm / self.torque_constant_nm_per_a, current_a, angle_rad];
            recording.add_row(time_s).iter_mut().zip(values).for_each(|(place, value)| *place = value);
        }
        let curve = |label: &str, column| Curve { label: label.to_owned(), column, subtracted_column: None };
        let panel = |title: &str, y_label: &str, curves, levels| Panel {
            title: title.to_owned(),
            y_label: y_label.to_owned(),
            curves,
            levels,
        };
        let level = Level { label: "expected".to_owned(), value: self.wanted_a() };
        let figure = Figure {
            file_stem: "locked_rotor".to_owned(),
            title: "Torque step on a locked rotor".to_owned(),
            panels: vec![
                panel(
                    "Torque-producing current",
                    "current (A)",
                    vec![curve("measured", 1), curve("commanded torque / kt", 0)],
                    vec![level],
                ),
                panel("Rotor", "angle (rad)", vec![curve("angle", 2)], Vec::new()),
            ],
            spans: Vec::new(),
        };
        Step { figure, recording }
    }
}

/// The first axis of each signal.
fn firsts(row: &SubscriptionRow, widths: &[usize]) -> Option<[f64; 3]> {
    let [force, current, _] = widths else { return None };
    let value = |place: usize| row.values.get(place).copied().filter(|value| value.is_finite());
    Some([value(0)?, value(*force)?, value(force + current)?])
}

/// The rows of the settled step.
fn settled(rows: &[SubscriptionRow], widths: &[usize], torque_nm: f64, period_s: f64) -> Vec<[f64; 3]> {
    let on: Vec<(u32, [f64; 3])> = rows
        .iter()
        .filter_map(|row| Some((row.tick, firsts(row, widths)?)))
        .filter(|(_, [force_nm, ..])| (force_nm / torque_nm - 1.0).abs() < 0.01)
        .collect();
    let Some((begin, _)) = on.first().copied() else { return Vec::new() };
    let is_settled = |tick: u32| f64::from(tick.wrapping_sub(begin)) * period_s > SETTLING_S;
    on.into_iter().filter(|(tick, _)| is_settled(*tick)).map(|(_, row)| row).collect()
}
