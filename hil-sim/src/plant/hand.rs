//! A human hand on a device: mass, damping and a spring to where it wants to be.
//!
//! `F = K (target(t) - x) + push - B v`, plus its mass `M` moving with the device.
//! Mass and damping always act; a script of phases says where the spring pulls, or that there is only a push.

use super::environment::{Environment, Law, Role};
use super::hand_phase::HandPhase;
use super::parameter::{ParameterError, not_negative, require};

/// One hand on one axis. The numbers are assumptions in the usual range, not measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct HandParameters {
    /// `M`, `kg`, >= 0.
    pub mass_kg: f64,
    /// `B`, to ground, `N s/m`, >= 0. A sampled stiff controller needs some of it to be passive.
    pub damping_ns_per_m: f64,
    /// `K`, `N/m`, >= 0.
    pub stiffness_n_per_m: f64,
    /// In the order of time, without overlap.
    pub phases: Vec<HandPhase>,
}

impl Default for HandParameters {
    /// A relaxed hand, 0.5 kg, 8 N s/m, 300 N/m, that does nothing.
    fn default() -> Self {
        Self { mass_kg: 0.5, damping_ns_per_m: 8.0, stiffness_n_per_m: 300.0, phases: Vec::new() }
    }
}

impl HandParameters {
    /// Says whether a hand like this can exist.
    ///
    /// # Errors
    /// The first parameter outside its range, or the first phase that starts before the one before it ends.
    pub fn check(&self) -> Result<(), ParameterError> {
        not_negative("mass_kg", self.mass_kg)?;
        not_negative("damping_ns_per_m", self.damping_ns_per_m)?;
        not_negative("stiffness_n_per_m", self.stiffness_n_per_m)?;
        let mut free_from_s = f64::NEG_INFINITY;
        for (index, phase) in self.phases.iter().enumerate() {
            let place = format!("phases[{index}]");
            phase.check().map_err(|error| error.within(&place))?;
            let (start_s, end_s) = phase.span_s();
            let allowed = format!(">= {free_from_s}, where the phase before it ends");
            require("start_s", start_s, start_s >= free_from_s, &allowed)
                .map_err(|error| error.within(&place))?;
            free_from_s = end_s;
        }
        Ok(())
    }

    /// The hand these parameters describe.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn build(&self) -> Result<Hand, ParameterError> {
        self.check()?;
        let mut hand = Hand {
            parameters: self.clone(),
            current: 0,
            stiffness_n_per_m: 0.0,
            push_n: 0.0,
            target_m: 0.0,
            target_m_per_s: 0.0,
        };
        hand.begin_period(0.0, 0.0);
        Ok(hand)
    }
}

/// A hand at work.
#[derive(Debug, Clone)]
pub struct Hand {
    parameters: HandParameters,
    /// Index of the first phase that has not ended.
    current: usize,
    /// The spring as it acts in this period.
    stiffness_n_per_m: f64,
    push_n: f64,
    /// The target at the start of this period.
    target_m: f64,
    /// A straight line to where the script has it at the end.
    target_m_per_s: f64,
}

impl Hand {
    /// The phase that acts at `time_s`. Remembers the place, and looks back only if time did.
    fn phase_at(&mut self, time_s: f64) -> Option<&HandPhase> {
        let phases = &self.parameters.phases;
        let has_ended = |phase: &HandPhase| phase.span_s().1 <= time_s;
        if self
            .current
            .checked_sub(1)
            .and_then(|previous| phases.get(previous))
            .is_some_and(|p| !has_ended(p))
        {
            self.current = 0;
        }
        while phases.get(self.current).is_some_and(has_ended) {
            self.current += 1;
        }
        phases.get(self.current).filter(|phase| phase.span_s().0 <= time_s)
    }
}

impl Environment for Hand {
    fn role(&self) -> Role {
        Role::Hand
    }

    fn added_mass_kg(&self) -> f64 {
        self.parameters.mass_kg
    }

    fn begin_period(&mut self, start_s: f64, period_s: f64) {
        let end_s = start_s + period_s;
        let phase = self.phase_at(start_s + 0.5 * period_s);
        let push_n = match phase {
            Some(&HandPhase::Push { force_n, .. }) => force_n,
            _ => 0.0,
        };
        let ends_m = phase.and_then(|phase| Some((phase.target_m(start_s)?, phase.target_m(end_s)?)));
        let (from_m, to_m) = ends_m.unwrap_or_default();
        self.push_n = push_n;
        self.stiffness_n_per_m = if ends_m.is_some() { self.parameters.stiffness_n_per_m } else { 0.0 };
        self.target_m = from_m;
        self.target_m_per_s = if period_s > 0.0 { (to_m - from_m) / period_s } else { 0.0 };
    }

