//! The exact steps of the regimes met so far, so that each is computed once.

use super::SUB_STEPS_MIN;
use super::scene::{RegimeKey, Scene};
use super::transition::Transition;

/// Regimes times halvings in use are fewer in any usual scene.
const KNOWN_MAX: usize = 64;

/// The length of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Span {
    /// The whole period.
    Period,
    /// A sub-step, halved so many times.
    SubStep {
        /// How many times.
        halvings: u8,
    },
}

/// The exact step of one regime over one length.
#[derive(Debug, Clone, Copy)]
struct Known {
    key: RegimeKey,
    span: Span,
    transition: Transition,
}

/// All steps for one period.
#[derive(Debug)]
pub(super) struct Transitions {
    /// Length of the period, `s`.
    pub(super) period_s: f64,
    known: Vec<Known>,
    latest: Known,
}

impl Transitions {
    /// A store that knows the step of `key`.
    pub(super) fn new(scene: &Scene, key: RegimeKey, period_s: f64) -> Self {
        let transition = scene.transition(key, period_s);
        let latest = Known { key, span: Span::Period, transition };
        Self { period_s, known: vec![latest], latest }
    }

    /// The step of `key` over `span`.
    #[inline]
    pub(super) fn get(&mut self, scene: &Scene, key: RegimeKey, span: Span) -> &Transition {
        if self.latest.key != key || self.latest.span != span {
            self.latest = self.seek(scene, key, span);
        }
        &self.latest.transition
    }

    #[cold]
    #[inline(never)]
    fn seek(&mut self, scene: &Scene, key: RegimeKey, span: Span) -> Known {
        if let Some(known) = self.known.iter().find(|known| known.key == key && known.span == span) {
            return *known;
        }
        if self.known.len() >= KNOWN_MAX {
            self.known.clear();
        }
        let step_s = match span {
            Span::Period => self.period_s,
            Span::SubStep { halvings } => {
                self.period_s / f64::from(SUB_STEPS_MIN) / f64::from(1_u32 << halvings)
            }
        };
        let made = Known { key, span, transition: scene.transition(key, step_s) };
        self.known.push(made);
        made
    }
}
