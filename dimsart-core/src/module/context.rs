//! Context of a module's call in a tick: its own memory, and the Data Base through its ports.

use core::cell::Cell;
use core::marker::PhantomData;
use core::ops::Deref;

use crate::data_base::{Data, Inputs, Outputs};
use crate::module::Module;
use crate::signal::Words;

/// Context of a module's call in a tick. It dereferences to the Data Base: `context.get(port)`.
#[derive(Debug)]
pub struct Context<'a, M: Module> {
    data: &'a Data<'a>,
    /// Handles, settings, then gains of each axis.
    configuration: &'a [Cell<u32>],
    /// State of the module, then of each axis.
    state: &'a [Cell<u32>],
    takes_over: bool,
    module: PhantomData<M>,
}

impl<'a, M: Module> Deref for Context<'a, M> {
    type Target = Data<'a>;

    #[inline(always)]
    fn deref(&self) -> &Data<'a> {
        self.data
    }
}

impl<'a, M: Module> Context<'a, M> {
    const SETTINGS: usize = M::Ports::COUNT;
    const GAINS: usize = Self::SETTINGS + M::Settings::COUNT;

    /// Creates the context from the first words of configuration and state; none if there are too few words.
    #[inline(always)]
    pub(crate) fn new(data: &'a Data<'a>, configuration: u16, state: u16) -> Option<Self> {
        let configuration = match Self::GAINS + M::Gains::COUNT {
            0 => &[],
            _ => data.range(configuration, Self::GAINS + data.dof() * M::Gains::COUNT)?,
        };
        let state = match M::State::COUNT + M::AxisState::COUNT {
            0 => &[],
            _ => data.range(state, M::State::COUNT + data.dof() * M::AxisState::COUNT)?,
        };
        Some(Self { data, configuration, state, takes_over: false, module: PhantomData })
    }

    /// Returns the context for the initialisation of the module's state.
    #[inline(always)]
    pub(crate) fn beginning(self, takes_over: bool) -> Self {
        Self { takes_over, ..self }
    }

    /// Returns whether the module that [begins](Module::begin) takes over from another module in a running
    /// scheme: its outputs then hold that module's values of the last tick. Otherwise it begins as after a
    /// start.
    #[inline(always)]
    #[must_use]
    pub fn takes_over(&self) -> bool {
        self.takes_over
    }

    /// Returns the module's handles.
    #[inline(always)]
    #[must_use]
    pub fn ports(&self) -> M::Ports {
        M::Ports::load(self.part(0, M::Ports::COUNT))
    }

    /// Returns one of the module's handles by its index, for a module with a row of ports.
    #[inline(always)]
    #[must_use]
    pub fn port<T: Words>(&self, place: usize) -> T {
        let handles = self.part(0, M::Ports::COUNT);
        T::load(handles.get(place..).unwrap_or_default())
    }

