//! Lists of module kinds.

use super::laws::{LAWS, Laws};
use crate::module::rate::{self, EVERY_TICKS};
use crate::module::{KindId, ModuleKind, ModuleRef};
use crate::parameter::{Parameter, Parameters};
use crate::vocabulary::Name;
use crate::vocabulary::names::numbered;

/// A list of module kinds, of an image or of a host program.
#[doc(alias = "List of Modules")]
#[derive(Debug, Clone, Copy)]
pub struct ModuleKinds {
    list: &'static [&'static ModuleKind],
    /// Functions for programs; none if no kind runs programs, so that the image does not contain them.
    laws: Option<&'static Laws>,
}

impl ModuleKinds {
    /// Empty list.
    pub const NONE: Self = Self::new(&[]);

    /// Creates a list, such as `&[&ModuleKind::of::<MyLaw>()]`.
    ///
    /// # Panics
    /// When two kinds have the same [id](KindId); for a constant this is a build error. Rename one of them.
    #[must_use]
    pub const fn new(kinds: &'static [&'static ModuleKind]) -> Self {
        let (mut rest, mut laws) = (kinds, None);
        while let [first, others @ ..] = rest {
            rest = others;
            if first.runs_program() {
                laws = Some(&LAWS);
            }
            let mut others = others;
            while let [other, beyond @ ..] = others {
                assert!(
                    first.id.bits() != other.id.bits(),
                    "two module kinds have the same id: rename one of them"
                );
                others = beyond;
            }
        }
        Self { list: kinds, laws }
    }

    /// Returns all kinds, in order.
    #[must_use]
    pub const fn list(self) -> &'static [&'static ModuleKind] {
        self.list
    }

    /// Returns the functions for programs, if a kind runs programs.
    pub(super) const fn laws(self) -> Option<&'static Laws> {
        self.laws
    }

    /// Returns the ids of all kinds.
    #[must_use]
    #[expect(clippy::indexing_slicing, reason = "a constant: out of bounds is a build error")]
    pub const fn ids<const COUNT: usize>(self) -> [KindId; COUNT] {
        let mut ids = [KindId::from_name(""); COUNT];
        let mut place = 0;
        while place < COUNT {
            ids[place] = self.list[place].id;
            place += 1;
        }
        ids
    }

    /// Finds a kind by id.
    #[must_use]
    #[inline(never)]
    pub fn kind(self, id: KindId) -> Option<&'static ModuleKind> {
        self.list.iter().copied().find(|kind| kind.id == id)
    }

    /// Describes parameter `index` of a kind; none after the last one, except number 127, the
    /// [period](crate::Rate) of the module.
    #[must_use]
    #[inline(never)]
    pub fn describe_parameter(self, kind: KindId, index: u8) -> Option<Parameter> {
        let mut found = None;
        let kind = self.kind(kind)?;
        if index == EVERY_TICKS {
            return Some(rate::PARAMETER);
        }
        kind.describe(&mut Parameters::get(index, None, &mut found));
        found.map(|(parameter, _)| parameter)
    }

    /// Returns the name of a module; `?` for a kind that is not in the list.
    #[must_use]
    pub fn module_name(self, module: ModuleRef) -> Name<'static> {
        let name = self.kind(module.kind).map_or("?", |kind| kind.name);
        Name { name, number: module.number }
    }

    /// Finds a module by name, `PDCTRL_MOD` or `PDCTRL_MOD.2`. The instance need not exist.
    #[must_use]
    pub fn module(self, word: &str) -> Option<ModuleRef> {
        numbered(self.list().iter().map(|kind| kind.name), word)
    }

    /// Finds a parameter of a module kind by name.
    #[must_use]
    pub fn parameter(self, kind: KindId, name: &str) -> Option<u8> {
        let described = |index| Some((index, self.describe_parameter(kind, index)?));
        let found = (0..=u8::MAX).map_while(described).chain(described(EVERY_TICKS));
        found.into_iter().find(|(_, parameter)| parameter.name == name).map(|(index, _)| index)
    }

    /// Counts the kinds in these lists; for [`join_kinds`](crate::join_kinds).
    #[doc(hidden)]
    #[must_use]
    pub const fn count(mut lists: &[Self]) -> usize {
        let mut count = 0;
        while let [first, rest @ ..] = lists {
            count += first.list.len();
            lists = rest;
        }
        count
    }

    /// Concatenates these lists; for [`join_kinds`](crate::join_kinds).
    #[doc(hidden)]
    #[must_use]
    #[expect(clippy::indexing_slicing, reason = "a constant: out of bounds is a build error")]
    pub const fn joined<const COUNT: usize>(lists: &[Self]) -> [&'static ModuleKind; COUNT] {
        let (mut all, mut place, mut lists) = ([lists[0].list[0]; COUNT], 0, lists);
        while let [first, rest @ ..] = lists {
            let mut list = first.list;
            while let [kind, others @ ..] = list {
                all[place] = *kind;
                (place, list) = (place + 1, others);
            }
            lists = rest;
        }
        all
    }
}

impl PartialEq for ModuleKinds {
    fn eq(&self, other: &Self) -> bool {
        self.list.iter().map(|kind| kind.id).eq(other.list.iter().map(|kind| kind.id))
    }
}

/// Creates [`ModuleKinds`] from module types, such as `kinds![MyLaw, dimsart_modules::Pd]`.
#[macro_export]
macro_rules! kinds {
    ($($module:ty),* $(,)?) => {
        $crate::ModuleKinds::new(const { &[$(const { &$crate::ModuleKind::of::<$module>() }),*] })
    };
}

/// Joins several lists, such as `join_kinds![dimsart_modules::CONTROL, MY_LAWS]`; the first must not be
/// empty.
#[macro_export]
macro_rules! join_kinds {
    ($($list:expr),+ $(,)?) => {
        const {
            const LISTS: &[$crate::ModuleKinds] = &[$($list),+];
            const JOINED: [&$crate::ModuleKind; $crate::ModuleKinds::count(LISTS)] = $crate::ModuleKinds::joined(LISTS);
            $crate::ModuleKinds::new(&JOINED)
        }
    };
}
