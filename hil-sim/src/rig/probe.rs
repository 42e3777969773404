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

    /// The signal's words now; empty when it is not in the Data Base.
    pub fn words<'a>(&mut self, station: &'a Station) -> &'a [u32] {
        let data_base = station.dimsart.engine().data_base();
        let slot = match self.found {
            Some((revision, slot)) if revision == data_base.revision() => slot,
            _ => {
                let slot = data_base.slot(self.signal);
                self.found = Some((data_base.revision(), slot));
                slot
            }
        };
        slot.map(|slot| data_base.words(slot)).unwrap_or_default()
    }

    /// The signal's values now, for one of format f32.
    pub fn values<'a>(
        &mut self,
        station: &'a Station,
    ) -> impl ExactSizeIterator<Item = f64> + Clone + use<'a> {
        self.words(station).iter().map(|word| f64::from(f32::from_bits(*word)))
    }
}
