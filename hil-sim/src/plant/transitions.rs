//! The exact steps of the regimes met so far, so that each is computed once.

use super::scene::{RegimeKey, Scene};
use super::transition::Transition;

/// Regimes times halvings in use are fewer in any usual scene.
const KNOWN_MAX: usize = 64;

/// The exact step of one regime over one length.
#[derive(Debug, Clone, Copy)]
struct Known {
    key: RegimeKey,
    halvings: u8,
    transition: Transition,
}

/// All steps of one sub-step length.
#[derive(Debug)]
pub(super) struct Transitions {
    /// Length of a sub-step that is not halved, `s`.
    pub(super) sub_step_s: f64,
    known: Vec<Known>,
    latest: Known,
}

impl Transitions {
    /// A store that knows the step of `key`.
    pub(super) fn new(scene: &Scene, key: RegimeKey, sub_step_s: f64) -> Self {
        let latest = Known { key, halvings: 0, transition: scene.transition(key, sub_step_s) };
        Self { sub_step_s, known: vec![latest], latest }
    }

    /// The step of `key` over a sub-step halved `halvings` times.
    #[inline]
    pub(super) fn get(&mut self, scene: &Scene, key: RegimeKey, halvings: u8) -> &Transition {
        if self.latest.key != key || self.latest.halvings != halvings {
            self.latest = self.seek(scene, key, halvings);
        }
        &self.latest.transition
    }

    #[cold]
    #[inline(never)]
    fn seek(&mut self, scene: &Scene, key: RegimeKey, halvings: u8) -> Known {
        if let Some(known) = self.known.iter().find(|known| known.key == key && known.halvings == halvings) {
            return *known;
        }
        if self.known.len() >= KNOWN_MAX {
            self.known.clear();
        }
        let step_s = self.sub_step_s / f64::from(1_u32 << halvings);
        let made = Known { key, halvings, transition: scene.transition(key, step_s) };
        self.known.push(made);
        made
    }
}
