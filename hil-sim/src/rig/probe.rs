//! Looks at one signal of a station, tick after tick, without searching for it each time.

use dimsart_core::TypeRef;

use super::Station;

/// Remembers where a signal is in a station's Data Base.
#[derive(Debug, Clone)]
pub struct Probe {
    signal: TypeRef,
    /// Revision of the Data Base that `slot` is of.
    found: Option<(u32, Option<u8>)>,
}

impl Probe {
    /// A probe for a signal that need not be there yet.
    #[must_use]
    pub const fn new(signal: TypeRef) -> Self {
        Self { signal, found: None }
    }

    /// Whether the signal is in the Data Base now.
    pub fn finds(&mut self, station: &Station) -> bool {
        self.slot(station).is_some()
    }

    /// The signal's words now; empty when it is not in the Data Base.
    #[inline]
    pub fn words<'a>(&mut self, station: &'a Station) -> &'a [u32] {
        let slot = self.slot(station);
        slot.map(|slot| station.dimsart.engine().data_base().words(slot)).unwrap_or_default()
    }

    #[inline]
    fn slot(&mut self, station: &Station) -> Option<u8> {
        let data_base = station.dimsart.engine().data_base();
        match self.found {
            Some((revision, slot)) if revision == data_base.revision() => slot,
            _ => {
                let slot = data_base.slot(self.signal);
                self.found = Some((data_base.revision(), slot));
                slot
            }
        }
    }

    /// The signal's values now, for one of format f32.
    pub fn values<'a>(
        &mut self,
        station: &'a Station,
    ) -> impl ExactSizeIterator<Item = f64> + Clone + use<'a> {
        self.words(station).iter().map(|word| f64::from(f32::from_bits(*word)))
    }
}
