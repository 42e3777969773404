//! Module kinds: type-erased descriptions and functions of modules.

use core::cell::Cell;

use crate::data_base::Data;
use crate::device::DeviceDescriptor;
use crate::module::Module;
use crate::module::context::Context;
use crate::module::declare::Declarations;
use crate::module::kind_id::KindId;
use crate::module::port::Stage;
use crate::parameter::Parameters;
use crate::signal::{Summary, Words};

/// Calls a module whose configuration and state begin at these words of the Data Base.
pub(crate) type Compute = fn(&Data<'_>, u16, u16);

/// Initialises a module's state; the flag is whether it takes over from another module.
pub(crate) type Begin = fn(&Data<'_>, u16, u16, bool);

/// Declares the ports of a module with these settings, and fills in its handles.
type DeclarePorts = fn(&[Cell<u32>], &mut Declarations<'_>, &[Cell<u32>]);

/// A module kind: description and functions.
#[derive(Debug, Clone, Copy)]
pub struct ModuleKind {
    /// [`Module::NAME`].
    pub name: &'static str,
    /// Computed from the name.
    pub id: KindId,
    /// [`Module::SUMMARY`].
    pub summary: Summary,
    outlasts_arming: bool,
    runs_program: bool,
    handles: u8,
    settings_words: u8,
    state_words: u8,
    gains_words: u8,
    axis_words: u8,
    parameters: fn(&Configuration<'_>, u8, &mut Parameters<'_>),
    prepare: fn(&Configuration<'_>, &DeviceDescriptor),
    ports: DeclarePorts,
    /// None if there is no state.
    begin: Option<Begin>,
    compute: [Compute; 2],
}

/// Maximum words of a module's settings, and maximum number of handles.
pub(crate) const MAX_SETTINGS_WORDS: usize = 24;
pub(crate) const MAX_HANDLES: usize = 16;

/// Parts of an instance's configuration.
#[derive(Debug)]
pub(crate) struct Configuration<'a> {
    settings: &'a [Cell<u32>],
    gains: &'a [Cell<u32>],
}

impl ModuleKind {
    /// Creates the kind of a module.
    #[must_use]
    pub const fn of<M: Module>() -> Self {
        const {
            assert!(M::Settings::COUNT <= MAX_SETTINGS_WORDS, "a module's settings take more than 24 words");
            assert!(M::Ports::COUNT <= MAX_HANDLES, "a module has more than 16 handles");
            assert!(M::State::COUNT < 256, "a module's state takes more than 255 words: declare memory");
            assert!(M::Gains::COUNT < 256 && M::AxisState::COUNT < 256, "an axis takes more than 255 words");
        }
        #[expect(clippy::cast_possible_truncation, reason = "checked above")]
        Self {
            name: M::NAME,
            id: KindId::from_name(M::NAME),
            summary: Summary::new(M::SUMMARY),
            outlasts_arming: M::KEEPS_STATE_ON_ARMING,
            runs_program: M::RUNS_PROGRAM,
            handles: M::Ports::COUNT as u8,
            settings_words: M::Settings::COUNT as u8,
            state_words: M::State::COUNT as u8,
            gains_words: M::Gains::COUNT as u8,
            axis_words: M::AxisState::COUNT as u8,
            parameters: visit::<M>,
            prepare: prepare::<M>,
            ports: ports::<M>,
            begin: if M::State::COUNT + M::AxisState::COUNT == 0 { None } else { Some(begin::<M>) },
            compute: [compute::<M>, compute_late::<M>],
        }
    }

    /// [`Module::KEEPS_STATE_ON_ARMING`].
    pub(crate) const fn outlasts_arming(&self) -> bool {
        self.outlasts_arming
    }

    /// Returns whether its modules run a [program](crate::online).
    #[must_use]
    pub const fn runs_program(&self) -> bool {
        self.runs_program
    }

    /// Returns the number of the [program](crate::online) of a module with these settings; 0 for none.
    pub(crate) fn program(&self, settings: &[Cell<u32>]) -> u8 {
        let number = settings.first().filter(|_| self.runs_program()).map_or(0, Cell::get);
        u8::try_from(number).unwrap_or(0)
    }

    /// Returns the words of an instance on a device with `dof` axes.
    #[must_use]
    pub const fn words(&self, dof: usize) -> usize {
        self.configuration_words(dof) + self.state_words(dof)
    }

    /// Returns the words of handles, settings and gains.
    pub(crate) const fn configuration_words(&self, dof: usize) -> usize {
        self.handles as usize + self.settings_words as usize + dof * self.gains_words as usize
    }

    /// Returns the words of state, of the module and of all axes.
    pub(crate) const fn state_words(&self, dof: usize) -> usize {
        self.state_words as usize + dof * self.axis_words as usize
    }

    /// Returns the number of handles, the first words of the configuration.
    pub(crate) fn handles(&self) -> usize {
        self.handles.into()
    }

    /// Returns the range of the settings in the configuration.
    pub(crate) fn settings(&self) -> core::ops::Range<usize> {
        let start = self.handles();
        start..start + usize::from(self.settings_words)
    }

    /// Splits an instance's configuration into its parts.
    pub(crate) fn configuration<'a>(&self, words: &'a [Cell<u32>]) -> Configuration<'a> {
        let settings = self.settings();
        let gains = words.get(settings.end..).unwrap_or_default();
        Configuration { settings: words.get(settings).unwrap_or_default(), gains }
    }

    /// Visits the parameters, with the gains of one axis.
    pub(crate) fn parameters(&self, of: &Configuration<'_>, axis: u8, visit: &mut Parameters<'_>) {
        (self.parameters)(of, axis, visit);
    }

    /// Visits the parameters without an instance, to describe them.
    pub(crate) fn describe(&self, visit: &mut Parameters<'_>) {
        (self.parameters)(&Configuration { settings: &[], gains: &[] }, 0, visit);
    }

    /// Sets all parameters in the settings to their defaults, without an instance.
    pub(crate) fn set_defaults(&self, settings: &[Cell<u32>]) {
        (self.parameters)(&Configuration { settings, gains: &[] }, 0, &mut Parameters::defaults());
    }

    /// Computes the values derived from the parameters.
    pub(crate) fn prepare(&self, of: &Configuration<'_>, device: &DeviceDescriptor) {
        (self.prepare)(of, device);
    }

    /// Declares the ports of a module with these settings, and fills in its handles.
    pub(crate) fn ports(
        &self,
        settings: &[Cell<u32>],
        declare: &mut Declarations<'_>,
        handles: &[Cell<u32>],
    ) {
        (self.ports)(settings, declare, handles);
    }

    /// Returns the function that initialises the state, if there is a state.
    pub(crate) fn begin(&self) -> Option<Begin> {
        self.begin
    }

    /// Returns the function of a stage.
    pub(crate) fn compute(&self, stage: Stage) -> Compute {
        let [early, late] = self.compute;
        match stage {
            Stage::Early => early,
            Stage::Late => late,
        }
    }
}

impl<'a> Configuration<'a> {
    /// Returns `count` words of an axis' gains; empty if there is no such axis.
    #[inline(never)]
    fn gains(&self, axis: usize, count: usize) -> &'a [Cell<u32>] {
        self.gains.get(axis * count..).and_then(|words| words.get(..count)).unwrap_or_default()
    }
}

