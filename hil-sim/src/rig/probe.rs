//! Reads one signal of a station in every tick without searching for it.

use dimsart_core::TypeRef;

use super::Station;

/// Caches the slot of a signal in a station's Data Base.
#[derive(Debug, Clone)]
pub struct Probe {
    signal: TypeRef,
    /// Data Base revision for which `slot` is valid.
    found: Option<(u32, Option<u8>)>,
}

impl Probe {
    /// Creates a probe for a signal that may not exist yet.
    #[must_use]
    pub const fn new(signal: TypeRef) -> Self {
        Self { signal, found: None }
    }

    /// Whether the signal exists now.
    pub fn is_present(&mut self, station: &Station) -> bool {
        self.slot(station).is_some()
    }

    /// Returns the signal's words; empty if it does not exist.
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

    /// Returns the values of an `f32` signal.
    pub fn values<'a>(
        &mut self,
        station: &'a Station,
    ) -> impl ExactSizeIterator<Item = f64> + Clone + use<'a> {
        self.words(station).iter().map(|word| f64::from(f32::from_bits(*word)))
    }
}
