//! The module library, one file per kind.

mod comm_rx;
mod comm_tx;
mod differentiator;
mod integrator;
mod normalizer;
mod p;
mod pd;
mod pid;
mod recorder;
mod signal_generator;
mod sum;
mod time_delay;
mod velocity_to_position;
mod virtual_wall;
mod wave_impedance;
mod wave_integral;
mod wave_transformer;

pub use comm_rx::CommRx;
pub use comm_tx::CommTx;
pub use differentiator::Differentiator;
pub use integrator::Integrator;
pub use normalizer::Normalizer;
pub use p::P;
pub use pd::Pd;
pub use pid::Pid;
pub use recorder::Recorder;
pub use signal_generator::SignalGenerator;
pub use sum::Sum;
pub use time_delay::TimeDelay;
pub use velocity_to_position::VelocityToPosition;
pub use virtual_wall::VirtualWall;
pub use wave_impedance::WaveImpedance;
pub use wave_transformer::WaveTransformer;

crate::module_list! {
    /// Every module of the library. A new one is a file above and a line here.
    pub enum Standard {
        CommRx(CommRx),
        CommTx(CommTx),
        WaveTransformer(WaveTransformer),
        WaveImpedance(WaveImpedance),
        TimeDelay(TimeDelay),
        P(P),
        Pd(Pd),
        Pid(Pid),
        VirtualWall(VirtualWall),
        Sum(Sum),
        Normalizer(Normalizer),
        Integrator(Integrator),
        Differentiator(Differentiator),
        VelocityToPosition(VelocityToPosition),
        SignalGenerator(SignalGenerator),
        Recorder(Recorder),
    }
}
