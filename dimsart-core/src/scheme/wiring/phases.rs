//! Phases of the modules that do not run in every tick.

use super::Wiring;
use crate::module::{Load, Rate};
use crate::scheme::wiring::module_bit;

impl Wiring {
    /// Starts a tick; returns the modules that do not run in it, one bit per place in the plug-in order.
    #[inline]
    pub(crate) fn resting(&mut self) -> u32 {
        if self.has_rates { self.count_down() } else { 0 }
    }

    #[inline(never)]
    fn count_down(&mut self) -> u32 {
        let mut resting = 0;
        for (order, plugged) in (0..).zip(self.modules.iter_mut()) {
            if !plugged.rate.is_due() {
                resting |= module_bit(order);
            }
        }
        resting
    }

    /// Assigns phases to the modules that do not run in every tick. Modules that depend on each other run in
    /// the same ticks as far as their rates allow; the others are spread over the ticks with the least load,
    /// by cost. A module with the same rate in the scheme `before` keeps its phase if possible.
    #[inline(never)]
    pub(crate) fn spread(&mut self, before: Option<&Self>, costs: &[Option<u32>]) {
        let slow = (0..).zip(self.modules.iter()).filter(|(_, plugged)| plugged.rate.is_slow());
        let slow = slow.fold(0, |slow, (order, _)| slow | module_bit(order));
        self.has_rates = slow != 0;
        let (mut load, mut placed) = (Load::NONE, 0);
        for stays in [true, false] {
            for ((order, at), cost) in (0..).zip(0..self.modules.len()).zip(costs) {
                let Some(plugged) = self.modules.get(at).filter(|plugged| plugged.rate.is_slow()) else {
                    continue;
                };
                let every_ticks = plugged.rate.every_ticks;
                let known = before.and_then(|before| before.find(plugged.module)).map(|known| known.rate);
                let known = known.filter(|known| known.every_ticks == every_ticks);
                if known.is_some() != stays {
                    continue;
                }
                let group = self.group_of(order, slow) & placed;
                let fits = |rate: &Rate| {
                    let mut others = (0..).zip(self.modules.iter());
                    others.all(|(other, found)| group & module_bit(other) == 0 || found.rate.meets(*rate))
                };
                let rate = known.filter(fits).unwrap_or_else(|| load.lightest(every_ticks, fits));
                load.add(rate, cost.unwrap_or(1));
                placed |= module_bit(order);
                if let Some(plugged) = self.modules.get_mut(at) {
                    plugged.rate = rate;
                }
            }
        }
    }

    /// Returns the modules of `slow` that share their ticks with a module: those connected to it by
    /// dependencies.
    fn group_of(&self, order: u8, slow: u32) -> u32 {
        let mut group = module_bit(order);
        loop {
            let needed = (0..).zip(self.modules.iter()).filter(|(order, _)| group & module_bit(*order) != 0);
            let needed = needed.fold(0, |needed, (_, plugged)| needed | plugged.needs);
            let grown = (needed | self.fall_with(group)) & slow;
            if grown == group {
                return group;
            }
            group = grown;
        }
    }
}
