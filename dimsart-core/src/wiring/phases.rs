//! In which ticks the modules run that do not run in every one.

use super::Wiring;
use crate::rate::Load;
use crate::wiring::module_bit;

impl Wiring {
    /// A tick begins. Modules that do not run in it, a bit for each place in the plug-in order.
    #[inline]
    pub(crate) fn resting(&mut self) -> u32 {
        if self.has_rates { self.count_down() } else { 0 }
    }

    #[inline(never)]
    fn count_down(&mut self) -> u32 {
        let mut resting = 0;
        for (order, plugged) in (0..).zip(&mut self.modules) {
            if !plugged.rate.is_due() {
                resting |= module_bit(order);
            }
        }
        resting
    }

    /// Spreads the modules that do not run in every tick over the ticks that have least to do, by what each of them
    /// weighs. One that ran as often in the scheme before goes on as there.
    #[inline(never)]
    pub(crate) fn spread(&mut self, before: &Self, costs: &[Option<u32>]) {
        let mut load = Load::NONE;
        self.has_rates = false;
        for goes_on in [true, false] {
            let mut start = 0;
            let slow = self.modules.iter_mut().zip(costs).filter(|(plugged, _)| plugged.rate.is_slow());
            for (plugged, cost) in slow {
                self.has_rates = true;
                let every_ticks = plugged.rate.every_ticks;
                let known = before.find(plugged.module).map(|known| known.rate);
                let known = known.filter(|known| known.every_ticks == every_ticks);
                if known.is_some() == goes_on {
                    plugged.rate = known.unwrap_or_else(|| load.lightest(every_ticks, start));
                    load.add(plugged.rate, cost.unwrap_or(1));
                }
                start = plugged.rate.left_ticks;
            }
        }
    }
}
