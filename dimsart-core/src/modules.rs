//! The module library, one file per kind.

mod channel;
pub mod comm_rx;
pub mod comm_tx;
pub mod differentiator;
pub mod integrator;
pub mod normalizer;
pub mod p;
pub mod pd;
pub mod pid;
mod reception;
pub mod recorder;
pub mod signal_generator;
pub mod sum;
pub mod time_delay;
pub mod velocity_to_position;
pub mod virtual_wall;
pub mod wave_impedance;
mod wave_integral;
pub mod wave_transformer;

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