    #[inline(always)]
    fn part(&self, start: usize, words: usize) -> &'a [Cell<u32>] {
        self.configuration.get(start..start + words).unwrap_or_default()
    }

    /// Returns the Data Base, to compute axes without parameters and state.
    #[inline(always)]
    #[must_use]
    pub fn data(&self) -> &'a Data<'a> {
        self.data
    }

    /// Returns the parameters of all axes.
    #[inline(always)]
    #[must_use]
    pub fn settings(&self) -> M::Settings {
        M::Settings::load(self.part(Self::SETTINGS, M::Settings::COUNT))
    }

    /// Returns the module's state.
    #[inline(always)]
    #[must_use]
    pub fn state(&self) -> M::State {
        M::State::load(self.state_words())
    }

    /// Stores the module's state for the next tick.
    #[inline(always)]
    pub fn set_state(&self, state: M::State) {
        state.store(self.state_words());
    }

    #[inline(always)]
    fn state_words(&self) -> &'a [Cell<u32>] {
        self.state.get(..M::State::COUNT).unwrap_or_default()
    }

    /// Zeroes all state; the default initialisation.
    pub fn clear(&self) {
        clear(self.state);
    }

    /// Zeroes the state of all axes.
    pub fn clear_axes(&self) {
        clear(self.state.get(M::State::COUNT..).unwrap_or_default());
    }

    /// Returns the words of an axis' parameters.
    #[must_use]
    #[inline(always)]
    pub fn gain_words(&self, axis: usize) -> &'a [Cell<u32>] {
        let start = Self::GAINS + axis * M::Gains::COUNT;
        self.configuration.get(start..start + M::Gains::COUNT).unwrap_or_default()
    }

    /// Returns the words of an axis' state.
    #[must_use]
    #[inline(always)]
    pub fn axis_words(&self, axis: usize) -> &'a [Cell<u32>] {
        let start = M::State::COUNT + axis * M::AxisState::COUNT;
        self.state.get(start..start + M::AxisState::COUNT).unwrap_or_default()
    }

    /// Initialises the state of every axis from its gains and inputs.
    #[inline(always)]
    pub fn begin_axes<I: Inputs>(
        &self,
        inputs: I,
        mut first: impl FnMut(M::Gains, I::Values) -> M::AxisState,
    ) {
        self.map_axis_contexts(inputs, [], |_, lane, inputs| {
            lane.set_axis(first(lane.gains(), inputs));
            []
        });
    }

    /// Computes every axis by the same law.
    ///
    /// The law gets the gains, the state and the inputs of an axis and returns its outputs: an array of `f32`
    /// for an array of at most 8 ports, a tuple for a tuple of at most 4 ports of any formats.
    #[inline(always)]
    pub fn map_axes<I: Inputs, O: Outputs>(
        &self,
        inputs: I,
        outputs: O,
        mut law: impl FnMut(M::Gains, &mut M::AxisState, I::Values) -> O::Values,
    ) {
        self.map_axis_contexts(inputs, outputs, |_, lane, inputs| {
            let mut axis = lane.axis();
            let outputs = law(lane.gains(), &mut axis, inputs);
            lane.set_axis(axis);
            outputs
        });
    }

    /// As [`map_axes`](Self::map_axes), for a law that needs the axis number or access to single parameters
    /// and state.
    #[inline(always)]
    pub fn map_axis_contexts<I: Inputs, O: Outputs>(
        &self,
        inputs: I,
        outputs: O,
        mut law: impl FnMut(usize, AxisContext<'a, M>, I::Values) -> O::Values,
    ) {
        let Some(sources) = inputs.words(self.data) else { return };
        let Some(sinks) = outputs.words(self.data) else { return };
        let mut gains = self.configuration.get(Self::GAINS..).unwrap_or_default();
        let mut state = self.state.get(M::State::COUNT..).unwrap_or_default();
        for axis in 0..self.data.dof() {
            let Some((own_gains, gains_behind)) = gains.split_at_checked(M::Gains::COUNT) else { return };
            let Some((own_state, state_behind)) = state.split_at_checked(M::AxisState::COUNT) else { return };
            (gains, state) = (gains_behind, state_behind);
            let lane = AxisContext { gains: own_gains, state: own_state, module: PhantomData };
            let values = law(axis, lane, I::read(&sources, axis));
            O::write(&sinks, axis, values);
        }
    }
}

#[inline(never)]
fn clear(words: &[Cell<u32>]) {
    words.iter().for_each(|word| word.set(0));
}

/// Parameters and state of one axis.
#[derive(Debug)]
pub struct AxisContext<'a, M: Module> {
    gains: &'a [Cell<u32>],
    state: &'a [Cell<u32>],
    module: PhantomData<M>,
}

impl<M: Module> AxisContext<'_, M> {
    /// Returns the parameters of the axis.
    #[inline(always)]
    #[must_use]
    pub fn gains(&self) -> M::Gains {
        M::Gains::load(self.gains)
    }

    /// Returns element `place` of an array of `T` at the start of the axis' parameters, so that only this
    /// element of a table is loaded. None after the end of the parameters.
    #[inline(always)]
    #[must_use]
    pub fn gain_element<T: Words>(&self, place: usize) -> Option<T> {
        one_of(self.gains, place)
    }

    /// Returns the state of the axis.
    #[inline(always)]
    #[must_use]
    pub fn axis(&self) -> M::AxisState {
        M::AxisState::load(self.state)
    }

    /// Returns element `place` of an array of `T` at the start of the axis' state, as [`gain_element`](Self::gain_element).
    #[inline(always)]
    #[must_use]
    pub fn state_element<T: Words>(&self, place: usize) -> Option<T> {
        one_of(self.state, place)
    }

    /// Stores the state of the axis for the next tick.
    #[inline(always)]
    pub fn set_axis(&self, axis: M::AxisState) {
        axis.store(self.state);
    }
}

#[inline(always)]
fn one_of<T: Words>(words: &[Cell<u32>], place: usize) -> Option<T> {
    words.get(place.checked_mul(T::COUNT)?..)?.get(..T::COUNT).map(T::load)
}