    fn law(&self, elapsed_s: f64, position_m: f64, velocity_m_per_s: f64) -> Law {
        let target_m = self.target_m + elapsed_s * self.target_m_per_s;
        let damping_ns_per_m = self.parameters.damping_ns_per_m;
        Law {
            force_n: self.stiffness_n_per_m * (target_m - position_m) + self.push_n
                - damping_ns_per_m * velocity_m_per_s,
            rate_n_per_s: self.stiffness_n_per_m * self.target_m_per_s,
            stiffness_n_per_m: self.stiffness_n_per_m,
            damping_ns_per_m,
            ..Law::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hand(phases: Vec<HandPhase>) -> Hand {
        HandParameters {
            stiffness_n_per_m: 200.0,
            damping_ns_per_m: 5.0,
            phases,
            ..HandParameters::default()
        }
        .build()
        .unwrap()
    }

    fn force_at(hand: &mut Hand, time_s: f64) -> f64 {
        let start_s = (time_s * 1e3).floor() * 1e-3;
        hand.begin_period(start_s, 1e-3);
        hand.law(time_s - start_s, 0.0, 0.0).force_n
    }

    /// Start, end, half way (half the way), and the peak speed of a minimum-jerk move.
    #[test]
    fn a_move_has_least_jerk() {
        let mut hand = hand(vec![HandPhase::Move { start_s: 1.0, end_s: 3.0, from_m: 0.01, to_m: 0.05 }]);
        assert!(force_at(&mut hand, 0.5).abs() < 1e-15, "no spring before the phase");
        assert!((force_at(&mut hand, 1.0) - 200.0 * 0.01).abs() < 1e-12);
        assert!((force_at(&mut hand, 2.0) - 200.0 * 0.03).abs() < 1e-12);
        assert!((force_at(&mut hand, 2.9999999) - 200.0 * 0.05).abs() < 1e-9);
        assert!(force_at(&mut hand, 3.0005).abs() < 1e-15, "lets go at the end");
        hand.begin_period(1.9995, 1e-3);
        assert!((hand.law(0.0, 0.0, 0.0).rate_n_per_s / (200.0 * 1.875 * 0.04 / 2.0) - 1.0).abs() < 1e-6);
        assert!((force_at(&mut hand, 1.5) - force_at(&mut hand, 1.0)).abs() > 0.1, "time may go back");
    }

    #[test]
    fn a_sine_is_followed_in_straight_lines() {
        let sine = HandPhase::Sine {
            start_s: 0.2,
            end_s: 9.0,
            center_m: 0.02,
            amplitude_m: 0.01,
            frequency_hz: 2.0,
        };
        let mut hand = hand(vec![sine]);
        for k in 0..1000_i32 {
            let time_s = 0.5 + f64::from(k) * 1e-3;
            let exact_m = |t: f64| 0.02 + 0.01 * libm::sin(core::f64::consts::TAU * 2.0 * (t - 0.2));
            hand.begin_period(time_s, 1e-3);
            let target_m = |elapsed_s: f64| hand.law(elapsed_s, 0.0, 0.0).force_n / 200.0;
            assert!((target_m(0.0) - exact_m(time_s)).abs() < 1e-15, "at {time_s} s");
            assert!((target_m(1e-3) - exact_m(time_s + 1e-3)).abs() < 1e-15, "at the end from {time_s} s");
            assert!((2.0 * target_m(5e-4) - target_m(0.0) - target_m(1e-3)).abs() < 1e-15, "straight");
        }
    }

    #[test]
    fn a_push_has_no_spring_and_damping_always_acts() {
        let mut hand = hand(vec![
            HandPhase::Push { start_s: 0.0, end_s: 1.0, force_n: 2.0 },
            HandPhase::Release { start_s: 1.0, end_s: 2.0 },
            HandPhase::Hold { start_s: 2.0, end_s: f64::INFINITY, target_m: 0.1 },
        ]);
        for (start_s, force_n) in [(0.999, 2.0 - 0.5), (1.0, -0.5), (1.999, -0.5), (2.0, 200.0 * 0.07 - 0.5)]
        {
            hand.begin_period(start_s, 1e-3);
            let force = hand.law(5e-4, 0.03, 0.1).force_n;
            assert!((force - force_n).abs() < 1e-12, "{force} N at {start_s} s");
        }
    }

    #[test]
    fn an_impossible_script_is_refused_by_place() {
        let overlapping = vec![
            HandPhase::Hold { start_s: 0.0, end_s: 2.0, target_m: 0.0 },
            HandPhase::Push { start_s: 1.0, end_s: 3.0, force_n: 1.0 },
        ];
        let backwards = vec![HandPhase::Release { start_s: 2.0, end_s: 1.0 }];
        let endless_move =
            vec![HandPhase::Move { start_s: 0.0, end_s: f64::INFINITY, from_m: 0.0, to_m: 1.0 }];
        for (phases, path) in [
            (overlapping, "phases[1].start_s"),
            (backwards, "phases[0].end_s"),
            (endless_move, "phases[0].end_s"),
        ] {
            let refused = HandParameters { phases, ..HandParameters::default() }.build().unwrap_err();
            assert_eq!(refused.path, path);
        }
    }
}