fn visit<M: Module>(of: &Configuration<'_>, axis: u8, visit: &mut Parameters<'_>) {
    let lane = of.gains(axis.into(), M::Gains::COUNT);
    let (mut settings, mut gains) = (load::<M::Settings>(of.settings), load::<M::Gains>(lane));
    M::parameters(&mut settings, &mut gains, visit);
    if visit.admits_change(M::validate(&settings)) {
        store(&settings, of.settings);
        store(&gains, lane);
    }
}

/// As [`Words::load`], but not inlined, to save flash; for use between ticks.
#[inline(never)]
fn load<T: Words>(words: &[Cell<u32>]) -> T {
    let zeros = [const { Cell::new(0) }; MAX_SETTINGS_WORDS];
    // Cut to the length that is read, so that there is one length check.
    T::load(words.get(..T::COUNT).or(zeros.get(..T::COUNT)).unwrap_or_default())
}

/// As [`Words::store`], but not inlined.
#[inline(never)]
fn store<T: Words>(value: &T, words: &[Cell<u32>]) {
    if let Some(words) = words.get(..T::COUNT) {
        value.store(words);
    }
}

fn prepare<M: Module>(of: &Configuration<'_>, device: &DeviceDescriptor) {
    let mut settings = load::<M::Settings>(of.settings);
    M::prepare(&mut settings, device);
    store(&settings, of.settings);
    if M::Gains::COUNT == 0 {
        return;
    }
    for axis in 0..device.dof() {
        let lane = of.gains(axis, M::Gains::COUNT);
        let mut gains = load::<M::Gains>(lane);
        M::prepare_axis(&settings, &mut gains, device);
        store(&gains, lane);
    }
}

fn ports<M: Module>(settings: &[Cell<u32>], declare: &mut Declarations<'_>, handles: &[Cell<u32>]) {
    store(&M::ports(&load::<M::Settings>(settings), declare), handles);
}

fn begin<M: Module>(data: &Data<'_>, configuration: u16, state: u16, takes_over: bool) {
    if let Some(context) = Context::new(data, configuration, state) {
        M::begin(&context.beginning(takes_over));
    }
}

fn compute<M: Module>(data: &Data<'_>, configuration: u16, state: u16) {
    if let Some(context) = Context::new(data, configuration, state) {
        M::compute(&context);
    }
}

fn compute_late<M: Module>(data: &Data<'_>, configuration: u16, state: u16) {
    if let Some(context) = Context::new(data, configuration, state) {
        M::compute_late(&context);
    }
}
